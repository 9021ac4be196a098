//! What every port to an RS-485 line can do, and how one is opened.

use std::fmt;
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

use codewheel_station::rs485::{BaudRate, Transmission};

use super::{listen, tcp};
use crate::lasting::lasting;
use crate::{BusUri, LinkError, Medium, Notice, Waker};

/// A port to an RS-485 line: telegrams out, octets and reports in, one place to wait.
///
/// A port belongs to one thread at a time; only its [`Waker`] is shared. Dropping the port leaves
/// the line and closes every connection. What it sends does not come back to it, unless an adapter
/// echoes.
pub trait Rs485Port: Send + fmt::Debug {
    /// Hands a telegram over without waiting. An RS-485 line always takes one; where the other side
    /// does not read, what is oldest is lost and told as a notice.
    ///
    /// # Errors
    /// [`LinkError`] when the port is lost for good.
    fn send(&mut self, transmission: &Transmission) -> Result<(), LinkError>;

    /// Waits until something arrives, at most `wait` (`None`: without limit; zero: not at all).
    ///
    /// Gives `None` when the wait is over and nothing has arrived: never early, and on Unix some
    /// 0.1 ms late, elsewhere a tick of the system.
    ///
    /// # Errors
    /// [`LinkError`] when the port is lost for good; what had arrived before is given first.
    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Rs485Received>, LinkError>;

    /// A handle that ends a wait in [`receive`](Self::receive) from another thread.
    fn waker(&self) -> Waker;

    /// Whether the line has a rate of its own, which [`set_baud_rate`](Self::set_baud_rate) follows
    /// and a search can find. Over TCP and on a pty octets have no rate.
    fn has_rate(&self) -> bool;

    /// Listens and speaks at `rate` from now on; nothing where the line has no rate. A rate that
    /// the hardware cannot make is told as a notice.
    ///
    /// # Errors
    /// [`LinkError`] when the port is lost for good.
    fn set_baud_rate(&mut self, rate: BaudRate) -> Result<(), LinkError>;

    /// The TCP address that others connect to, with the port the system chose where 0 was asked;
    /// `None` for ports that nobody connects to by TCP.
    fn local_address(&self) -> Option<SocketAddr>;

    /// The port as a bus URI, with the TCP port the system chose where 0 was asked:
    /// `rs485-listen:127.0.0.1:4002`.
    fn describe(&self) -> String;
}

/// What a port gives to its owner.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Rs485Received {
    /// Octets in the order in which they came, at least one and at most 512.
    Octets(Vec<u8>),
    /// A character with a parity, framing or overrun error, or a break.
    BrokenCharacter,
    /// Something for people.
    Notice(Notice),
    /// A [`Waker`] of this port was used since the last report of this kind.
    Woken,
}

/// Joins the line that `uri` names, at `rate` where it has one.
///
/// Takes at most 5 s (`rs485:HOST:PORT`, when nobody answers); the other kinds do not wait. A serial
/// port or a connection that is lost later is sought until it is back; what is sent meanwhile is
/// gone, and nothing is heard. [`Notice::BusLost`] and [`Notice::BusBack`] tell of it.
///
/// # Errors
/// [`LinkError`] when the address is taken or unknown, nobody answers, the path is no serial port
/// or cannot be taken, or the bus carries no RS-485. A `virtual:` bus is simulated by its plant, so
/// no port leads to it.
pub fn open_rs485(uri: &BusUri, rate: BaudRate) -> Result<Box<dyn Rs485Port>, LinkError> {
    Ok(match uri {
        BusUri::Rs485Listen(endpoint) => Box::new(listen::listen(endpoint)?),
        BusUri::Rs485(endpoint) => {
            let endpoint = endpoint.clone();
            Box::new(lasting(uri, move || Ok(boxed(tcp::connect(&endpoint)?)))?)
        }
        BusUri::Rs485ListenPty(path) => open_pty(uri, path)?,
        BusUri::Rs485Device(path) => open_terminal(uri, path, rate)?,
        _ => return Err(LinkError::OtherMedium { uri: uri.clone(), wanted: Medium::Rs485 }),
    })
}

fn boxed(port: impl Rs485Port + 'static) -> Box<dyn Rs485Port> {
    Box::new(port)
}

#[cfg(unix)]
fn open_pty(_: &BusUri, path: &Path) -> Result<Box<dyn Rs485Port>, LinkError> {
    Ok(Box::new(super::pty::listen(path)?))
}

#[cfg(unix)]
fn open_terminal(
    uri: &BusUri,
    path: &Path,
    rate: BaudRate,
) -> Result<Box<dyn Rs485Port>, LinkError> {
    let path = path.to_owned();
    Ok(Box::new(lasting(uri, move || Ok(boxed(super::terminal::open(&path, rate)?)))?))
}

#[cfg(not(unix))]
fn open_pty(uri: &BusUri, _: &Path) -> Result<Box<dyn Rs485Port>, LinkError> {
    Err(not_here(uri))
}

#[cfg(not(unix))]
fn open_terminal(uri: &BusUri, _: &Path, _: BaudRate) -> Result<Box<dyn Rs485Port>, LinkError> {
    Err(not_here(uri))
}

#[cfg(not(unix))]
fn not_here(uri: &BusUri) -> LinkError {
    let instead = "rs485-listen:HOST:PORT or rs485:HOST:PORT for RS-485";
    LinkError::NotHere { uri: uri.clone(), needs: "a Unix system", instead }
}

//! What every port to a CAN segment can do, and how one is opened.

use std::fmt;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use codewheel_station::can::{BitRate, Frame};

use crate::lasting::lasting;
use crate::segment::listen;
#[cfg(target_os = "linux")]
use crate::socketcan;
use crate::{BusUri, LinkError, Medium, Notice};
use crate::{slcan, socketcand, virtual_bus};

/// A port to a CAN segment: frames out, frames and reports in, one place to wait.
///
/// A port belongs to one thread at a time; only its [`Waker`] is shared. Dropping the port leaves
/// the bus and closes every connection.
pub trait CanPort: Send + fmt::Debug {
    /// Whether [`send`](Self::send) would take a frame now. Ask before building one, so that it is
    /// as fresh as its departure.
    fn is_ready(&self) -> bool;

    /// Hands `frame` over without waiting: `true` when the port took it, `false` when it cannot
    /// take one now and the frame is still the caller's.
    ///
    /// # Errors
    /// [`LinkError`] when the port is lost for good.
    fn send(&mut self, frame: &Frame) -> Result<bool, LinkError>;

    /// Waits until something arrives, at most `wait` (`None`: without limit; zero: not at all).
    ///
    /// Gives `None` when the wait is over, and also, without waiting on, when the port can take a
    /// frame again. Never gives `None` for a wait that ended early without one of these reasons.
    ///
    /// # Errors
    /// [`LinkError`] when the port is lost for good; what had arrived before is given first.
    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Received>, LinkError>;

    /// A handle that ends a wait in [`receive`](Self::receive) from another thread.
    fn waker(&self) -> Waker;

    /// Whether the port reports [`Received::Sent`] for the frames it takes. A port may learn this
    /// from its adapter, so ask anew each time. Where it does not, [`Loop`](crate::Loop) stands in
    /// after [`STAND_IN`](crate::STAND_IN).
    fn confirms(&self) -> bool;

    /// The TCP address that others connect to, with the port the system chose where 0 was asked;
    /// `None` for ports that nobody connects to.
    fn local_address(&self) -> Option<SocketAddr>;

    /// The port as a bus URI, with the TCP port the system chose where 0 was asked:
    /// `slcan-listen:127.0.0.1:4001`.
    fn describe(&self) -> String;
}

/// What a port gives to its owner.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Received {
    /// A frame of another node.
    Frame(Frame),
    /// Our frame went out and another node acknowledged it.
    Sent(Frame),
    /// The controller left the bus; what was handed to it is gone.
    BusOff,
    /// The controller takes part again.
    Recovered,
    /// What leads to the bus is lost; what was handed over is gone.
    Detached,
    /// The bus is there again.
    Attached,
    /// Something for people.
    Notice(Notice),
    /// A [`Waker`] of this port was used since the last report of this kind.
    Woken,
}

/// Ends the wait of a port, from any thread.
///
/// A wake-up is not lost when nobody waits: the next [`CanPort::receive`] reports it at once.
/// Several wake-ups before that are one. Waking a port that is gone does nothing.
#[derive(Clone)]
pub struct Waker {
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl Waker {
    pub(crate) fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self { wake: Arc::new(wake) }
    }

    /// Makes the port report [`Received::Woken`], at once when it is waiting. For threads; not for
    /// a bare POSIX signal handler, since it may take a lock for some microseconds.
    pub fn wake(&self) {
        (self.wake)();
    }
}

impl fmt::Debug for Waker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Waker").finish_non_exhaustive()
    }
}

/// Joins the bus that `uri` names, at `rate`.
///
/// Takes at most 5 s (`slcan:HOST:PORT`, when nobody answers); the other kinds do not wait. An
/// adapter, a connection or an interface that is lost later is sought until it is back. The station
/// hears [`Received::Detached`] and [`Received::Attached`], people [`Notice::BusLost`] and
/// [`Notice::BusBack`]; meanwhile the port takes nothing.
///
/// # Errors
/// [`LinkError`] when the address is taken or unknown, nobody answers, the virtual bus runs at
/// another bit rate, the interface is missing, down or at another bit rate, or the bus carries no
/// CAN.
pub fn open(uri: &BusUri, rate: BitRate) -> Result<Box<dyn CanPort>, LinkError> {
    Ok(match uri {
        BusUri::Virtual(name) => Box::new(virtual_bus::join(name, rate)?),
        BusUri::SocketCan(interface) => open_interface(uri, interface, rate)?,
        BusUri::SlcanListen(endpoint) => Box::new(listen::<slcan::Channel>(endpoint, rate)?),
        BusUri::SocketcandListen(endpoint) => {
            Box::new(listen::<socketcand::Session>(endpoint, rate)?)
        }
        BusUri::SlcanListenPty(path) => open_pty(uri, path, rate)?,
        BusUri::Slcan(endpoint) => {
            let endpoint = endpoint.clone();
            Box::new(lasting(uri, move || Ok(boxed(slcan::connect(&endpoint, rate)?)))?)
        }
        BusUri::SlcanDevice { path, speed } => open_adapter(uri, path, *speed, rate)?,
        BusUri::Rs485Listen(_)
        | BusUri::Rs485ListenPty(_)
        | BusUri::Rs485(_)
        | BusUri::Rs485Device(_) => {
            return Err(LinkError::OtherMedium { uri: uri.clone(), wanted: Medium::Can });
        }
    })
}

fn boxed(port: impl CanPort + 'static) -> Box<dyn CanPort> {
    Box::new(port)
}

#[cfg(target_os = "linux")]
fn open_interface(
    uri: &BusUri,
    interface: &str,
    rate: BitRate,
) -> Result<Box<dyn CanPort>, LinkError> {
    let interface = interface.to_owned();
    Ok(Box::new(lasting(uri, move || Ok(boxed(socketcan::open(&interface, rate)?)))?))
}

#[cfg(unix)]
fn open_pty(_: &BusUri, path: &Path, rate: BitRate) -> Result<Box<dyn CanPort>, LinkError> {
    Ok(Box::new(slcan::listen_pty(path, rate)?))
}

#[cfg(unix)]
fn open_adapter(
    uri: &BusUri,
    path: &Path,
    speed: u32,
    rate: BitRate,
) -> Result<Box<dyn CanPort>, LinkError> {
    let path = path.to_owned();
    Ok(Box::new(lasting(uri, move || Ok(boxed(slcan::open_serial(&path, speed, rate)?)))?))
}

#[cfg(not(target_os = "linux"))]
fn open_interface(uri: &BusUri, _: &str, _: BitRate) -> Result<Box<dyn CanPort>, LinkError> {
    Err(not_here(uri, "Linux"))
}

#[cfg(not(unix))]
fn open_pty(uri: &BusUri, _: &Path, _: BitRate) -> Result<Box<dyn CanPort>, LinkError> {
    Err(not_here(uri, "a Unix system"))
}

#[cfg(not(unix))]
fn open_adapter(uri: &BusUri, _: &Path, _: u32, _: BitRate) -> Result<Box<dyn CanPort>, LinkError> {
    Err(not_here(uri, "a Unix system"))
}

#[cfg(not(target_os = "linux"))]
fn not_here(uri: &BusUri, needs: &'static str) -> LinkError {
    let instead = "slcan:HOST:PORT, slcan-listen:HOST:PORT or socketcand-listen:HOST:PORT for CAN";
    LinkError::NotHere { uri: uri.clone(), needs, instead }
}

//! Getting on a bus.

mod devicenet;
mod profibus;

use codewheel_commission::{Kind, Sample, Survey, Trouble};
use codewheel_device::product::Bus;
use codewheel_link::{BusUri, Medium, Waker};
use codewheel_station::Duration;

use super::encoder::Encoder;
use super::stoppable::Stop;
use super::watch::Scale;
use crate::arguments::Chatter;
use crate::arguments::commission::{BusArguments, EncoderAddress};
use crate::failure::Failure;
use crate::signals::stop_flag;

/// How an encoder can be watched.
pub(super) enum Way<'a> {
    /// As its master.
    Serve(Encoder<'a>),
    /// From what its own master asks it.
    Listen(Listener),
}

/// Ears for one encoder.
pub(super) struct Listener {
    /// Whom it hears, in words.
    pub(super) who: String,
    pub(super) scale: Scale,
    pub(super) stop: Stop,
    /// Waits for the next position.
    pub(super) next: Box<dyn FnMut() -> Result<Sample, Trouble>>,
}

/// Looks who is on the bus.
pub(super) fn scan(arguments: &BusArguments, chatter: Chatter) -> Result<Survey, Failure> {
    let uri = uri(arguments)?;
    match which(arguments, uri)? {
        Bus::DeviceNet => devicenet::scan(uri, arguments, chatter),
        Bus::Profibus => profibus::scan(uri, arguments, chatter),
    }
}

/// Becomes the master of the encoder.
pub(super) fn open(at: &EncoderAddress, chatter: Chatter) -> Result<Encoder<'_>, Failure> {
    let uri = uri(&at.bus)?;
    match which(&at.bus, uri)? {
        Bus::DeviceNet => devicenet::open(uri, at, chatter),
        Bus::Profibus => profibus::open(uri, at, chatter),
    }
}

/// Becomes the master of the encoder where it has none, else listens to what it says.
pub(super) fn open_or_listen(at: &EncoderAddress, chatter: Chatter) -> Result<Way<'_>, Failure> {
    let uri = uri(&at.bus)?;
    match which(&at.bus, uri)? {
        Bus::DeviceNet => devicenet::open_or_listen(uri, at, chatter),
        Bus::Profibus => profibus::open_or_listen(uri, at, chatter),
    }
}

fn uri(arguments: &BusArguments) -> Result<&BusUri, Failure> {
    arguments.bus.as_ref().ok_or_else(|| {
        Failure::Usage(
            "say with --bus which bus it is on, as in --bus slcan:/dev/ttyACM0".to_owned(),
        )
    })
}

/// The bus that was meant, where its URI says it.
pub(super) fn of(arguments: &BusArguments) -> Option<Bus> {
    match arguments.bus.as_ref()?.medium() {
        Medium::Can => Some(Bus::DeviceNet),
        Medium::Rs485 => Some(Bus::Profibus),
        Medium::Any => None,
    }
}

/// Which bus a port leads to.
fn which(arguments: &BusArguments, uri: &BusUri) -> Result<Bus, Failure> {
    let bus = of(arguments).ok_or_else(|| {
        Failure::Usage(format!(
            "{uri} is a bus inside another process, which nobody joins from here: let that process \
             listen, on slcan-listen:127.0.0.1:4001 or rs485-listen:127.0.0.1:4002, and write \
             slcan:127.0.0.1:4001 or rs485:127.0.0.1:4002 here"
        ))
    })?;
    if bus == Bus::DeviceNet && arguments.join {
        return Err(Failure::Usage(
            "--join is for the token ring of PROFIBUS; on DeviceNet masters need not know each other"
                .to_owned(),
        ));
    }
    Ok(bus)
}

/// The address given with `option`, from 0 to `highest`.
fn address(option: &str, given: u8, highest: u8, bus: Bus) -> Result<u8, Failure> {
    if given <= highest {
        return Ok(given);
    }
    Err(Failure::Usage(format!(
        "invalid value '{given}' for '{option} <N>': {bus} has 0–{highest}"
    )))
}

/// The address of the encoder, which is given wherever an encoder is meant.
fn encoder_address(at: &EncoderAddress, highest: u8, bus: Bus) -> Result<u8, Failure> {
    let given = at.address.ok_or_else(|| {
        Failure::Usage("say with --address which encoder, as in --address 5".to_owned())
    })?;
    address("--address", given, highest, bus)
}

/// How long to listen first: what was asked for, else `least`.
fn listening(arguments: &BusArguments, least: Duration) -> Duration {
    arguments.listen_for.map_or(least, |time| time.0)
}

/// A stop that Ctrl-C wants, which also ends the wait in a port.
fn stop(waker: Waker, arguments: &BusArguments) -> Result<Stop, Failure> {
    let limit = arguments.timeout.map(|time| time.0.into());
    stop_flag(move || waker.wake()).map(|asked| Stop::new(asked, limit))
}

/// What came of opening: an end that a person wanted is no trouble, and one by the clock a time-out.
fn opened<T>(result: Result<T, Trouble>, stop: &Stop) -> Result<T, Failure> {
    let result = result.map_err(|trouble| {
        if stop.was_asked() {
            return Failure::Interrupted;
        }
        if !stop.is_wanted() {
            return trouble.into();
        }
        let came = "the time given with --timeout was over before";
        Trouble::new(Kind::TimeOut, trouble.tried, came, "give it more time").into()
    });
    stop.lift_limit();
    result
}

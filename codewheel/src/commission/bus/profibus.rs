//! Getting on a PROFIBUS.

use codewheel_commission::profibus::{
    Console, Eavesdropper, Encoder as Slave, HIGHEST_ADDRESS, HeardSlave, ScanSettings,
    SessionSettings, scan as scan_bus,
};
use codewheel_commission::{Reading, Rs485Seat, Seat, Survey, Trouble};
use codewheel_device::product::Bus;
use codewheel_device::profibus::parameters::{
    self, FIRST_USER_OCTET, Row, SCALING, STEPS_PER_TURN, TOTAL_RESOLUTION,
};
use codewheel_link::{BusUri, Clock, Rs485Loop};
use codewheel_station::Duration;

use super::{Listener, Way, address, encoder_address, listening, opened, stop};
use crate::arguments::Chatter;
use crate::arguments::commission::{BusArguments, EncoderAddress};
use crate::commission::encoder::Encoder;
use crate::commission::progress::Bar;
use crate::commission::stoppable::{Stop, Stoppable};
use crate::commission::watch::Scale;
use crate::failure::Failure;
use crate::rates;

type OwnSeat = Stoppable<Rs485Seat<Console>>;

/// Ears on the bus, what ends them, and the rate in bit/s.
fn seat(uri: &BusUri, arguments: &BusArguments) -> Result<(OwnSeat, Stop, u32), Failure> {
    let rate = rates::profibus(arguments.baud.as_deref())?;
    let port = codewheel_link::open_rs485(uri, rate)?;
    let stop = stop(port.waker(), arguments)?;
    let seat = Rs485Seat::new(Console::new(rate), port, Rs485Loop::new(Clock::new()));
    Ok((Stoppable::new(seat, stop.clone()), stop, rate.bits_per_second()))
}

fn settings(arguments: &BusArguments) -> Result<ScanSettings, Failure> {
    let default = ScanSettings::default();
    let given = arguments.master.unwrap_or(default.address);
    let address = address("--master", given, HIGHEST_ADDRESS, Bus::Profibus)?;
    Ok(ScanSettings { address, join: arguments.join, ..default })
}

pub(super) fn scan(
    uri: &BusUri,
    arguments: &BusArguments,
    chatter: Chatter,
) -> Result<Survey, Failure> {
    let settings = settings(arguments)?;
    let (mut seat, stop, _) = seat(uri, arguments)?;
    let bar = Bar::new(chatter);
    let survey = listen_longer(&mut seat, arguments)
        .and_then(|()| scan_bus(&mut seat, settings, &mut |progress| bar.show(progress)));
    opened(survey, &stop)
}

/// What an encoder is to be served with.
fn session(at: &EncoderAddress) -> Result<(u8, SessionSettings), Failure> {
    let address = encoder_address(at, HIGHEST_ADDRESS, Bus::Profibus)?;
    let parameters = at.parameters.iter().map(|text| parameter(text));
    let parameters = parameters.collect::<Result<_, _>>()?;
    Ok((address, SessionSettings { master: settings(&at.bus)?, parameters, configuration: None }))
}

/// A parameter as `steps-per-turn=3600` or `direction=ccw`.
fn parameter(text: &str) -> Result<(String, Reading), Failure> {
    let wrong =
        |why: &str| Failure::Usage(format!("invalid value '{text}' for '--parameter': {why}"));
    let (key, value) =
        text.split_once('=').ok_or_else(|| wrong("write KEY=VALUE, as in steps-per-turn=3600"))?;
    let row = Row::find(key).ok_or_else(|| {
        let keys: Vec<_> = parameters::ROWS.iter().map(|row| row.key).collect();
        wrong(&format!("the keys are {}", keys.join(", ")))
    })?;
    let label = row.values.iter().position(|label| label.eq_ignore_ascii_case(value));
    let number = match label {
        Some(label) => label as i64,
        None => crate::hilo::number(value).map_err(|why| wrong(&why))?.into(),
    };
    Ok((key.to_owned(), Reading::Number(number)))
}

/// Listens for as long as was asked for; what comes after listens for as long as the bus needs.
fn listen_longer(seat: &mut OwnSeat, arguments: &BusArguments) -> Result<(), Trouble> {
    let until = seat.now() + listening(arguments, Duration::ZERO);
    while seat.now() < until {
        seat.turn(until)?;
    }
    Ok(())
}

pub(super) fn open<'a>(
    uri: &BusUri,
    at: &'a EncoderAddress,
    chatter: Chatter,
) -> Result<Encoder<'a>, Failure> {
    let (address, settings) = session(at)?;
    let (mut seat, stop, bit_rate) = seat(uri, &at.bus)?;
    let session = listen_longer(&mut seat, &at.bus)
        .and_then(|()| Slave::open(seat, address, &settings, &mut |_| {}));
    Ok(Encoder::new(Box::new(opened(session, &stop)?), at, bit_rate, chatter, stop))
}

pub(super) fn open_or_listen<'a>(
    uri: &BusUri,
    at: &'a EncoderAddress,
    chatter: Chatter,
) -> Result<Way<'a>, Failure> {
    let (address, settings) = session(at)?;
    let (mut seat, stop, bit_rate) = seat(uri, &at.bus)?;
    let listened = listen_longer(&mut seat, &at.bus);
    if let Err(trouble) = listened {
        return opened(Err(trouble), &stop);
    }
    // Whether a master exchanges data with it; any other trouble comes back when it is opened.
    let is_another_s = match Eavesdropper::open(&mut seat, address, &mut |_| {}) {
        Ok(_) => true,
        Err(trouble) if stop.is_wanted() => return opened(Err(trouble), &stop),
        Err(_) => false,
    };
    if !is_another_s {
        let session = opened(Slave::open(seat, address, &settings, &mut |_| {}), &stop)?;
        return Ok(Way::Serve(Encoder::new(Box::new(session), at, bit_rate, chatter, stop)));
    }
    let mut ears = opened(Eavesdropper::open(seat, address, &mut |_| {}), &stop)?;
    let heard = ears.heard();
    let master = heard.and_then(|heard| heard.exchange.as_ref()).map(|exchange| exchange.master);
    let master =
        master.map_or_else(|| "another master".to_owned(), |master| format!("master {master}"));
    let scale = ears.heard().map(scale).unwrap_or_default();
    let who = format!("address {address}, which belongs to {master} and is only listened to");
    if chatter > Chatter::Quiet {
        eprintln!("codewheel: {who}: nothing is sent");
    }
    let next = Box::new(move || ears.sample());
    Ok(Way::Listen(Listener { who, scale, stop, next }))
}

/// How its positions become turns, where its parameters were overheard.
fn scale(heard: &HeardSlave) -> Scale {
    let sent = heard.parameters.as_ref().filter(|sent| sent.confirmed);
    let user = sent.and_then(|sent| sent.octets.get(usize::from(FIRST_USER_OCTET) - 1..));
    let user = user.filter(|user| SCALING.read(user) == Some(1));
    Scale {
        steps_per_turn: user.and_then(|user| STEPS_PER_TURN.read(user)),
        total_resolution: user.and_then(|user| TOTAL_RESOLUTION.read(user)),
    }
}

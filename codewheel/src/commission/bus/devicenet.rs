//! Getting on a DeviceNet.

use codewheel_commission::devicenet::{
    Console, Eavesdropper, Encoder as Device, LISTEN_TIME, OWN_MAC, OpenSettings, ScanSettings,
    listen, scan as scan_bus,
};
use codewheel_commission::{CanSeat, Owner, Seat, Survey};
use codewheel_device::product::Bus;
use codewheel_devicenet::MacId;
use codewheel_link::{BusUri, Clock, Loop};

use super::{Listener, Way, address, encoder_address, listening, opened, stop};
use crate::arguments::Chatter;
use crate::arguments::commission::{BusArguments, EncoderAddress};
use crate::commission::encoder::Encoder;
use crate::commission::progress::Bar;
use crate::commission::stoppable::{Stop, Stoppable};
use crate::commission::watch::Scale;
use crate::failure::Failure;
use crate::rates;

const HIGHEST: u8 = 63;

type OwnSeat = Stoppable<CanSeat<Console>>;

/// Ears on the bus, what ends them, and the rate in bit/s.
fn seat(uri: &BusUri, arguments: &BusArguments) -> Result<(OwnSeat, Stop, u32), Failure> {
    let rate = rates::devicenet(arguments.baud.as_deref())?;
    let port = codewheel_link::open(uri, rate)?;
    let stop = stop(port.waker(), arguments)?;
    let seat = CanSeat::new(Console::new(), port, Loop::new(Clock::new()));
    Ok((Stoppable::new(seat, stop.clone()), stop, rate.bits_per_second()))
}

fn own_mac(arguments: &BusArguments) -> Result<MacId, Failure> {
    let Some(given) = arguments.master else { return Ok(OWN_MAC) };
    Ok(MacId::from_low_bits(address("--master", given, HIGHEST, Bus::DeviceNet)?.into()))
}

fn mac(at: &EncoderAddress) -> Result<MacId, Failure> {
    let address = encoder_address(at, HIGHEST, Bus::DeviceNet)?;
    if !at.parameters.is_empty() {
        return Err(Failure::Usage(
            "--parameter is for PROFIBUS, whose masters parameterise their slaves; on DeviceNet write \
             with `codewheel set`"
                .to_owned(),
        ));
    }
    Ok(MacId::from_low_bits(address.into()))
}

pub(super) fn scan(
    uri: &BusUri,
    arguments: &BusArguments,
    chatter: Chatter,
) -> Result<Survey, Failure> {
    let mac = own_mac(arguments)?;
    let (mut seat, stop, _) = seat(uri, arguments)?;
    let listen = listening(arguments, LISTEN_TIME);
    let settings = ScanSettings { mac, listen, ..ScanSettings::default() };
    let bar = Bar::new(chatter);
    let survey = scan_bus(&mut seat, settings, &mut |progress| bar.show(progress));
    opened(survey, &stop)
}

fn settings(at: &EncoderAddress) -> Result<OpenSettings, Failure> {
    Ok(OpenSettings { mac: own_mac(&at.bus)?, listen: listening(&at.bus, LISTEN_TIME) })
}

pub(super) fn open<'a>(
    uri: &BusUri,
    at: &'a EncoderAddress,
    chatter: Chatter,
) -> Result<Encoder<'a>, Failure> {
    let (mac, settings) = (mac(at)?, settings(at)?);
    let (seat, stop, bit_rate) = seat(uri, &at.bus)?;
    let session = opened(Device::open(seat, mac, settings), &stop)?;
    Ok(Encoder::new(Box::new(session), at, bit_rate, chatter, stop))
}

pub(super) fn open_or_listen<'a>(
    uri: &BusUri,
    at: &'a EncoderAddress,
    chatter: Chatter,
) -> Result<Way<'a>, Failure> {
    let (mac, settings) = (mac(at)?, settings(at)?);
    let (mut seat, stop, bit_rate) = seat(uri, &at.bus)?;
    let heard = listen(&mut seat, settings.listen.max(LISTEN_TIME), &mut |_| {});
    opened(heard, &stop)?;
    let now = seat.now();
    let Some(owner) = seat.station().owner(now, mac) else {
        let session = opened(Device::open(seat, mac, settings), &stop)?;
        return Ok(Way::Serve(Encoder::new(Box::new(session), at, bit_rate, chatter, stop)));
    };
    let master = match owner {
        Owner::Master(address) => format!("master {address}"),
        _ => "another master".to_owned(),
    };
    let who = format!("MAC ID {mac}, which belongs to {master} and is only listened to");
    if chatter > Chatter::Quiet {
        eprintln!("codewheel: {who}: nothing is sent");
    }
    let mut ears = Eavesdropper::new(seat, mac);
    let next = Box::new(move || ears.sample());
    Ok(Way::Listen(Listener { who, scale: Scale::default(), stop, next }))
}

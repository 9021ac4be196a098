//! `codewheel encoder`: one encoder on a bus.

use std::io::Write;
use std::sync::atomic::Ordering;

use codewheel_device::Switches;
use codewheel_link::{BusUri, Clock};
use codewheel_plant::{BusPlan, DevicePlan, PortBus, Report};
use codewheel_sim::can::Faults;
use codewheel_sim::shaft::Shaft;

use crate::arguments::{Chatter, EncoderArguments};
use crate::failure::Failure;
use crate::signals::stop_flag;
use crate::tell;

pub(crate) fn run(arguments: EncoderArguments, chatter: Chatter) -> Result<(), Failure> {
    let EncoderArguments { model: product, bus, address, baud, shaft, memory, serial } = arguments;
    let geometry = product.encoder.geometry;
    let shaft = Shaft::parse(&shaft, geometry.singleturn_resolution(), geometry.revolutions())?;
    let is_virtual = matches!(bus, BusUri::Virtual(_));
    let device = DevicePlan {
        memory,
        serial,
        ..DevicePlan::new(product, Switches::set_to(address, baud), shaft)
    };
    let plan = BusPlan {
        name: bus.to_string(),
        uri: bus,
        bit_rate: baud,
        faults: Faults::default(),
        seed: 0,
        devices: vec![device],
        masters: Vec::new(),
    };
    let mut bus = PortBus::power_up(plan, Clock::new())?;
    let waker = bus.waker();
    let stop = stop_flag(move || waker.wake())?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "ready {} address {address} on {}", product.model, bus.uri())?;
    out.flush()?;
    if is_virtual && chatter > Chatter::Quiet {
        eprintln!(
            "codewheel: nobody else can join a virtual bus of this process, so nothing \
             acknowledges the encoder and it stays off-line; slcan-listen:HOST:PORT lets others join"
        );
    }
    let mut result = Ok(());
    while !stop.load(Ordering::Relaxed) && result.is_ok() {
        result = bus.turn(None);
        tell(&mut bus, chatter);
    }
    bus.finish();
    tell(&mut bus, chatter);
    Ok(result?)
}

fn tell(bus: &mut PortBus, chatter: Chatter) {
    for report in bus.take_reports().iter().filter(|report| tell::is_for(report, chatter)) {
        let Report { at, what } = report;
        eprintln!("codewheel: {at} {what}");
    }
}

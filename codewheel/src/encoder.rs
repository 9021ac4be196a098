//! `codewheel encoder`: one encoder on a bus.

use std::io::Write;
use std::sync::atomic::Ordering;

use codewheel_device::product::Bus;
use codewheel_device::{Switches, profibus};
use codewheel_link::{BusUri, Clock, Medium};
use codewheel_plant::{
    BusPlan, DeviceNet, DeviceOptions, DevicePlan, Fault, FieldBus, PortBus, Profibus, Recording,
    Report, SensorPlan,
};
use codewheel_sim::shaft::Shaft;

use crate::arguments::{Chatter, EncoderArguments};
use crate::failure::Failure;
use crate::rates;
use crate::record;
use crate::signals::stop_flag;
use crate::tell;

pub(crate) fn run(arguments: &EncoderArguments, chatter: Chatter) -> Result<(), Failure> {
    match arguments.model.bus {
        Bus::DeviceNet => devicenet(arguments, chatter),
        Bus::Profibus => profibus(arguments, chatter),
    }
}

fn devicenet(arguments: &EncoderArguments, chatter: Chatter) -> Result<(), Failure> {
    joins(arguments, Medium::Can)?;
    let address = address(arguments, 63, "DeviceNet has 0–63")?;
    let rate = rates::devicenet(arguments.baud.as_deref())?;
    let device = device(arguments, Switches::set_to(address, rate))?;
    let plan = BusPlan::<DeviceNet>::new(name(&arguments.bus), arguments.bus.clone(), rate);
    play(arguments, plan, device, chatter)
}

fn profibus(arguments: &EncoderArguments, chatter: Chatter) -> Result<(), Failure> {
    joins(arguments, Medium::Rs485)?;
    let address = address(arguments, 99, "the switches of a PROFIBUS encoder have 0–99")?;
    let rate = rates::profibus(arguments.baud.as_deref())?;
    let device = device(arguments, profibus::Switches::set_to(address))?;
    // A serial port runs at some rate, which nobody need know.
    let auto_baud = arguments.baud.is_none() && matches!(arguments.bus, BusUri::Rs485Device(_));
    let device = DevicePlan { options: DeviceOptions { auto_baud }, ..device };
    let plan = BusPlan::<Profibus>::new("pb0", arguments.bus.clone(), rate);
    play(arguments, plan, device, chatter)
}

/// What a recording calls a CAN bus: its interface where it has one, otherwise as most do.
fn name(bus: &BusUri) -> &str {
    match bus {
        BusUri::SocketCan(interface) => interface,
        _ => "can0",
    }
}

/// Whether the bus carries what the model speaks.
fn joins(arguments: &EncoderArguments, medium: Medium) -> Result<(), Failure> {
    let EncoderArguments { model, bus, .. } = arguments;
    match bus.medium() {
        Medium::Any if medium == Medium::Can => return Ok(()),
        Medium::Any => {
            return Err(Failure::Usage(format!(
                "nobody else can join a virtual PROFIBUS of this process: write {}, or a plant \
                 file for `codewheel run`",
                medium.forms()
            )));
        }
        given if given == medium => return Ok(()),
        _ => {}
    }
    Err(Failure::Usage(format!(
        "{} speaks {}, which runs on {medium}, and {bus} carries {}: write {}",
        model.model,
        model.bus,
        bus.medium(),
        medium.forms()
    )))
}

fn address(arguments: &EncoderArguments, highest: u8, range: &str) -> Result<u8, Failure> {
    let text = &arguments.address;
    let address = text.parse().ok().filter(|address| *address <= highest);
    address.ok_or_else(|| {
        Failure::Usage(format!("invalid value '{text}' for '--address <N>': {range}"))
    })
}

fn device<B: FieldBus>(
    arguments: &EncoderArguments,
    switches: B::Switches,
) -> Result<DevicePlan<B>, Failure> {
    let product = arguments.model;
    let sensor = SensorPlan::parse(product, &arguments.ssi.keys()).map_err(Failure::Usage)?;
    let geometry = sensor.geometry().unwrap_or(product.encoder.geometry);
    let (steps, turns) = (geometry.singleturn_resolution(), geometry.revolutions());
    let shaft = Shaft::parse(&arguments.shaft, steps, turns)?;
    let fault = |words: &String| {
        Fault::parse(words, product, &sensor)
            .map_err(|why| Failure::Usage(format!("--fault '{words}': {why}")))
    };
    Ok(DevicePlan {
        faults: arguments.faults.iter().map(fault).collect::<Result<_, _>>()?,
        sensor: sensor.clone(),
        memory: arguments.memory.clone(),
        serial: arguments.serial,
        ..DevicePlan::new(product, switches, shaft)
    })
}

fn play<B: FieldBus>(
    arguments: &EncoderArguments,
    mut plan: BusPlan<B>,
    device: DevicePlan<B>,
    chatter: Chatter,
) -> Result<(), Failure> {
    let is_virtual = plan.is_virtual();
    plan.devices.push(device);
    let captured = vec![plan.captured()];
    if let Some(path) = &arguments.record {
        Recording::check(path, &captured)?;
    }
    let mut bus = PortBus::power_up(plan, Clock::new())?;
    // An older file is replaced when nothing else is in the way.
    let recording =
        arguments.record.as_deref().map(|path| Recording::create(path, captured)).transpose()?;
    if let Some(recording) = &recording {
        bus.record(recording, 0);
    }
    let waker = bus.waker();
    let stop = stop_flag(move || waker.wake())?;
    let mut out = std::io::stdout().lock();
    let EncoderArguments { model, address, .. } = arguments;
    writeln!(out, "ready {} address {address} on {}", model.model, bus.uri())?;
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
    let recorded = recording.map_or(Ok(()), |recording| record::end(recording, chatter));
    result?;
    recorded
}

fn tell<B: FieldBus>(bus: &mut PortBus<B>, chatter: Chatter) {
    for report in bus.take_reports().iter().filter(|report| tell::is_for(report, chatter)) {
        let Report { at, what } = report;
        eprintln!("codewheel: {at} {what}");
    }
}

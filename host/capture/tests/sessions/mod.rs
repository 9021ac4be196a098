//! Our own devices and masters on both buses in virtual time, for whoever wants traffic.

use std::convert::Infallible;

use codewheel_capture::Condition;
use codewheel_commission::profibus::{Master, MasterSettings, SlaveSettings as DpSlave};
use codewheel_device::profibus::{self, IDENT_NUMBER, parameters};
use codewheel_device::{DeviceNetEncoder, Factory, Product, ProfibusEncoder, Switches};
use codewheel_devicenet::MacId;
use codewheel_devicenet::explicit::Service;
use codewheel_devicenet::scanner::{Scanner, ScannerIdentity, SlaveSettings};
use codewheel_encoder::{Sample, Sensor, choose};
use codewheel_profibus::{Baud, Timing};
use codewheel_sim::shaft::{Faulty, Shaft};
use codewheel_sim::{Either, can, rs485};
use codewheel_station::can::{BitRate, Frame};
use codewheel_station::rs485::BaudRate;
use codewheel_station::{Duration, Instant};

/// The rate of the DeviceNet session.
pub(crate) const BIT_RATE: BitRate = BitRate::Kbit500;
/// The rate of the PROFIBUS session.
pub(crate) const BAUD_RATE: BaudRate = BaudRate::Mbit1_5;

/// A converter's sensor that stands.
#[derive(Clone, Debug)]
struct Standing;

impl Sensor for Standing {
    fn sample(&mut self, _: Instant) -> Sample {
        Sample { code: 5_000, ..Sample::default() }
    }
    fn changes_at(&self, _: Instant) -> Option<Instant> {
        None
    }
}

fn product(model: &str) -> &'static Product {
    Product::find(model).expect("a model of the catalogue")
}

fn shaft(product: &Product, text: &str) -> Shaft {
    let geometry = product.encoder.geometry;
    Shaft::parse(text, geometry.singleturn_resolution(), geometry.revolutions()).expect("a shaft")
}

fn mac(address: u8) -> MacId {
    MacId::new(address).expect("0 to 63")
}

type CanNode = Either<Scanner, DeviceNetEncoder<Shaft>>;

/// A scanner at 10 polls an encoder at 5 and lets one at 6 produce its changes; then it asks 5 all kinds of
/// things. `see` gets each frame with its end.
pub(crate) fn devicenet(see: &mut impl FnMut(Instant, &Frame)) {
    let mut wire = can::Wire::<CanNode>::new(BIT_RATE, 1);
    let mut scanner =
        Scanner::new(mac(10), ScannerIdentity { vendor: 1, serial: 77 }, Duration::from_millis(20));
    scanner.add(SlaveSettings::poll(mac(5))).expect("room");
    scanner.add(SlaveSettings::change_of_state(mac(6))).expect("room");
    let filters = scanner.filters();
    let scanner = wire.attach("scanner", Either::Left(scanner), &filters, true);
    let mut encoder = |address, model, text| {
        let product = product(model);
        let encoder = DeviceNetEncoder::power_up(
            Instant::ZERO,
            product,
            Factory::with_serial(u32::from(address) * 1_000),
            Switches::set_to(address, BIT_RATE),
            &choose(&[], &[]),
            shaft(product, text),
        );
        let filter = [encoder.filter()];
        wire.attach(model, Either::Right(encoder), &filter, address == 6)
    };
    let asked = encoder(5, "amg11-d29", "turn rpm=60 angle=4096");
    encoder(6, "amg81-d13", "turn rpm=2");
    let mut observer = |event: &can::Event| {
        if let can::Event::Frame { at, frame, .. } = event {
            see(*at, frame);
        }
    };
    wire.run_until(Instant::ZERO + Duration::from_secs(5), &mut observer);
    let get = |class, instance, attribute| {
        vec![Service::GET_ATTRIBUTE_SINGLE.0, class, instance, attribute]
    };
    let set = |class: u8, instance: u8, attribute: u8, data: &[u8]| {
        [&[Service::SET_ATTRIBUTE_SINGLE.0, class, instance, attribute], data].concat()
    };
    let requests = [
        get(0x01, 1, 1),
        get(0x01, 1, 7),
        vec![Service::GET_ATTRIBUTES_ALL.0, 0x01, 1],
        get(0x03, 1, 5),
        get(0x05, 2, 1),
        get(0x05, 2, 14),
        get(0x2F, 1, 12),
        set(0x2F, 1, 3, &[1]),
        get(0x2F, 1, 3),
        set(0x2F, 1, 7, &3_600_u32.to_le_bytes()),
        get(0x2F, 1, 8),
        set(0x2F, 1, 12, &[0; 4]),
        set(0x2F, 1, 10, &u32::MAX.to_le_bytes()),
        set(0x0F, 8, 1, &1_000_u32.to_le_bytes()),
        get(0x0F, 5, 7),
        vec![Service::GET_ATTRIBUTES_ALL.0, 0x0F, 5],
        get(0x04, 2, 3),
        vec![Service::SAVE.0, 0x2F, 1],
        get(0x77, 1, 1),
        set(0x01, 1, 10, &[1]),
    ];
    for request in requests {
        let station = wire.node_mut(scanner).and_then(Either::left_mut).expect("the scanner");
        let ticket = station.request(mac(5), &request, Duration::from_secs(5)).expect("taken");
        let answered = (0..100).any(|_| {
            wire.run_until(wire.now() + Duration::from_millis(5), &mut observer);
            keep(&mut wire, asked);
            let station = wire.node_mut(scanner).and_then(Either::left_mut).expect("the scanner");
            station.response(ticket, |_| ()).is_some()
        });
        assert!(answered, "no answer to {request:02X?}");
    }
    wire.run_until(wire.now() + Duration::from_secs(2), &mut observer);
}

/// The memory of the encoder, which forgets everything at once.
fn keep(wire: &mut can::Wire<CanNode>, encoder: can::NodeId) {
    let now = wire.now();
    if let Some(Either::Right(encoder)) = wire.node_mut(encoder)
        && encoder.keep(now).is_some()
    {
        encoder.kept(now, Ok::<(), Infallible>(()));
    }
}

type Slave = Either<ProfibusEncoder<Faulty<Shaft>>, ProfibusEncoder<Standing>>;

/// A master at 2 serves an encoder at 7, which it gives a good preset and a bad one and whose sensor
/// jumps, and a converter at 9, which it sends parameters that are refused. For a while one telegram in
/// ten is disturbed. `see` gets each telegram with its end.
pub(crate) fn profibus(see: &mut impl FnMut(Instant, &[u8], Condition)) {
    let mut wire = rs485::Wire::<Either<Slave, Master>>::new(1);
    let attachment = rs485::Attachment::default();
    let encoder = product("amg11-p29");
    let sensor = Faulty::new(shaft(encoder, "turn rpm=60"), encoder.encoder.geometry.range());
    let slave = power_up(encoder, 7, sensor);
    let slave = wire.attach("encoder", Either::Left(Either::Left(slave)), attachment);
    let converter = product("heag162-p18");
    let other = power_up(converter, 9, Standing);
    wire.attach("converter", Either::Left(Either::Right(other)), attachment);
    let settings = |address, product: &Product, steps: u32| {
        let mut user = parameters::default_octets(product.encoder).to_vec();
        parameters::STEPS_PER_TURN.write(steps, &mut user);
        DpSlave {
            address,
            ident_number: IDENT_NUMBER,
            user_parameters: user,
            configuration: vec![0xF1],
            inputs: 4,
            outputs: 4,
            groups: 1,
            sync: true,
            freeze: true,
        }
    };
    let slaves = vec![settings(7, encoder, 8_192), settings(9, converter, 0)];
    let mut told = MasterSettings::new(2, BAUD_RATE);
    told.highest_station_address = 12;
    let master = Master::new(told, slaves).expect("good settings");
    let master = wire.attach("master", Either::Right(master), attachment);
    let mut observer = |event: &rs485::Event| {
        if let rs485::Event::Telegram { octets, end, intact, .. } = event {
            let condition = if *intact { Condition::Intact } else { Condition::Broken };
            see(*end, octets.octets(), condition);
        }
    };
    let mut run = |wire: &mut rs485::Wire<Either<Slave, Master>>, millis| {
        wire.run_until(wire.now() + Duration::from_millis(millis), &mut observer);
    };
    run(&mut wire, 300);
    for outputs in [0x8000_002A_u32, 0, 0xFFFF_FFFF, 0, 0x8000_0000, 0] {
        let station = wire.node_mut(master).and_then(Either::right_mut).expect("the master");
        station.set_outputs(7, &outputs.to_be_bytes()).expect("it exchanges data");
        run(&mut wire, 20);
    }
    if let Some(Either::Left(Either::Left(encoder))) = wire.node_mut(slave) {
        encoder.sensor_mut().jump(4_000);
    }
    run(&mut wire, 100);
    wire.set_corruption_at(slave, Some(0.1));
    run(&mut wire, 50);
    wire.set_corruption_at(slave, None);
    run(&mut wire, 100);
}

fn power_up<S: Sensor>(product: &'static Product, address: u8, sensor: S) -> ProfibusEncoder<S> {
    let factory = profibus::Factory {
        model: product.encoder,
        serial: 1,
        baud: Baud::Fixed(BAUD_RATE),
        timing: Timing::Exact,
    };
    let switches = profibus::Switches::set_to(address);
    ProfibusEncoder::power_up(Instant::ZERO, product, factory, switches, &choose(&[], &[]), sensor)
}

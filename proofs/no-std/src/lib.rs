//! The proof that the core crates need neither an allocator nor an operating system: they are
//! linked into one archive with nothing else, and `check.sh` looks at its symbols.
//!
//! Only what [`exercise`] reaches is linked, so what a firmware calls belongs there.
#![no_std]

use codewheel_device::{
    DeviceNetEncoder, Event, Factory, ProfibusEncoder, Snapshot, Switches, product, profibus,
};
use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::{Response, Scanner, ScannerIdentity, SlaveSettings};
use codewheel_encoder::ssi;
use codewheel_encoder::{RECORD_OCTETS, Sample, Sensor, choose, encode};
use codewheel_profibus::{Baud, Timing};
use codewheel_station::can::{BitRate, Frame, Input};
use codewheel_station::rs485;
use codewheel_station::{Duration, Instant, Reader, Station};

/// Calls into the core crates the way a firmware does. `input` is what the compiler cannot know, so
/// nothing is computed at compile time; the sum returned keeps everything alive.
///
/// The stations on CAN get the same input, a row of frames: two octets of identifier, a length, the
/// data. The slave on RS-485 gets the octets as they are, in pieces of any length.
fn exercise(input: &[u8]) -> u32 {
    let mut sum = Sum(0);
    encoder(input, &mut sum);
    scanner(input, &mut sum);
    profibus(input, &mut sum);
    sum.0
}

/// An encoder from power-up to bus-off, with the memory it keeps its settings in, which holds the
/// first octets of the input.
fn encoder(input: &[u8], sum: &mut Sum) {
    let mut slots = [[0; RECORD_OCTETS]; 2];
    for (to, from) in slots.as_flattened_mut().iter_mut().zip(input) {
        *to = *from;
    }
    let [a, b] = &slots;
    let start = choose(a, b);
    let (_, mut sequence) = start.next();
    let mut reader = Reader::new(input);
    let address = reader.u8().unwrap_or_default();
    let code = reader.u32_le().unwrap_or_default();
    let products = &product::DEVICENET;
    let Some(product) = products.get(usize::from(address) % products.len()) else { return };
    let switches = Switches::set_to(address, BitRate::Kbit500);
    let factory = Factory::with_serial(code);
    let sensor = Still { code };
    let mut device =
        DeviceNetEncoder::power_up(Instant::ZERO, product, factory, switches, &start, sensor);
    let now = run(&mut device, Instant::ZERO, input, sum, |device, now| {
        if let Some(kept) = device.keep(now) {
            let [a, _] = &mut slots;
            *a = encode(&kept, sequence);
            sequence = sequence.wrapping_add(1);
            device.kept(now, Ok::<(), ()>(()));
        }
    });
    device.handle(now, Input::BusOff);
    while let Some((at, event)) = device.take_event() {
        sum.add(&at.as_nanos().to_le_bytes());
        sum.add(&[u8::from(event == Event::Saved)]);
    }
    let Snapshot { position, velocity, colour, .. } = device.snapshot(now);
    sum.add(&position.to_le_bytes());
    sum.add(&velocity.to_le_bytes());
    sum.add(&[colour as u8]);
    sum.add(slots.as_flattened());
}

/// A scanner with two slaves and one request to each.
fn scanner(input: &[u8], sum: &mut Sum) {
    let identity = ScannerIdentity { vendor: 1, serial: 1 };
    let slaves = [5, 6].map(MacId::from_low_bits);
    let mut scanner: Scanner<2> = Scanner::new(MacId::from_low_bits(0), identity, Duration::ZERO);
    for mac in slaves {
        sum.add(&[u8::from(scanner.add(SlaveSettings::poll(mac)).is_ok())]);
    }
    let mut now = run(&mut scanner, Instant::ZERO, input, sum, |_, _| {});
    for mac in slaves {
        if let Ok(ticket) = scanner.request(mac, &[0x0E, 0x2F, 1, 12], Duration::from_secs(1)) {
            now = run(&mut scanner, now, input, sum, |_, _| {});
            scanner.response(ticket, |response| match response {
                Response::Done(data) => sum.add(data),
                Response::Refused(error) => sum.add(&[error.general.0, error.additional]),
                Response::TooLong | Response::NoAnswer => {}
            });
        }
        if let Some(slave) = scanner.slave(mac) {
            sum.add(slave.input);
        }
    }
}

/// A converter or encoder on PROFIBUS that searches its rate, with an SSI line as its sensor.
fn profibus(input: &[u8], sum: &mut Sum) {
    let mut slots = [[0; RECORD_OCTETS]; 2];
    for (to, from) in slots.as_flattened_mut().iter_mut().zip(input) {
        *to = *from;
    }
    let [a, b] = &slots;
    let start = choose(a, b);
    let (_, mut sequence) = start.next();
    let mut reader = Reader::new(input);
    let address = reader.u8().unwrap_or_default();
    let sampled = reader.u32_le().unwrap_or_default();
    let products = &product::PROFIBUS;
    let Some(product) = products.get(usize::from(address) % products.len()) else { return };
    let Some(word) = ssi::Word::choices(product.encoder.geometry).first() else { return };
    let settings = ssi::Settings::of_word(*word);
    let Ok(sensor) = ssi::Input::new(Wire { sampled }, settings) else { return };
    let factory = profibus::Factory {
        model: product.encoder,
        serial: sampled,
        baud: Baud::Search,
        timing: Timing::Exact,
    };
    let switches = profibus::Switches::set_to(address);
    let mut now = Instant::ZERO;
    let mut device = ProfibusEncoder::power_up(now, product, factory, switches, &start, sensor);
    for _ in 0..TURNS {
        now = device.deadline().unwrap_or(now + Duration::from_millis(1)).max(now);
        device.advance(now);
        let length = usize::from(reader.u8().unwrap_or_default());
        if let Ok(octets) = reader.octets(length) {
            device.handle(now, rs485::Input::Octets(octets));
        }
        if let Some(kept) = device.keep(now) {
            let [a, _] = &mut slots;
            *a = encode(&kept, sequence);
            sequence = sequence.wrapping_add(1);
            device.kept(now, Ok::<(), ()>(()));
        }
        if let Some(answer) = device.transmit(now) {
            sum.add(answer.octets());
        }
        while let Some((at, event)) = device.take_event() {
            sum.add(&at.as_nanos().to_le_bytes());
            sum.add(&[u8::from(event == Event::Saved)]);
        }
    }
    device.handle(now, rs485::Input::BrokenCharacter);
    let Snapshot { position, colour, .. } = device.snapshot(now);
    sum.add(&position.to_le_bytes());
    sum.add(&[colour as u8]);
    sum.add(slots.as_flattened());
}

/// Drives `station` through its duplicate MAC ID check and past each frame of `input`, from
/// `start` on; `serve` comes in each turn. Gives the time of the end.
fn run<S>(
    station: &mut S,
    start: Instant,
    input: &[u8],
    sum: &mut Sum,
    mut serve: impl FnMut(&mut S, Instant),
) -> Instant
where
    S: for<'a> Station<Input<'a> = Input<'a>, Output = Frame>,
{
    let mut reader = Reader::new(input);
    let mut now = start;
    for _ in 0..TURNS {
        now = station.deadline().unwrap_or(now + Duration::from_millis(1)).max(now);
        station.advance(now);
        if let Some(frame) = frame(&mut reader) {
            station.handle(now, Input::Frame(&frame));
        }
        serve(station, now);
        while let Some(frame) = station.transmit(now) {
            sum.add(frame.data());
            station.handle(now, Input::Sent(&frame));
        }
    }
    now
}

/// How often [`run`] turns: enough for the two silent seconds of the check and what follows.
const TURNS: u32 = 1_000;

fn frame(reader: &mut Reader<'_>) -> Option<Frame> {
    let identifier = reader.u16_le().ok()?;
    let length = reader.u8().ok()?;
    let data = reader.octets(usize::from(length)).ok()?;
    Some(Frame::standard(identifier, data))
}

/// A shaft that rests.
struct Still {
    code: u32,
}

impl Sensor for Still {
    fn sample(&mut self, _: Instant) -> Sample {
        Sample { code: self.code, ..Sample::default() }
    }

    fn changes_at(&self, _: Instant) -> Option<Instant> {
        None
    }
}

/// An SSI line that always shows the same.
struct Wire {
    sampled: u32,
}

impl ssi::Line for Wire {
    fn transfer(&mut self, _: Instant, clocks: u8, _: u32) -> Option<u64> {
        (clocks > 0).then_some(u64::from(self.sampled))
    }
}

/// What is seen, folded into one number.
struct Sum(u32);

impl Sum {
    fn add(&mut self, octets: &[u8]) {
        for octet in octets {
            self.0 = self.0.rotate_left(5).wrapping_add(u32::from(*octet));
        }
    }
}

/// What `check.sh` looks for: the way into [`exercise`] from outside Rust.
///
/// # Safety
/// `octets` points at `length` readable octets.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn codewheel_exercise(octets: *const u8, length: usize) -> u32 {
    // SAFETY: the caller promises it.
    exercise(unsafe { core::slice::from_raw_parts(octets, length) })
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

//! Any explicit request whatever, one after the other on one device: one answer each, a refusal changes
//! nothing, and what was set reads back.
//!
//! ```sh
//! CODEWHEEL_REQUESTS=2000000 cargo test --release -p codewheel-device --test anything requests
//! ```

use codewheel_device::devicenet::rows::Row;
use codewheel_device::product::DEVICENET;
use codewheel_device::{DeviceNetEncoder, Factory, Switches};
use codewheel_devicenet::NetworkSettings;
use codewheel_encoder::{Block, Sample, Sensor, Start};
use codewheel_station::can::{BitRate, Frame, Identifier, Input};
use codewheel_station::{Duration, Instant, Station};
use fastrand::Rng;

const SET: u8 = 0x10;
const GET: u8 = 0x0E;

struct Turning(u32);

impl Sensor for Turning {
    fn sample(&mut self, _: Instant) -> Sample {
        self.0 += 1;
        Sample { code: self.0 & 0x1FFF, ..Sample::default() }
    }
    fn changes_at(&self, _: Instant) -> Option<Instant> {
        None
    }
}

struct Bench {
    device: DeviceNetEncoder<Turning>,
    now: Instant,
}

impl Bench {
    fn new(index: usize) -> Self {
        let device = DeviceNetEncoder::power_up(
            Instant::ZERO,
            &DEVICENET[index % DEVICENET.len()],
            Factory::with_serial(1),
            Switches::set_to(5, BitRate::Kbit500),
            &Start::Fresh { interrupted: false },
            Turning(0),
        );
        Self { device, now: Instant::ZERO }
    }

    fn drain(&mut self) -> Vec<Frame> {
        let mut frames = Vec::new();
        loop {
            while self.device.keep(self.now).is_some() {
                self.device.kept(self.now, Ok::<(), ()>(()));
            }
            let Some(frame) = self.device.transmit(self.now) else { return frames };
            self.device.handle(self.now, Input::Sent(&frame));
            frames.push(frame);
            assert!(frames.len() < 10, "no end: {frames:?}");
        }
    }

    /// What the device says to the master; not its productions, heartbeats and address checks.
    fn hear(&mut self, message: u16, data: &[u8]) -> Vec<Frame> {
        let frame = Frame::standard(0x428 | message, data);
        self.device.handle(self.now, Input::Frame(&frame));
        let mut frames = self.drain();
        frames.retain(|frame| frame.identifier() == Identifier::Standard(0x42B));
        frames.retain(|frame| !matches!(frame.data(), [5, 0xCD, ..]));
        frames
    }

    fn wait(&mut self, span: Duration) {
        let end = self.now + span;
        while let Some(deadline) = self.device.deadline().filter(|deadline| *deadline <= end) {
            self.now = self.now.max(deadline);
            self.device.advance(self.now);
            self.drain();
        }
        self.now = end;
    }

    /// On-line, with all connections allocated by master 10, whatever happened before.
    fn allocate(&mut self) {
        if self.device.server().connection_state(1).is_some() {
            return;
        }
        self.drain();
        self.wait(Duration::from_secs(2));
        // An I/O connection may have outlived the explicit one.
        for choice in [0x02, 0x10] {
            self.hear(6, &[0x0A, 0x4C, 3, 1, choice]);
        }
        let answer = self.hear(6, &[0x0A, 0x4B, 3, 1, 0x13, 0x0A]);
        assert_eq!(answer, [Frame::standard(0x42B, &[0x0A, 0xCB, 0])]);
    }

    /// The body of the answer, or `None` for silence.
    fn ask(&mut self, body: &[u8]) -> Option<Vec<u8>> {
        let mut heard = Vec::new();
        if body.len() <= 7 {
            heard = self.hear(4, &[&[0x0A], body].concat());
        } else {
            let last = body.len().div_ceil(6) - 1;
            for (index, piece) in body.chunks(6).enumerate() {
                let kind = match index {
                    0 => 0,
                    _ if index == last => 0x80,
                    _ => 0x40,
                };
                heard = self.hear(4, &[&[0x8A, kind | index as u8], piece].concat());
                assert!(!heard.is_empty(), "fragment {index} was not acknowledged");
                heard.remove(0);
            }
        }
        let mut answer = Vec::new();
        while let Some(frame) = heard.first().copied() {
            assert_eq!((heard.len(), frame.identifier()), (1, Identifier::Standard(0x42B)));
            match *frame.data() {
                [0x0A, ref whole @ ..] => return Some(whole.to_vec()),
                [0x8A, fragment, ref piece @ ..] => {
                    answer.extend_from_slice(piece);
                    heard = self.hear(4, &[0x8A, 0xC0 | fragment & 0x3F, 0]);
                    if fragment >> 6 == 2 {
                        assert!(heard.is_empty(), "{heard:?} behind the last fragment");
                        return Some(answer);
                    }
                }
                ref other => panic!("not an explicit message: {other:02X?}"),
            }
        }
        None
    }

    fn state(&self) -> (Block, Block, NetworkSettings) {
        let snapshot = self.device.snapshot(self.now);
        (snapshot.in_force, snapshot.saved, self.device.server().settings())
    }

    fn judge(&mut self, request: &[u8]) {
        self.allocate();
        let before = self.state();
        let answer = self.ask(request);
        let service = request[0];
        match answer.as_deref() {
            None => assert!(service >= 0x80, "no answer"),
            Some([0x94, general, _]) => {
                assert!((0x02..=0x20).contains(general), "general status {general:02X}");
                assert_eq!(self.state(), before, "refused, and yet something changed");
            }
            Some([0x94, ..]) => panic!("an error has three octets: {answer:02X?}"),
            Some([response, data @ ..]) => {
                assert_eq!(*response, service | 0x80, "{answer:02X?}");
                self.judge_success(request, data);
            }
            Some([]) => panic!("an empty answer"),
        }
        let model = self.device.product().encoder;
        let (in_force, saved, _) = self.state();
        assert_eq!((in_force.check(model), saved.check(model)), (Ok(()), Ok(())));
        assert!(self.device.encoder().position() < in_force.settings.total_in_force(model));
    }

    /// What was set reads back, but for the octets of counters, which any Set clears.
    fn judge_success(&mut self, request: &[u8], data: &[u8]) {
        let [SET, class, instance, attribute, value @ ..] = request else { return };
        if !matches!(class, 0x0F | 0x2B | 0x2F) {
            return;
        }
        assert!(data.is_empty() || *class == 0x2B, "a Set returns no data: {data:02X?}");
        let read = self.ask(&[GET, *class, *instance, *attribute]);
        let expected = [&[GET | 0x80], value].concat();
        assert_eq!(read, Some(expected), "it reads back otherwise");
    }
}

/// Requests of which many get somewhere.
fn request(random: &mut Rng) -> Vec<u8> {
    let any = |random: &mut Rng, usual: &[u8]| match random.u8(..16) {
        0 => random.u8(..),
        _ => usual[random.usize(..usual.len())],
    };
    let service = any(random, &[GET, GET, SET, SET, SET, 1, 5, 0x0D, 0x15, 0x16, 0x4B, 0x4C]);
    let class = any(random, &[1, 2, 3, 4, 5, 0x0F, 0x0F, 0x2B, 0x2F, 0x2F, 0x2F, 0x64]);
    let instance = match class {
        0x0F => random.u8(..22),
        _ => any(random, &[0, 1, 1, 1, 2, 4]),
    };
    let attribute = match class {
        0x0F => any(random, &[1, 1, 1, 1, 2, 3, 5, 7, 10, 11]),
        0x2F if service == SET => any(random, &[3, 5, 7, 8, 10, 11, 11]),
        0x2F => [random.u8(1..13), random.u8(80..96)][random.usize(..2)],
        _ => random.u8(..20),
    };
    let mut request = vec![service, class, instance];
    if matches!(service, GET | SET) || random.u8(..8) == 0 {
        request.push(attribute);
    }
    if service == SET {
        let usual = match (class, attribute) {
            (0x2F, attribute) => Row::find(attribute).map_or(0, |row| row.data_type.octets()),
            (0x0F, _) => [1, 4][random.usize(..2)],
            (5, 14) => return [&request[..], &[0x20, 4, 0x24, random.u8(..4)]].concat(),
            _ => [1, 2][random.usize(..2)],
        };
        let length = if random.u8(..16) == 0 { random.usize(..61) } else { usual };
        let value = (random.u32(..) >> random.u32(0..32)).to_le_bytes();
        request.extend(value.iter().copied().chain(std::iter::repeat(0)).take(length));
    }
    if random.u8(..16) == 0 {
        request.push(random.u8(..));
        request.truncate(random.usize(1..=request.len()).min(64));
    }
    request
}

#[test]
fn any_request_has_one_answer_and_a_refused_one_changes_nothing() {
    // What is no number is meant for the walk through all requests, in `situations`.
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    let count = number("CODEWHEEL_REQUESTS").unwrap_or(100_000);
    let mut random = Rng::with_seed(number("CODEWHEEL_SEED").unwrap_or(1) as u64);
    let mut bench = Bench::new(0);
    let mut last: Vec<Vec<u8>> = Vec::new();
    for number in 0..count {
        if number % 2_000 == 0 {
            bench = Bench::new(number / 2_000);
            last.clear();
        }
        let request = request(&mut random);
        last.push(request.clone());
        let shown = Shown { last: &last, number };
        bench.judge(&request);
        drop(shown);
        if random.u8(..) == 0 {
            bench.wait(Duration::from_millis(random.u64(..5_000)));
        }
    }
}

/// Shows the last requests when one of them fails.
struct Shown<'a> {
    last: &'a [Vec<u8>],
    number: usize,
}

impl Drop for Shown<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let few = &self.last[self.last.len().saturating_sub(8)..];
            eprintln!("request {}, after those before it: {few:02X?}", self.number);
        }
    }
}

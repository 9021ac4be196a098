//! Every request there is: 256 services × 12 classes × 33 instances × 256 attributes × five lengths,
//! in six states of the device (devicenet clauses 4 and 5).
//!
//! By default a sample of 20 000; `CODEWHEEL_REQUESTS=n` takes n, `CODEWHEEL_REQUESTS=all` walks
//! all 130 million in each state (better with `--release`), `CODEWHEEL_SEED=s` repeats a sample.

use std::hash::{BuildHasher, Hasher};
use std::sync::atomic::{AtomicU64, Ordering};

use codewheel_device::DeviceNetEncoder;
use codewheel_devicenet::connection::State;
use codewheel_station::can::{Frame, Identifier, Input};
use codewheel_station::{Instant, Station};

use crate::bench::{Bench, Hand, hex};

/// The classes the device has, and four that it has not.
const CLASSES: [u8; 12] = [0x01, 0x02, 0x03, 0x04, 0x05, 0x0F, 0x2B, 0x2F, 0x00, 0x06, 0x64, 0xFF];
const KNOWN_CLASSES: usize = 8;
const INSTANCES: u64 = 33;
const LENGTHS: [usize; 5] = [0, 1, 2, 4, 5];
const REQUESTS: u64 = 256 * CLASSES.len() as u64 * INSTANCES * 256 * LENGTHS.len() as u64;
const STATES: [&str; 6] = [
    "explicit only",
    "poll configuring",
    "poll established",
    "poll timed out",
    "change of state established",
    "Save pending",
];
const SAVE_PENDING: usize = 5;
const SAMPLE: u64 = 20_000;

/// General status codes of devicenet clause 4 that a response may carry.
const STATUSES: [u8; 14] =
    [0x02, 0x08, 0x09, 0x0B, 0x0C, 0x0E, 0x10, 0x13, 0x14, 0x15, 0x16, 0x18, 0x19, 0x20];

/// A device with what it is at that moment; each request gets a copy of it.
struct Situation {
    device: DeviceNetEncoder<Hand>,
    now: Instant,
}

fn situation(state: usize) -> Situation {
    let mut bench = Bench::power_up("amg81-d29").allocated();
    bench.asks("4C 03 01 02", "CC");
    bench.turn_to(12_345);
    match state {
        0 => {}
        1 => bench.asks("4B 03 01 02 0A", "CB 00"),
        2 | 3 => {
            bench.asks("4B 03 01 02 0A", "CB 00");
            bench.asks("10 05 02 09 64 00", "90 6400");
            bench.says("42D#", &["3C5#39300000"]);
        }
        4 => {
            bench.asks("4B 03 01 10 0A", "CB 00");
            bench.asks("10 05 04 09 00 00", "90 0000");
            bench.says("42A#", &[]);
        }
        _ => {
            bench.serves_memory = false;
            assert_eq!(bench.ask("16 2F 01"), None);
            bench.device.keep(bench.now).expect("a record");
        }
    }
    if state == 3 {
        bench.wait(codewheel_station::Duration::from_millis(400));
        assert_eq!(bench.device.server().connection_state(2), Some(State::TimedOut));
    }
    Situation { device: bench.device, now: bench.now }
}

/// One request of the space.
#[derive(Clone, Copy)]
struct Request {
    body: [u8; 9],
    length: usize,
    known_class: bool,
}

impl Request {
    /// Request number `number`, 0 … `REQUESTS` − 1; `salt` makes its data.
    fn new(number: u64, salt: u64) -> Self {
        let mut rest = number;
        let mut digit = |base: u64| {
            let digit = rest % base;
            rest /= base;
            digit as usize
        };
        let data_length = LENGTHS[digit(LENGTHS.len() as u64)];
        let attribute = digit(256) as u8;
        let instance = digit(INSTANCES) as u8;
        let class = digit(CLASSES.len() as u64);
        let service = digit(256) as u8;
        let mut body = [0; 9];
        body[..4].copy_from_slice(&[service, CLASSES[class], instance, attribute]);
        // Small numbers, which mean something, and any others.
        let data = mix(salt);
        let mask = if data & 0x700 == 0 { u64::MAX } else { 0x0000_0000_0000_0103 };
        body[4..].copy_from_slice(&(mix(data) & mask).to_le_bytes()[..5]);
        Self { body, length: 4 + data_length, known_class: class < KNOWN_CLASSES }
    }

    fn octets(&self) -> &[u8] {
        &self.body[..self.length]
    }
}

/// One step of splitmix64.
fn mix(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// What came back.
#[derive(Default)]
struct Answer {
    /// Service, status and additional code, as far as there.
    head: [u8; 3],
    length: usize,
    answers: usize,
    productions: usize,
    checks: usize,
}

struct Course {
    device: DeviceNetEncoder<Hand>,
    now: Instant,
    serves_memory: bool,
}

impl Course {
    fn hear(&mut self, data: &[u8]) {
        self.device.handle(self.now, Input::Frame(&Frame::standard(0x42C, data)));
    }

    fn serve_memory(&mut self) {
        while self.serves_memory && self.device.keep(self.now).is_some() {
            self.device.kept(self.now, Ok::<(), ()>(()));
        }
    }

    /// Takes what the device says until it is silent, acknowledging what wants it.
    fn collect(&mut self, answer: &mut Answer, acknowledges: &mut usize) -> Result<(), String> {
        for _ in 0..60 {
            self.serve_memory();
            let Some(frame) = self.device.transmit(self.now) else { return Ok(()) };
            self.device.handle(self.now, Input::Sent(&frame));
            let Identifier::Standard(identifier) = frame.identifier() else {
                return Err(format!("no DeviceNet frame: {frame}"));
            };
            match (identifier, frame.data()) {
                (0x42B, [0x0A, body @ ..]) => {
                    answer.answers += 1;
                    take(answer, body);
                }
                (0x42B, [0x8A, octet, _]) if octet >> 6 == 3 => *acknowledges += 1,
                (0x42B, [0x8A, octet, body @ ..]) => {
                    if octet >> 6 == 0 {
                        answer.answers += 1;
                    }
                    take(answer, body);
                    let acknowledge = [0x8A, 0xC0 | octet & 0x3F, 0];
                    self.hear(&acknowledge);
                }
                (0x345, [_, _, _, _]) => {
                    answer.productions += 1;
                    self.device.handle(self.now, Input::Frame(&Frame::standard(0x42A, &[])));
                }
                (0x42F, _) => answer.checks += 1,
                _ => return Err(format!("unexpected: {frame}")),
            }
        }
        Err("the device does not stop sending".to_owned())
    }
}

fn take(answer: &mut Answer, body: &[u8]) {
    for octet in body {
        if let Some(place) = answer.head.get_mut(answer.length) {
            *place = *octet;
        }
        answer.length += 1;
    }
}

/// Asks a copy of the device, and judges what comes back.
fn judge(situation: &Situation, state: usize, request: Request) -> Result<(), String> {
    let octets = request.octets();
    let mut course = Course {
        device: situation.device.clone(),
        now: situation.now,
        serves_memory: state != SAVE_PENDING,
    };
    let mut answer = Answer::default();
    let mut acknowledges = 0;
    let mut pieces = 0;
    if octets.len() <= 7 {
        let mut data = [0x0A; 8];
        data[1..=octets.len()].copy_from_slice(octets);
        course.hear(&data[..=octets.len()]);
    } else {
        for (index, piece) in octets.chunks(6).enumerate() {
            let mut data = [0x8A; 8];
            data[1] = if index == 0 { 0 } else { 0x81 };
            data[2..2 + piece.len()].copy_from_slice(piece);
            course.hear(&data[..2 + piece.len()]);
            pieces += 1;
            course.collect(&mut answer, &mut acknowledges)?;
        }
    }
    course.collect(&mut answer, &mut acknowledges)?;
    let expect = |holds: bool, what: &str| if holds { Ok(()) } else { Err(what.to_owned()) };
    expect(acknowledges == pieces, "one acknowledge for each fragment")?;
    let [service, status, _] = answer.head;
    let restarted = course.device.server().master().is_none() && answer.checks > 0;
    expect(answer.checks <= usize::from(restarted), "no check message without a restart")?;
    if restarted {
        expect(octets[..3] == [5, 1, 1], "only a reset of the Identity object restarts")?;
    }
    if octets[0] >= 0x80 {
        expect(answer.answers == 0, "a response is met with silence")?;
    } else {
        expect(answer.answers == 1, "exactly one answer")?;
        let good = service == octets[0] | 0x80 && service != 0x94;
        let refused = service == 0x94 && answer.length == 3 && STATUSES.contains(&status);
        expect(good || refused, "an answer to this request, or a refusal")?;
        expect(good || !restarted, "a refused reset restarts nothing")?;
        if state == SAVE_PENDING {
            expect(refused && status == 0x10, "while a Save is pending: 10")?;
        } else if !request.known_class {
            expect(refused && status == 0x16, "an unknown class does not exist")?;
        }
        if refused {
            unchanged(&situation.device, &course.device)?;
            expect(answer.productions == 0, "a refusal produces nothing")?;
        }
    }
    legal(&course, restarted)
}

/// A refused request has changed nothing at all.
fn unchanged(
    before: &DeviceNetEncoder<Hand>,
    after: &DeviceNetEncoder<Hand>,
) -> Result<(), String> {
    let states = |device: &DeviceNetEncoder<Hand>| {
        let server = device.server();
        ([1, 2, 3, 4].map(|instance| server.connection_state(instance)), server.master())
    };
    let same = before.encoder().block() == after.encoder().block()
        && before.server().settings() == after.server().settings()
        && states(before) == states(after);
    if same { Ok(()) } else { Err("a refused request has changed something".to_owned()) }
}

fn legal(course: &Course, restarted: bool) -> Result<(), String> {
    let Course { device, now, .. } = course;
    let server = device.server();
    let [explicit, poll, third, change] =
        [1, 2, 3, 4].map(|instance| server.connection_state(instance));
    let encoder = device.encoder();
    let legal = encoder.block().check(encoder.model()).is_ok()
        && encoder.position() < encoder.settings().total_resolution
        && third.is_none()
        && matches!(explicit, None | Some(State::Established))
        && server.master().is_some() == (explicit.is_some() || poll.is_some() || change.is_some())
        && (!restarted || server.master().is_none())
        && device.deadline().is_none_or(|deadline| deadline > *now);
    if legal {
        Ok(())
    } else {
        Err(format!("an illegal state: {explicit:?} {poll:?} {change:?}, {:?}", encoder.block()))
    }
}

/// Judges `count` requests, the `place`-th being what `which` says, on all processors.
fn walk(count: u64, seed: u64, which: impl Fn(u64) -> (usize, u64) + Sync) {
    const CHUNK: u64 = 4_096;
    let next = AtomicU64::new(0);
    let work = || {
        let situations: Vec<Situation> = (0..STATES.len()).map(situation).collect();
        loop {
            let begin = next.fetch_add(CHUNK, Ordering::Relaxed);
            if begin >= count {
                return;
            }
            for place in begin..count.min(begin + CHUNK) {
                let (state, number) = which(place);
                let request = Request::new(number, mix(seed ^ number));
                if let Err(complaint) = judge(&situations[state], state, request) {
                    let (state, body) = (STATES[state], hex(request.octets()));
                    panic!("{complaint}: {body} with {state}, CODEWHEEL_SEED={seed}");
                }
            }
        }
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(work);
        }
    });
}

#[test]
fn every_request_gets_exactly_one_answer_or_a_justified_silence_and_leaves_a_legal_state() {
    let wanted = std::env::var("CODEWHEEL_REQUESTS").unwrap_or_default();
    let seed = std::env::var("CODEWHEEL_SEED").ok().map_or_else(
        || std::collections::hash_map::RandomState::new().build_hasher().finish(),
        |seed| seed.parse().expect("CODEWHEEL_SEED is a number"),
    );
    let states = STATES.len() as u64;
    let begin = std::time::Instant::now();
    let count = if wanted == "all" {
        let count = REQUESTS * states;
        println!("all {count} requests, CODEWHEEL_SEED={seed}");
        walk(count, seed, |place| ((place % states) as usize, place / states));
        count
    } else {
        let count = match wanted.as_str() {
            "" => SAMPLE,
            number => number.parse().expect("CODEWHEEL_REQUESTS is a number, or all"),
        };
        println!("{count} requests, CODEWHEEL_SEED={seed}");
        walk(count, seed, |place| {
            let random = mix(seed.wrapping_add(place));
            // Half of them ask for what a real master asks for: a service below 80h that exists.
            let number = mix(random) % REQUESTS;
            let number = if random & 1 == 0 { number } else { plausible(number, random) };
            ((place % states) as usize, number)
        });
        count
    };
    println!("{count} requests in {:.1} s", begin.elapsed().as_secs_f64());
}

/// The request `number` with a service, a class and an instance that the device knows.
fn plausible(number: u64, random: u64) -> u64 {
    const SERVICES: [u64; 9] = [0x01, 0x05, 0x0D, 0x0E, 0x10, 0x15, 0x16, 0x4B, 0x4C];
    let lengths = LENGTHS.len() as u64;
    let tail = 256 * lengths;
    let mut random = random >> 1;
    let mut digit = |base: u64| {
        let digit = random % base;
        random /= base;
        digit
    };
    let service = SERVICES[digit(SERVICES.len() as u64) as usize];
    let class = digit(KNOWN_CLASSES as u64);
    let instance = digit(5);
    let rest = if digit(4) == 0 { number % tail } else { digit(24) * lengths + digit(lengths) };
    ((service * CLASSES.len() as u64 + class) * INSTANCES + instance) * tail + rest
}

#[test]
fn the_numbers_of_the_space_name_each_request_once() {
    assert_eq!(REQUESTS, 129_761_280);
    let last = Request::new(REQUESTS - 1, 0);
    assert_eq!(last.octets()[..4], [0xFF, 0xFF, 32, 0xFF]);
    assert_eq!(last.length, 9);
    let first = Request::new(0, 0);
    assert_eq!(first.octets(), [0, 1, 0, 0]);
    for random in (0..10_000).map(mix) {
        let number = plausible(mix(random) % REQUESTS, random);
        assert!(number < REQUESTS);
        let request = Request::new(number, 0);
        assert!(request.known_class && request.body[0] < 0x80 && request.body[2] < 5);
    }
}

//! Arbitrary happenings to a whole encoder: peers, shaft, memory, controller, switches and power.

use codewheel_device::{Lamp, MemoryState};
use codewheel_devicenet::NetworkStatus;
use codewheel_devicenet::connection::State;
use codewheel_encoder::Kept;
use codewheel_sim::memory::TornMemory;
use codewheel_station::can::{Frame, Input};
use codewheel_station::{Duration, Station};
use proptest::prelude::*;

use crate::bench::{Bench, Hand, octets};

#[derive(Clone, Debug)]
enum Happening {
    /// A frame arrives.
    Frame(u16, Vec<u8>),
    /// Master 10 asks, in fragments if it must be, and does not wait for the answer.
    Ask(&'static str),
    /// Time passes, from deadline to deadline.
    Millis(u64),
    /// Time passes while the host is busy.
    Late(u64),
    HandsOut,
    Sent,
    Lost,
    BusOff,
    Recovered,
    Turn(u32),
    Turning(bool),
    Cell(bool),
    /// The host fetches a record.
    Fetch,
    /// The memory has ended a write, well or not.
    Kept(bool),
    PowerCycle,
}

/// Requests that change something, or take their time.
const REQUESTS: [&str; 32] = [
    "4B 03 01 02 0A",
    "4B 03 01 10 0A",
    "4B 03 01 60 0A",
    "4C 03 01 10",
    "4C 03 01 02",
    "10 05 02 09 64 00",
    "10 05 04 09 0A 00",
    "10 05 04 09 00 00",
    "10 05 04 11 05 00",
    "10 05 04 0E 20 04 24 02",
    "10 05 02 0E 20 04 24 02 30 03",
    "10 05 01 0C 03",
    "10 05 04 0C 02",
    "05 05 04",
    "10 2B 01 01 64 00",
    "10 2F 01 03 01",
    "10 2F 01 07 E8 03 00 00",
    "10 2F 01 08 A0 86 01 00",
    "10 2F 01 0A 07 00 00 00",
    "10 0F 05 01 10 00 00 00",
    "10 2F 01 0B 64 00 00 00",
    "0E 2F 01 02",
    "01 0F 01",
    "01 01 01",
    "16 2F 01",
    "16 0F 00",
    "15 2F 01",
    "05 2F 00",
    "10 03 01 03 01",
    "10 01 01 0A 01",
    "05 01 01",
    "05 01 01 01",
];

fn happening() -> impl Strategy<Value = Happening> {
    let frame = |id: u16, data: &[u8]| Just(Happening::Frame(id, data.to_vec()));
    let frames = prop_oneof![
        3 => frame(0x42D, &[]),
        3 => frame(0x42A, &[]),
        3 => frame(0x42E, &[0x0A, 0x4B, 3, 1, 0x13, 0x0A]),
        1 => frame(0x42E, &[0x0B, 0x4B, 3, 1, 3, 0x0B]),
        1 => frame(0x42E, &[0x0A, 0x4C, 3, 1, 1]),
        3 => (0..24_u8).prop_map(|count| Happening::Frame(0x42C, vec![0x8A, 0xC0 | count, 0])),
        1 => frame(0x42F, &[0, 1, 0, 1, 0, 0, 0]),
        1 => (0..0x800_u16, prop::collection::vec(any::<u8>(), 0..9))
            .prop_map(|(id, data)| Happening::Frame(id, data)),
    ];
    prop_oneof![
        6 => frames,
        8 => prop::sample::select(&REQUESTS[..]).prop_map(Happening::Ask),
        4 => prop_oneof![0..20_u64, 0..12_000_u64].prop_map(Happening::Millis),
        2 => (0..3_000_u64).prop_map(Happening::Late),
        6 => Just(Happening::HandsOut),
        5 => Just(Happening::Sent),
        1 => Just(Happening::Lost),
        1 => Just(Happening::BusOff),
        1 => Just(Happening::Recovered),
        2 => any::<u32>().prop_map(Happening::Turn),
        1 => any::<bool>().prop_map(Happening::Turning),
        1 => any::<bool>().prop_map(Happening::Cell),
        4 => Just(Happening::Fetch),
        4 => prop::bool::weighted(0.8).prop_map(Happening::Kept),
        1 => Just(Happening::PowerCycle),
    ]
}

/// The encoder with what its controller has taken and what its memory writes.
struct Course {
    bench: Bench,
    taken: Vec<Frame>,
    writing: Option<Kept>,
    frames: usize,
}

impl Course {
    fn new(model: &str, damaged: bool) -> Self {
        let mut memory = TornMemory::new();
        if damaged {
            memory.write(codewheel_encoder::Slot::A, &[0x55; 92], None);
            memory.write(codewheel_encoder::Slot::B, &[0xAA; 92], None);
        }
        let mut bench = Bench::power_up_with(model, memory, Hand::default()).allocated();
        bench.serves_memory = false;
        Self { bench, taken: Vec::new(), writing: None, frames: 0 }
    }

    fn hears(&mut self, data: &[u8]) {
        let frame = Frame::standard(0x42C, data);
        self.bench.device.handle(self.bench.now, Input::Frame(&frame));
    }

    fn go(&mut self, happening: Happening) {
        let now = self.bench.now;
        let device = &mut self.bench.device;
        match happening {
            Happening::Frame(id, data) => {
                device.handle(now, Input::Frame(&Frame::standard(id, &data)));
            }
            Happening::Ask(request) => {
                let body = octets(request);
                if body.len() <= 7 {
                    return self.hears(&[&[0x0A], &body[..]].concat());
                }
                let last = body.len().div_ceil(6) - 1;
                for (index, piece) in body.chunks(6).enumerate() {
                    let kind = if index == last { 0x80 } else { u8::from(index > 0) << 6 };
                    self.hears(&[&[0x8A, kind | index as u8], piece].concat());
                }
            }
            Happening::Millis(millis) => {
                let end = now + Duration::from_millis(millis);
                let mut steps = 0;
                while let Some(at) = self.bench.device.deadline().filter(|at| *at <= end) {
                    self.bench.now = self.bench.now.max(at);
                    self.bench.device.advance(self.bench.now);
                    steps += 1;
                    assert!(steps < 40_000, "deadlines without end at {}", self.bench.now);
                }
                self.bench.now = end;
                self.bench.device.advance(end);
            }
            Happening::Late(millis) => {
                self.bench.now = now + Duration::from_millis(millis);
                self.bench.device.advance(self.bench.now);
            }
            Happening::HandsOut => self.taken.extend(device.transmit(now)),
            Happening::Sent if !self.taken.is_empty() => {
                let frame = self.taken.remove(0);
                device.handle(now, Input::Sent(&frame));
            }
            Happening::Lost if !self.taken.is_empty() => drop(self.taken.remove(0)),
            Happening::Sent | Happening::Lost => {}
            Happening::BusOff => {
                self.taken.clear();
                device.handle(now, Input::BusOff);
            }
            Happening::Recovered => device.handle(now, Input::Recovered),
            Happening::Turn(code) => device.sensor_mut().code = code,
            Happening::Turning(turning) => device.sensor_mut().turning = turning,
            Happening::Cell(low) => device.sensor_mut().cell_low = low,
            Happening::Fetch => {
                let record = device.keep(now);
                assert!(record.is_none() || self.writing.is_none(), "one record at a time");
                self.writing = self.writing.or(record);
            }
            Happening::Kept(good) => {
                if self.writing.take().is_some() {
                    device.kept(now, if good { Ok(()) } else { Err(()) });
                }
            }
            Happening::PowerCycle => {
                self.taken.clear();
                device.power_cycle(now);
            }
        }
    }

    fn check(&self) {
        let snapshot = self.bench.device.snapshot(self.bench.now);
        let model = snapshot.product.encoder;
        snapshot.in_force.check(model).expect("the settings in force are legal");
        snapshot.saved.check(model).expect("the saved settings are legal");
        assert!(snapshot.position < snapshot.in_force.settings.total_resolution);
        let network = snapshot.devicenet().expect("a DeviceNet device");
        let [explicit, poll, change] = [network.explicit, network.poll, network.change_of_state];
        let ios = [poll, change];
        assert!(!matches!(explicit, Some(State::Configuring | State::TimedOut)));
        let exists = explicit.is_some() || ios.iter().any(Option::is_some);
        assert_eq!(network.master.is_some(), exists);
        let lives = explicit == Some(State::Established) || ios.contains(&Some(State::Established));
        assert!(lives || !exists, "a dead master owns {explicit:?} {ios:?}");
        let silent = matches!(
            self.bench.device.server().status(),
            NetworkStatus::Faulted(_) | NetworkStatus::NotOnLine
        );
        assert!(!silent || !exists);
        assert_eq!(snapshot.lamp == Lamp::RedFlashing, ios.contains(&Some(State::TimedOut)));
        assert!(snapshot.memory != MemoryState::Fresh || snapshot.writes == 0);
    }

    /// Nothing lies in the past once the host has done what it can, and there is little to say.
    fn drain(&mut self) {
        let now = self.bench.now;
        self.bench.device.advance(now);
        let mut frames = 0;
        while let Some(frame) = self.bench.device.transmit(now) {
            frames += 1;
            assert!(frames < 10, "the device does not stop sending: {frame}");
            self.taken.push(frame);
        }
        self.frames += frames;
        if let Some(deadline) = self.bench.device.deadline() {
            assert!(deadline > now, "the deadline {deadline} is not served at {now}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_to_an_encoder_its_state_stays_legal_and_its_deadlines_lie_ahead(
        model in prop::sample::select(vec!["amg11-d29", "amg81-d29", "hmg10-d13"]),
        damaged in prop::bool::weighted(0.2),
        drains in any::<u64>(),
        happenings in prop::collection::vec(happening(), 1..120),
    ) {
        let mut course = Course::new(model, damaged);
        for (index, happening) in happenings.into_iter().enumerate() {
            course.go(happening);
            course.check();
            // Now and then the host finds the time for everything; in between things pile up.
            if drains >> (index % 64) & 1 == 1 {
                course.drain();
                course.check();
            }
        }
        course.drain();
    }
}

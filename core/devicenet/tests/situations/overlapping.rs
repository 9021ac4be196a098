//! Arbitrary happenings whose answers overlap: the wire takes frames when it likes, reports them
//! late or never, and the controller leaves the bus and comes back.

use codewheel_devicenet::NetworkStatus;
use codewheel_devicenet::connection::State;
use codewheel_devicenet::explicit::GeneralStatus;
use codewheel_station::can::{Frame, Input};
use codewheel_station::{Duration, Station};
use proptest::prelude::*;

use crate::bench::Bench;

/// One thing that happens to the node, its controller or its device.
#[derive(Clone, Debug)]
enum Happening {
    Frame(u16, Vec<u8>),
    /// Time passes, from deadline to deadline.
    Micros(u64),
    /// Time passes while the host is busy: one call at its end.
    Late(u64),
    /// The controller takes a frame.
    HandsOut,
    /// The controller reports the oldest frame it took as sent.
    Sent,
    /// It never will.
    Lost,
    BusOff,
    Recovered,
    Moved,
    Complete(bool),
    /// The host cycles the power if it is asked to.
    PowerCycle,
}

fn happening() -> impl Strategy<Value = Happening> {
    let frame = |id: u16, data: &[u8]| Just(Happening::Frame(id, data.to_vec()));
    let useful = prop_oneof![
        frame(0x42D, &[]),
        frame(0x42A, &[]),
        frame(0x42E, &[0x0A, 0x4B, 3, 1, 0x13, 0x0A]),
        frame(0x42E, &[0x0A, 0x4B, 3, 1, 0x61, 0x0A]),
        frame(0x42E, &[0x0B, 0x4B, 3, 1, 3, 0x0B]),
        frame(0x42E, &[0x0A, 0x4C, 3, 1, 1]),
        frame(0x42E, &[0x0A, 0x4C, 3, 1, 0x10]),
        frame(0x42C, &[0x0A, 0x10, 5, 2, 9, 20, 0]),
        frame(0x42C, &[0x0A, 0x10, 5, 4, 9, 5, 0]),
        frame(0x42C, &[0x0A, 0x10, 5, 4, 0x11, 2, 0]),
        frame(0x42C, &[0x0A, 0x10, 5, 1, 12, 3]),
        frame(0x42C, &[0x0A, 5, 5, 4]),
        frame(0x42C, &[0x0A, 0x10, 5, 4, 12, 2]),
        frame(0x42C, &[0x0A, 0x10, 3, 1, 3, 1]),
        frame(0x42C, &[0x0A, 0x10, 1, 1, 10, 1]),
    ];
    let explicit = prop_oneof![
        frame(0x42C, &[0x0A, 0x0E, 0x64, 1, 2]),
        frame(0x42C, &[0x0A, 0x0E, 1, 1, 1]),
        frame(0x42C, &[0x8A, 0x3F, 0x0E, 0x64, 1, 2]),
        frame(0x42C, &[0x8A, 0x00, 0x10, 0x64, 1, 1, 7]),
        frame(0x42C, &[0x8A, 0x81, 7]),
        (0..8_u8).prop_map(|count| Happening::Frame(0x42C, vec![0x8A, 0xC0 | count, 0])),
        frame(0x42C, &[0x0A, 0x16, 0x64, 1]),
        frame(0x42C, &[0x0A, 5, 1, 1]),
        frame(0x42C, &[0x0A, 5, 1, 1, 1]),
        frame(0x42F, &[0, 1, 0, 1, 0, 0, 0]),
    ];
    prop_oneof![
        6 => useful,
        5 => explicit,
        1 => (0..0x800_u16, prop::collection::vec(any::<u8>(), 0..9))
            .prop_map(|(id, data)| Happening::Frame(id, data)),
        4 => prop_oneof![0..3_000_u64, 0..12_000_000_u64].prop_map(Happening::Micros),
        2 => (0..3_000_000_u64).prop_map(Happening::Late),
        5 => Just(Happening::HandsOut),
        4 => Just(Happening::Sent),
        1 => Just(Happening::Lost),
        1 => Just(Happening::BusOff),
        1 => Just(Happening::Recovered),
        2 => Just(Happening::Moved),
        1 => any::<bool>().prop_map(Happening::Complete),
        1 => Just(Happening::PowerCycle),
    ]
}

/// The node with the frames that its controller has taken and not reported as sent.
struct Course {
    bench: Bench,
    taken: Vec<Frame>,
}

impl Course {
    fn go(&mut self, happening: Happening) {
        let Self { bench, taken } = self;
        match happening {
            Happening::Frame(id, data) => {
                bench.node.handle(bench.now, Input::Frame(&Frame::standard(id, &data)));
            }
            Happening::Micros(micros) => {
                let end = bench.now + Duration::from_micros(micros);
                let mut steps = 0;
                while let Some(at) = bench.node.deadline().filter(|at| *at <= end) {
                    bench.now = bench.now.max(at);
                    bench.node.advance(bench.now);
                    steps += 1;
                    assert!(steps < 100_000, "deadlines without end at {}", bench.now);
                }
                bench.now = end;
                bench.node.advance(end);
            }
            Happening::Late(micros) => {
                bench.now += Duration::from_micros(micros);
                bench.node.advance(bench.now);
            }
            Happening::HandsOut => taken.extend(bench.node.transmit(bench.now)),
            Happening::Sent if !taken.is_empty() => {
                let frame = taken.remove(0);
                bench.node.handle(bench.now, Input::Sent(&frame));
            }
            Happening::Lost if !taken.is_empty() => drop(taken.remove(0)),
            Happening::Sent | Happening::Lost => {}
            Happening::BusOff => {
                taken.clear();
                bench.node.handle(bench.now, Input::BusOff);
            }
            Happening::Recovered => bench.node.handle(bench.now, Input::Recovered),
            Happening::Moved => bench.node.toy.moved = true,
            Happening::Complete(good) => {
                let failed = GeneralStatus::STORE_FAILED.into();
                bench.node.server.complete(if good { Ok(()) } else { Err(failed) });
            }
            Happening::PowerCycle => {
                if bench.node.server.power_cycle_due() {
                    *bench = Bench::on_line();
                    taken.clear();
                }
            }
        }
    }

    fn check(&self) {
        let server = &self.bench.node.server;
        let [explicit, poll, change] = [1, 2, 4].map(|instance| server.connection_state(instance));
        let ios = [poll, change];
        assert!(!matches!(explicit, Some(State::Configuring | State::TimedOut)));
        assert!(ios.iter().all(|state| *state != Some(State::DeferredDelete)));
        assert_eq!(server.connection_state(3), None);
        let exists = explicit.is_some() || ios.iter().any(Option::is_some);
        assert_eq!(server.master().is_some(), exists);
        let established = ios.contains(&Some(State::Established));
        match explicit {
            None => assert!(!exists || established, "{ios:?} own the set without a master"),
            Some(State::DeferredDelete) => assert!(established),
            Some(_) => {}
        }
        let timed_out = ios.contains(&Some(State::TimedOut));
        match server.status() {
            NetworkStatus::Faulted(_) | NetworkStatus::NotOnLine => assert!(!exists),
            NetworkStatus::TimedOut => assert!(timed_out),
            NetworkStatus::Connected => assert!(exists && !timed_out),
            NetworkStatus::OnLine => assert!(!exists),
        }
    }

    /// Everything the node still has to say, with no frame reported as sent, and then nothing that
    /// lies in the past.
    fn drain(&mut self) {
        let Bench { node, now } = &mut self.bench;
        node.advance(*now);
        let mut frames = Vec::new();
        while let Some(frame) = node.transmit(*now) {
            frames.push(frame);
            assert!(frames.len() < 10, "the node does not stop sending: {frames:?}");
        }
        if let Some(deadline) = node.deadline() {
            assert!(deadline > *now, "the deadline {deadline} is not served at {now}");
        }
        self.taken.append(&mut frames);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, ..ProptestConfig::default() })]

    #[test]
    fn answers_that_overlap_leave_a_legal_state_a_future_deadline_and_little_to_say(
        happenings in prop::collection::vec(happening(), 1..120)
    ) {
        let mut course = Course { bench: Bench::polled(), taken: Vec::new() };
        for happening in happenings {
            course.go(happening);
            course.check();
        }
        course.drain();
        course.check();
        // In the end the node answers again, or is silent for a reason.
        let bench = &mut course.bench;
        let silent = matches!(
            bench.node.server.status(),
            NetworkStatus::Faulted(_) | NetworkStatus::NotOnLine
        );
        if silent || bench.node.server.power_cycle_due() {
            return Ok(());
        }
        bench.wait(Duration::from_secs(20));
        bench.node.server.complete(Ok(()));
        bench.wait(Duration::from_secs(300));
        if bench.node.server.power_cycle_due() {
            return Ok(());
        }
        let owner = bench.node.server.master().map_or(10, |mac| mac.value());
        bench.hears(&format!("42E#{owner:02X}4B030101{owner:02X}"));
        let answer = bench.collect();
        let answered = answer.iter().any(|frame| {
            [format!("42B#{owner:02X}CB00"), format!("42B#{owner:02X}940B02")].contains(frame)
        });
        prop_assert!(answered, "{:?}", answer);
    }
}

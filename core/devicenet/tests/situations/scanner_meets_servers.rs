//! The scanner and servers on one ideal medium: every frame reaches all others at once.

use codewheel_devicenet::connection::State;
use codewheel_devicenet::scanner::{
    ChangeSettings, DeviceIdentity, IdentityCode, NotTaken, PollSettings, Refusal, Response,
    Scanner, ScannerIdentity, SlaveSettings, SlaveState,
};
use codewheel_devicenet::{MacId, NetworkStatus};
use codewheel_station::can::{Frame, Input};
use codewheel_station::{Duration, Instant, Station, earlier};

use crate::bench::{Node, TEXT};

/// A scanner and its servers; a frame takes 200 µs, `lost` says which ones nobody hears.
struct Segment {
    scanner: Scanner<8>,
    nodes: Vec<Node>,
    /// Powered nodes.
    on: Vec<bool>,
    now: Instant,
    lost: fn(u64, &Frame) -> bool,
    frames: u64,
}

const FRAME_TIME: Duration = Duration::from_micros(200);

impl Segment {
    fn new(macs: &[u8]) -> Self {
        let settings: Vec<_> =
            macs.iter().map(|mac| SlaveSettings::poll(MacId::new(*mac).unwrap())).collect();
        Self::with(&settings)
    }

    fn with(settings: &[SlaveSettings]) -> Self {
        let identity = ScannerIdentity { vendor: 1, serial: 99 };
        let master = MacId::new(0).unwrap();
        let mut scanner = Scanner::new(master, identity, Duration::from_millis(10));
        for settings in settings {
            scanner.add(*settings).unwrap();
        }
        let nodes: Vec<Node> =
            settings.iter().map(|settings| Node::new(settings.mac.value())).collect();
        let on = vec![true; nodes.len()];
        Self { scanner, nodes, on, now: Instant::ZERO, lost: |_, _| false, frames: 0 }
    }

    fn run(&mut self, span: Duration) {
        let end = self.now + span;
        while self.now < end {
            if self.deliver_one() {
                self.now += FRAME_TIME;
            } else {
                let nodes = self.nodes.iter().zip(&self.on).filter(|(_, on)| **on);
                let next =
                    nodes.map(|(node, _)| node.deadline()).fold(self.scanner.deadline(), earlier);
                self.now = next.unwrap_or(end).max(self.now + Duration::from_nanos(1)).min(end);
            }
            self.scanner.advance(self.now);
            for (node, _) in self.nodes.iter_mut().zip(&self.on).filter(|(_, on)| **on) {
                node.advance(self.now);
            }
        }
    }

    /// Moves one frame, the scanner's first; whether there was one.
    fn deliver_one(&mut self) -> bool {
        let now = self.now;
        if let Some(frame) = self.scanner.transmit(now) {
            self.frames += 1;
            self.scanner.handle(now, Input::Sent(&frame));
            if !(self.lost)(self.frames, &frame) {
                for (node, _) in self.nodes.iter_mut().zip(&self.on).filter(|(_, on)| **on) {
                    node.handle(now, Input::Frame(&frame));
                }
            }
            return true;
        }
        for place in 0..self.nodes.len() {
            if !self.on[place] {
                continue;
            }
            let Some(frame) = self.nodes[place].transmit(now) else { continue };
            self.frames += 1;
            self.nodes[place].handle(now, Input::Sent(&frame));
            if !(self.lost)(self.frames, &frame) {
                self.scanner.handle(now, Input::Frame(&frame));
            }
            return true;
        }
        false
    }

    fn state(&self, mac: u8) -> SlaveState {
        self.scanner.slave(MacId::new(mac).unwrap()).unwrap().state
    }

    fn responses(&self, mac: u8) -> u64 {
        self.scanner.slave(MacId::new(mac).unwrap()).unwrap().responses
    }

    fn changes(&self, mac: u8) -> u64 {
        self.scanner.slave(MacId::new(mac).unwrap()).unwrap().changes
    }

    fn ask(&mut self, mac: u8, body: &[u8]) -> Result<Vec<u8>, String> {
        let mac = MacId::new(mac).unwrap();
        let patience = Duration::from_millis(500);
        let ticket = self.scanner.request(mac, body, patience).map_err(|why| format!("{why:?}"))?;
        for _ in 0..100 {
            self.run(Duration::from_millis(100));
            let seen = self.scanner.response(ticket, |response| match response {
                Response::Done(data) => Ok(data.to_vec()),
                Response::Refused(error) => Err(error.to_string()),
                Response::TooLong | Response::NoAnswer => Err("no answer".into()),
            });
            if let Some(seen) = seen {
                return seen;
            }
        }
        panic!("the request neither succeeds nor fails");
    }
}

#[test]
fn all_slaves_are_allocated_and_polled_every_cycle() {
    let mut segment = Segment::new(&[3, 5, 63]);
    segment.run(Duration::from_secs(3));
    for mac in [3, 5, 63] {
        assert_eq!(segment.state(mac), SlaveState::Running);
        let before = segment.responses(mac);
        segment.run(Duration::from_secs(1));
        let polls = segment.responses(mac) - before;
        assert!((98..=102).contains(&polls), "{polls} polls in 100 cycles of 10 ms");
    }
    for node in &segment.nodes {
        assert_eq!(node.server.status(), NetworkStatus::Connected);
        assert_eq!(node.server.master(), MacId::new(0));
    }
    assert!(segment.scanner.cycle_times().last < Duration::from_millis(2));
}

#[test]
fn attributes_are_read_and_written_between_polls_fragmented_where_they_must_be() {
    let mut segment = Segment::new(&[5]);
    segment.run(Duration::from_secs(3));
    assert_eq!(segment.ask(5, &[0x10, 0x64, 1, 1, 0x34, 0x12, 0, 0]), Ok(vec![]));
    assert_eq!(segment.ask(5, &[0x0E, 0x64, 1, 1]), Ok(vec![0x34, 0x12]));
    assert_eq!(segment.ask(5, &[0x0E, 0x64, 1, 2]), Ok(TEXT.to_vec()));
    let refusal = segment.ask(5, &[0x0E, 0x64, 1, 9]);
    assert_eq!(refusal, Err("14 attribute not supported".into()));
    assert_eq!(segment.state(5), SlaveState::Running);
}

#[test]
fn the_explicit_connection_outlives_an_hour_without_a_request() {
    let mut segment = Segment::new(&[5]);
    segment.run(Duration::from_secs(3_600));
    assert_eq!(segment.nodes[0].server.connection_state(1), Some(State::DeferredDelete));
    assert_eq!(segment.ask(5, &[0x0E, 0x01, 1, 1]), Ok(vec![0x34, 0x12]));
}

#[test]
fn a_slave_that_loses_power_is_missed_and_comes_back() {
    let mut segment = Segment::new(&[3, 5]);
    segment.run(Duration::from_secs(3));
    segment.on[1] = false;
    segment.run(Duration::from_secs(2));
    assert_ne!(segment.state(5), SlaveState::Running);
    assert_eq!(segment.state(3), SlaveState::Running);
    segment.nodes[1] = Node::new(5);
    segment.on[1] = true;
    segment.run(Duration::from_secs(4));
    assert_eq!(segment.state(5), SlaveState::Running);
    assert_eq!(segment.scanner.slave(MacId::new(5).unwrap()).unwrap().losses, 1);
}

#[test]
fn a_scanner_that_restarts_releases_its_old_allocation_and_allocates_anew() {
    let mut segment = Segment::new(&[5]);
    segment.run(Duration::from_secs(3));
    let identity = ScannerIdentity { vendor: 1, serial: 99 };
    segment.scanner = Scanner::new(MacId::new(0).unwrap(), identity, Duration::from_millis(10));
    segment.scanner.add(SlaveSettings::poll(MacId::new(5).unwrap())).unwrap();
    // The first allocation is not seen as lost: the poll connection has no time-out yet.
    segment.run(Duration::from_secs(5));
    assert_eq!(segment.state(5), SlaveState::Running);
}

#[test]
fn a_slave_of_another_master_is_left_to_it() {
    let mut segment = Segment::new(&[]);
    segment.nodes.push(Node::new(5));
    segment.on.push(true);
    segment.run(Duration::from_secs(3));
    let other = crate::bench::frame("42E#3F4B0301033F");
    segment.nodes[0].handle(segment.now, Input::Frame(&other));
    segment.scanner.add(SlaveSettings::poll(MacId::new(5).unwrap())).unwrap();
    segment.run(Duration::from_secs(1));
    let SlaveState::Refused(Refusal::Service(error)) = segment.state(5) else {
        panic!("{:?}", segment.state(5));
    };
    assert_eq!(error.to_string(), "0C object state conflict (additional code 01)");
    // The other master never sets a rate: after 10 s the slave is free.
    segment.run(Duration::from_secs(13));
    assert_eq!(segment.state(5), SlaveState::Running);
}

#[test]
fn a_device_that_is_not_the_wanted_one_is_not_polled() {
    let mut segment = Segment::new(&[]);
    segment.nodes.push(Node::new(5));
    segment.on.push(true);
    let mac = MacId::new(5).unwrap();
    let settings = SlaveSettings {
        identity: Some(DeviceIdentity { vendor: 0x1234, product_code: 0x0A }),
        ..SlaveSettings::poll(mac)
    };
    segment.scanner.add(settings).unwrap();
    segment.run(Duration::from_secs(4));
    let refusal =
        Refusal::AnotherDevice { code: IdentityCode::ProductCode, found: 0x0B, wanted: 0x0A };
    assert_eq!(segment.state(5), SlaveState::Refused(refusal));
    assert_eq!(segment.responses(5), 0);
}

#[test]
fn a_slave_produces_the_assembly_that_the_settings_name() {
    let mut segment = Segment::new(&[]);
    segment.nodes.push(Node::new(5));
    segment.on.push(true);
    let mac = MacId::new(5).unwrap();
    let poll = Some(PollSettings { expected_packet_rate: 200, assembly: Some(2) });
    let settings = SlaveSettings { poll, ..SlaveSettings::poll(mac) };
    segment.scanner.add(settings).unwrap();
    segment.run(Duration::from_secs(4));
    assert_eq!(segment.scanner.slave(mac).unwrap().input.len(), 5);
}

#[test]
fn a_request_to_a_slave_that_is_not_there_is_not_taken() {
    let mut segment = Segment::new(&[5]);
    let patience = Duration::from_millis(500);
    let mac = |value| MacId::new(value).unwrap();
    let mut ask = |mac, body: &[u8]| segment.scanner.request(mac, body, patience);
    assert_eq!(ask(mac(5), &[0x0E, 1, 1, 1]), Err(NotTaken::OffLine));
    assert_eq!(ask(mac(6), &[0x0E, 1, 1, 1]), Err(NotTaken::UnknownSlave));
    assert_eq!(ask(mac(5), &[]), Err(NotTaken::Length));
    assert_eq!(ask(mac(5), &[0; 65]), Err(NotTaken::Length));
}

#[test]
fn a_request_to_a_slave_that_dies_meanwhile_ends_without_an_answer() {
    let mut segment = Segment::new(&[5]);
    segment.run(Duration::from_secs(3));
    segment.on[0] = false;
    assert_eq!(segment.ask(5, &[0x0E, 1, 1, 1]), Err("no answer".into()));
    segment.nodes[0] = Node::new(5);
    segment.on[0] = true;
    segment.run(Duration::from_secs(5));
    assert_eq!(segment.state(5), SlaveState::Running);
    assert_eq!(segment.ask(5, &[0x0E, 1, 1, 1]), Ok(vec![0x34, 0x12]));
}

#[test]
fn every_tenth_frame_lost_at_random_slows_the_start_and_prevents_nothing() {
    let mut segment = Segment::new(&[3, 5, 7, 9]);
    segment.lost = |count, _| {
        let scattered = count.wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29);
        scattered.wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 32 & 0xFF < 26
    };
    segment.run(Duration::from_secs(15));
    for mac in [3, 5, 7, 9] {
        assert_eq!(segment.state(mac), SlaveState::Running, "slave {mac}");
        let before = segment.responses(mac);
        segment.run(Duration::from_secs(10));
        assert!(segment.responses(mac) - before > 100, "slave {mac} hardly answers");
    }
}

/// Settings for MAC ID 5 with change of state data every `rate` ms and when they change.
fn change_of_state(rate: u16, acknowledged: bool) -> SlaveSettings {
    let settings = SlaveSettings::change_of_state(MacId::new(5).unwrap());
    let change = settings.change.map(|change| ChangeSettings {
        expected_packet_rate: rate,
        acknowledged,
        ..change
    });
    SlaveSettings { change, ..settings }
}

#[test]
fn change_of_state_data_come_when_they_change_and_when_the_rate_elapses() {
    for acknowledged in [true, false] {
        let mut segment = Segment::with(&[change_of_state(200, acknowledged)]);
        segment.run(Duration::from_secs(3));
        assert_eq!(segment.state(5), SlaveState::Running);
        let before = segment.changes(5);
        segment.run(Duration::from_secs(20));
        let by_time = segment.changes(5) - before;
        assert!((99..=101).contains(&by_time), "{by_time} in 20 s, acknowledged: {acknowledged}");
        let before = segment.changes(5);
        for _ in 0..10 {
            segment.nodes[0].toy.moved = true;
            // The server looks for changes whenever it is run; it is asked for frames after that.
            segment.run(Duration::from_millis(10));
            segment.run(Duration::from_millis(10));
        }
        let by_change = segment.changes(5) - before;
        assert!(by_change >= 10, "{by_change} of ten changes");
        assert_eq!(segment.scanner.slave(MacId::new(5).unwrap()).unwrap().losses, 0);
        assert_eq!(segment.nodes[0].server.connection_state(4), Some(State::Established));
    }
}

#[test]
fn cyclic_data_keep_their_beat() {
    let mut segment = Segment::with(&[SlaveSettings::cyclic(MacId::new(5).unwrap(), 50)]);
    segment.run(Duration::from_secs(3));
    let before = segment.changes(5);
    segment.run(Duration::from_secs(30));
    let beats = segment.changes(5) - before;
    assert!((599..=601).contains(&beats), "{beats} in 30 s of 50 ms each");
    assert_eq!(segment.responses(5), 0);
}

#[test]
fn a_slave_is_polled_and_produces_changes_side_by_side() {
    let poll = SlaveSettings::poll(MacId::new(5).unwrap()).poll;
    let mut segment = Segment::with(&[SlaveSettings { poll, ..change_of_state(500, true) }]);
    segment.run(Duration::from_secs(3));
    let (responses, changes) = (segment.responses(5), segment.changes(5));
    segment.run(Duration::from_secs(10));
    assert!((990..=1_010).contains(&(segment.responses(5) - responses)));
    assert!((19..=21).contains(&(segment.changes(5) - changes)));
    assert_eq!(segment.ask(5, &[0x0E, 0x64, 1, 2]), Ok(TEXT.to_vec()));
}

#[test]
fn a_change_of_state_slave_that_loses_power_is_missed_and_comes_back() {
    let mut segment = Segment::with(&[change_of_state(100, true)]);
    segment.run(Duration::from_secs(3));
    segment.on[0] = false;
    segment.run(Duration::from_secs(2));
    assert_eq!(segment.state(5), SlaveState::Absent);
    segment.nodes[0] = Node::new(5);
    segment.on[0] = true;
    segment.run(Duration::from_secs(4));
    assert_eq!(segment.state(5), SlaveState::Running);
    let before = segment.changes(5);
    segment.run(Duration::from_secs(1));
    assert!(segment.changes(5) - before >= 9);
}

#[test]
fn an_explicit_connection_alone_lives_for_an_hour_and_answers() {
    let mut segment = Segment::with(&[SlaveSettings::explicit(MacId::new(5).unwrap())]);
    segment.run(Duration::from_secs(3_600));
    let slave = segment.scanner.slave(MacId::new(5).unwrap()).unwrap();
    assert_eq!((slave.state, slave.losses), (SlaveState::Running, 0));
    assert_eq!(segment.nodes[0].server.connection_state(1), Some(State::Established));
    assert_eq!(segment.nodes[0].server.connection_state(2), None);
    assert_eq!(segment.ask(5, &[0x0E, 0x64, 1, 2]), Ok(TEXT.to_vec()));
}

#[test]
fn a_slave_taken_off_the_list_belongs_to_nobody() {
    let poll = SlaveSettings::poll(MacId::new(5).unwrap()).poll;
    let mut segment = Segment::with(&[SlaveSettings { poll, ..change_of_state(500, true) }]);
    segment.run(Duration::from_secs(3));
    segment.scanner.remove(MacId::new(5).unwrap());
    segment.run(Duration::from_millis(100));
    assert_eq!(segment.nodes[0].server.master(), None);
    assert_eq!(segment.nodes[0].server.status(), NetworkStatus::OnLine);
    assert!(segment.scanner.slave(MacId::new(5).unwrap()).is_none());
}

#[test]
fn a_scanner_that_restarts_gets_every_kind_of_connection_back() {
    let poll = SlaveSettings::poll(MacId::new(5).unwrap()).poll;
    for settings in [
        SlaveSettings { poll, ..change_of_state(5_000, true) },
        SlaveSettings::cyclic(MacId::new(5).unwrap(), 5_000),
        SlaveSettings::explicit(MacId::new(5).unwrap()),
    ] {
        let mut segment = Segment::with(&[settings]);
        segment.run(Duration::from_secs(3));
        let identity = ScannerIdentity { vendor: 1, serial: 99 };
        segment.scanner = Scanner::new(MacId::new(0).unwrap(), identity, Duration::from_millis(10));
        // This life wants something else than the last.
        segment.scanner.add(SlaveSettings::poll(MacId::new(5).unwrap())).unwrap();
        segment.run(Duration::from_secs(3));
        assert_eq!(segment.state(5), SlaveState::Running, "after {settings:?}");
        assert_eq!(segment.nodes[0].server.connection_state(4), None, "after {settings:?}");
    }
}

#[test]
fn the_wrong_device_is_free_for_other_masters() {
    let mac = MacId::new(5).unwrap();
    let identity = Some(DeviceIdentity { vendor: 0x1234, product_code: 0x0A });
    let mut segment = Segment::with(&[SlaveSettings { identity, ..SlaveSettings::poll(mac) }]);
    segment.run(Duration::from_millis(3_500));
    assert!(matches!(segment.state(5), SlaveState::Refused(Refusal::AnotherDevice { .. })));
    assert_eq!(segment.nodes[0].server.master(), None);
}

#[test]
fn requests_to_slaves_that_lose_every_tenth_frame_end_with_the_right_answer_or_none() {
    let mut segment = Segment::new(&[3, 5]);
    segment.run(Duration::from_secs(3));
    segment.lost = |count, _| {
        let scattered = count.wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29);
        scattered.wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 32 & 0xFF < 26
    };
    let mut good = 0;
    for _ in 0..60 {
        match segment.ask(5, &[0x0E, 0x64, 1, 2]) {
            Ok(data) => {
                assert_eq!(data, TEXT);
                good += 1;
            }
            Err(why) => assert!(why == "no answer" || why == "NotRunning", "{why}"),
        }
        segment.run(Duration::from_millis(50));
    }
    assert!(good > 30, "{good} of 60 answered");
}

use codewheel_sim::can::{Event, Script, Wire, candump_line, frame_bits};
use codewheel_station::can::{BitRate, Filter, Frame, Input};
use codewheel_station::{Instant, Station};

use super::*;

#[test]
fn the_lowest_identifier_goes_first_and_losers_keep_their_frame() {
    let mut wire = wire();
    for text in ["12345678#", "42D#", "3C5#01", "3C5#R1", "0F140000#", "7EF#"] {
        wire.attach(text, saying(millis(1), &[text]), &[], false);
    }
    let events = events(&mut wire, millis(3));
    // 0F140000 has the base 3C5: after the standard data and remote frames of that identifier.
    assert_eq!(frames(&events), ["3C5#01", "3C5#R1", "0F140000#", "42D#", "12345678#", "7EF#"]);
}

#[test]
fn a_frame_lasts_exactly_its_bits_at_every_bit_rate() {
    for rate in BitRate::ALL {
        let mut wire = Wire::new(rate, 1);
        let (first, second) = (frame("3C5#00100000"), frame("3C5#FFFFFFFF"));
        let script = Script::new().sending(millis(1), first).sending(millis(1), second);
        let from = wire.attach("sender", script, &[], true);
        let listener = wire.attach("listener", Script::new(), &[Filter::ALL], true);
        let events = events(&mut wire, millis(10));

        let bit = Duration::from_nanos(rate.bit_nanos());
        let first_idle = millis(1) + bit.times(frame_bits(&first).into());
        let second_idle = first_idle + bit.times(frame_bits(&second).into());
        let expected = [(first, first_idle), (second, second_idle)].map(|(frame, idle)| {
            Event::Frame { at: idle - bit.times(3), from, frame, bits: frame_bits(&frame) }
        });
        assert_eq!(events, expected, "the end of frame is three bits before the wire is free");
        let ends = expected.map(|event| event.at());
        let heard = wire.node(listener).unwrap().received();
        assert_eq!(heard, [(ends[0], first), (ends[1], second)]);
        assert_eq!(wire.node(from).unwrap().sent(), heard);
        let load = wire.statistics().bus_load_since(&Default::default());
        let busy = second_idle.since(millis(1)).as_nanos() as f64;
        assert!((load - busy / 10e6).abs() < 1e-12, "{load}");
    }
}

#[test]
fn only_takers_see_a_frame_and_never_its_sender() {
    let mut wire = wire();
    let sender = wire.attach("sender", saying(millis(0), &["3C5#01"]), &[Filter::ALL], true);
    let taker = wire.attach("taker", Script::new(), &[exactly(1), exactly(0x3C5)], true);
    let other = wire.attach("other", Script::new(), &[exactly(0x3C6)], false);
    let deaf = wire.attach("no filter", Script::new(), &[], false);
    events(&mut wire, millis(1));
    let heard = |wire: &Wire<Script>, id| wire.node(id).unwrap().received().len();
    assert_eq!([sender, taker, other, deaf].map(|id| heard(&wire, id)), [0, 1, 0, 0]);

    wire.set_filters(taker, &[]);
    wire.set_filters(deaf, &[Filter::ALL]);
    wire.node_mut(sender).unwrap().send(millis(1), frame("3C5#02"));
    events(&mut wire, millis(2));
    assert_eq!([sender, taker, other, deaf].map(|id| heard(&wire, id)), [0, 1, 0, 1]);
}

#[test]
fn more_stations_than_fit_one_word_all_hear() {
    let mut wire = wire();
    let listeners: Vec<_> = (0..200)
        .map(|number| wire.attach(number.to_string(), Script::new(), &[Filter::ALL], false))
        .collect();
    wire.attach("sender", saying(millis(0), &["3C5#"]), &[], false);
    events(&mut wire, millis(1));
    assert!(listeners.iter().all(|&id| wire.node(id).unwrap().received().len() == 1));
}

#[test]
fn a_conversation_reads_as_a_candump_log() {
    let mut wire = wire();
    wire.attach("scanner", saying(millis(2), &["42D#"]), &[Filter::ALL], true);
    wire.attach("encoder", saying(millis(3), &["3C5#00100000"]), &[Filter::ALL], true);
    let mut log = Vec::new();
    wire.run_until(millis(10), &mut |event| {
        if let Event::Frame { at, frame, .. } = event {
            log.push(candump_line(*at, "vcan0", frame));
        }
    });
    let poll = 2_000 + 2 * (frame_bits(&frame("42D#")) - 3);
    let response = 3_000 + 2 * (frame_bits(&frame("3C5#00100000")) - 3);
    assert_eq!(
        log,
        [
            format!("(0000000000.{poll:06}) vcan0 42D#"),
            format!("(0000000000.{response:06}) vcan0 3C5#00100000"),
        ]
    );
}

/// Always has something to say, and says when it was asked.
struct Chatterbox {
    identifier: u16,
    asked: Vec<Instant>,
}

impl Station for Chatterbox {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _now: Instant, _input: Input<'_>) {}

    fn advance(&mut self, _now: Instant) {}

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        self.asked.push(now);
        Some(Frame::standard(self.identifier, &[]))
    }

    fn deadline(&self) -> Option<Instant> {
        Some(Instant::ZERO)
    }
}

#[test]
fn a_station_is_asked_only_when_its_mailbox_is_empty_and_the_wire_idle() {
    let mut wire = Wire::new(BitRate::Kbit500, 1);
    let chatterbox = |identifier| Chatterbox { identifier, asked: Vec::new() };
    let loud = wire.attach("loud", chatterbox(1), &[], true);
    let quiet = wire.attach("quiet", chatterbox(2), &[], true);
    let events = events(&mut wire, millis(100));
    assert!(violations(&events).is_empty());
    assert!(frames(&events).iter().all(|frame| frame == "001#"));
    assert_eq!(wire.node(quiet).unwrap().asked, [Instant::ZERO], "its first frame still waits");
    let bit = Duration::from_micros(2);
    let idle: Vec<Instant> = events.iter().map(|event| event.at() + bit.times(3)).collect();
    let asked = &wire.node(loud).unwrap().asked;
    assert_eq!(asked[1..=idle.len()], idle, "asked at each end of the interframe space");
}

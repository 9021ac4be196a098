//! The RS-485 line as its users see it, situation by situation.

mod collisions;
mod deadlines;
mod delivery;
mod echo;
mod faults;
mod police;
mod power;
mod rates;
mod timing;
#[allow(unreachable_pub, reason = "shared with the benchmark")]
mod toys;
mod troubled;
mod wiring;

use codewheel_sim::rs485::{
    Attachment, Event, Heard, Hearing, Node, NodeId, Script, Wire, parse_telegram,
};
use codewheel_station::rs485::{BaudRate, Transmission};
use codewheel_station::{Duration, Instant};

/// Most situations take place at 1.5M, where a character lasts 7334 ns.
const RATE: BaudRate = BaudRate::Mbit1_5;
/// FDL status asked by master 2 of station 7, six characters.
const ASK_7: &str = "10 07 02 49 52 16";
/// What station 7 answers, six characters.
const ANSWER_OF_7: &str = "10 02 07 00 09 16";

fn telegram(text: &str) -> Transmission {
    parse_telegram(text).unwrap()
}

fn octets(text: &str) -> Vec<u8> {
    telegram(text).octets().to_vec()
}

fn micros(micros: u64) -> Instant {
    Instant::ZERO + Duration::from_micros(micros)
}

fn millis(millis: u64) -> Instant {
    micros(millis * 1_000)
}

/// `bits` after `from` at [`RATE`].
fn bits_after(from: Instant, bits: u32) -> Instant {
    from + RATE.bits(bits)
}

fn listener() -> Script {
    Script::new(RATE)
}

/// A station that says `text` at `at`.
fn saying(at: Instant, text: &str) -> Script {
    listener().sending(at, telegram(text))
}

fn by_telegrams() -> Attachment {
    Attachment { hearing: Hearing::Telegrams, ..Attachment::default() }
}

/// A line of hand-played stations, each under its name.
fn line<const N: usize>(scripts: [(&str, Script); N]) -> (Wire<Script>, [NodeId; N]) {
    let mut wire = Wire::new(1);
    let ids = scripts.map(|(name, script)| wire.attach(name, script, Attachment::default()));
    (wire, ids)
}

/// Runs the wire and collects what happened.
fn events<N: Node>(wire: &mut Wire<N>, until: Instant) -> Vec<Event> {
    let mut events = Vec::new();
    wire.run_until(until, &mut |event| events.push(event.clone()));
    events
}

/// The telegrams that went over the line, with begin and end.
fn telegrams(events: &[Event]) -> Vec<(Instant, Instant, String)> {
    let telegram = |event: &Event| match event {
        Event::Telegram { octets, begin, end, .. } => Some((*begin, *end, format!("{octets:?}"))),
        _ => None,
    };
    events.iter().filter_map(telegram).collect()
}

/// The violations, each as the name of the station and what it did.
fn violations(events: &[Event]) -> Vec<String> {
    let violation = |event: &Event| match event {
        Event::Violation { station, rule, .. } => Some(format!("{station} {rule}")),
        _ => None,
    };
    events.iter().filter_map(violation).collect()
}

/// How many broken characters a station has heard.
fn broken(script: &Script) -> usize {
    script.heard().iter().filter(|(_, heard)| *heard == Heard::Broken).count()
}

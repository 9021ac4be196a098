//! Several stations that share one port, and hear each other.

use std::collections::VecDeque;

use codewheel_sim::can::Node;
use codewheel_station::can::{Frame, Identifier, Input};
use codewheel_station::{Instant, Station, earlier};

use crate::seats::Seats;

/// Frames remembered until they are reported as sent.
const ON_THE_WAY: usize = 64;

/// Several stations as one: what the medium brings reaches all of them, and of what they want to
/// say the lowest identifier goes first, as on a wire.
///
/// Each hears the others at the moment their frame is handed over, not when it is reported as sent:
/// a port may take a tenth of a second for that, and their answers do not wait so long.
#[derive(Debug)]
pub(crate) struct Composite<S> {
    seats: Seats<Seat<S>>,
    /// Frames handed over and not reported as sent, oldest first, with the place of their sender.
    on_the_way: VecDeque<(Frame, usize)>,
}

#[derive(Debug)]
struct Seat<S> {
    station: S,
    /// What it said last and has not been handed over.
    mailbox: Option<Frame>,
    /// Until then its controller is off the bus.
    off_until: Option<Instant>,
}

impl<S: Node> Composite<S> {
    pub(crate) const fn new() -> Self {
        Self { seats: Seats::new(), on_the_way: VecDeque::new() }
    }

    /// Puts a station on `place`.
    pub(crate) fn put(&mut self, place: usize, station: S) {
        self.seats.put(place, Seat { station, mailbox: None, off_until: None });
    }

    /// Takes the station from `place`; what it was about to say is gone.
    pub(crate) fn take(&mut self, place: usize) -> Option<S> {
        self.on_the_way.retain(|(_, sender)| *sender != place);
        Some(self.seats.take(place)?.station)
    }

    pub(crate) fn station(&self, place: usize) -> Option<&S> {
        self.seats.get(place).map(|seat| &seat.station)
    }

    pub(crate) fn station_mut(&mut self, place: usize) -> Option<&mut S> {
        self.seats.get_mut(place).map(|seat| &mut seat.station)
    }

    /// Lets the controller of one station leave the bus until `until`.
    pub(crate) fn bus_off(&mut self, place: usize, now: Instant, until: Instant) {
        let Some(seat) = self.seats.get_mut(place) else { return };
        if seat.off_until.is_none() {
            seat.off_until = Some(until);
            seat.mailbox = None;
            seat.station.handle(now, Input::BusOff);
            self.on_the_way.retain(|(_, sender)| *sender != place);
        }
    }

    /// Those that take part, with their places.
    fn present(&mut self) -> impl Iterator<Item = (usize, &mut Seat<S>)> {
        self.seats.iter_mut().filter(|(_, seat)| seat.off_until.is_none())
    }

    fn sent(&mut self, now: Instant, frame: &Frame) {
        let place = self.on_the_way.iter().position(|(sent, _)| sent == frame);
        if let Some((_, sender)) = place.and_then(|place| self.on_the_way.remove(place)) {
            self.tell(now, sender, Input::Sent(frame));
        }
    }

    fn tell(&mut self, now: Instant, place: usize, input: Input<'_>) {
        if let Some(station) = self.station_mut(place) {
            station.handle(now, input);
        }
    }
}

impl<S: Node> Station for Composite<S> {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        match input {
            Input::Sent(frame) => self.sent(now, frame),
            Input::Frame(_) | Input::Recovered => {
                self.present().for_each(|(_, seat)| seat.station.handle(now, input));
            }
            Input::Attached => {
                self.seats.iter_mut().for_each(|(_, seat)| seat.station.handle(now, input));
            }
            Input::Detached => {
                self.on_the_way.clear();
                for (_, seat) in self.seats.iter_mut() {
                    seat.mailbox = None;
                    seat.station.handle(now, input);
                }
            }
            Input::BusOff => {
                self.on_the_way.clear();
                for (_, seat) in self.present() {
                    seat.mailbox = None;
                    seat.station.handle(now, input);
                }
            }
        }
    }

    fn advance(&mut self, now: Instant) {
        for (_, seat) in self.seats.iter_mut() {
            if seat.off_until.take_if(|until| *until <= now).is_some() {
                seat.station.handle(now, Input::Recovered);
            }
            seat.station.advance(now);
        }
    }

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        for (_, seat) in self.present() {
            if seat.mailbox.is_none() {
                seat.mailbox = seat.station.transmit(now);
            }
        }
        let rank = |seat: &Seat<S>| {
            seat.mailbox.map(|frame| (arbitration_order(frame.identifier()), frame.is_remote()))
        };
        let waiting = self.present().filter_map(|(place, seat)| Some((rank(seat)?, place)));
        let (_, sender) = waiting.min()?;
        let frame = self.seats.get_mut(sender)?.mailbox.take()?;
        for (place, seat) in self.present() {
            if place != sender {
                seat.station.handle(now, Input::Frame(&frame));
            }
        }
        if self.on_the_way.len() == ON_THE_WAY
            && let Some((oldest, sender)) = self.on_the_way.pop_front()
        {
            self.tell(now, sender, Input::Sent(&oldest));
        }
        self.on_the_way.push_back((frame, sender));
        Some(frame)
    }

    fn deadline(&self) -> Option<Instant> {
        self.seats.iter().fold(None, |least, seat| {
            earlier(least, earlier(seat.station.deadline(), seat.off_until))
        })
    }
}

/// The order of arbitration: the first eleven bits, then standard before extended.
const fn arbitration_order(identifier: Identifier) -> (u32, bool, u32) {
    match identifier {
        Identifier::Standard(bits) => (bits as u32, false, 0),
        Identifier::Extended(bits) => (bits >> 18, true, bits & 0x3_FFFF),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_sim::can::{Script, parse_frame};
    use codewheel_station::Duration;

    fn millis(millis: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(millis)
    }

    fn saying(texts: &[&str]) -> Script {
        let frame = |text: &&str| parse_frame(text).unwrap();
        texts
            .iter()
            .map(frame)
            .fold(Script::new(), |script, frame| script.sending(Instant::ZERO, frame))
    }

    fn three() -> Composite<Script> {
        let mut composite = Composite::new();
        composite.put(0, saying(&["3C7#07", "3C7#70"]));
        composite.put(2, saying(&["3C5#05"]));
        composite.put(5, saying(&["42D#"]));
        composite
    }

    fn all(composite: &mut Composite<Script>, now: Instant) -> Vec<Frame> {
        std::iter::from_fn(|| composite.transmit(now)).collect()
    }

    fn heard(composite: &Composite<Script>, place: usize) -> Vec<String> {
        let received = composite.station(place).unwrap().received();
        received.iter().map(|(_, frame)| frame.to_string()).collect()
    }

    #[test]
    fn the_lowest_identifier_goes_first_and_the_others_hear_it_at_once() {
        let mut composite = three();
        let sent: Vec<_> = all(&mut composite, millis(1)).iter().map(ToString::to_string).collect();
        assert_eq!(sent, ["3C5#05", "3C7#07", "3C7#70", "42D#"]);
        assert_eq!(heard(&composite, 0), ["3C5#05", "42D#"]);
        assert_eq!(heard(&composite, 2), ["3C7#07", "3C7#70", "42D#"]);
        assert_eq!(heard(&composite, 5), ["3C5#05", "3C7#07", "3C7#70"]);
    }

    #[test]
    fn who_sent_a_frame_is_told_so_and_nobody_else() {
        let mut composite = three();
        for frame in all(&mut composite, millis(1)) {
            composite.handle(millis(2), Input::Sent(&frame));
        }
        let sent = |place: usize| composite.station(place).unwrap().sent().len();
        assert_eq!([sent(0), sent(2), sent(5)], [2, 1, 1]);
        let stranger = parse_frame("3C5#05").unwrap();
        composite.handle(millis(3), Input::Sent(&stranger));
        assert_eq!(composite.station(2).unwrap().sent().len(), 1, "it was told once");
    }

    #[test]
    fn what_the_medium_brings_reaches_all() {
        let mut composite = three();
        let frame = parse_frame("42F#00").unwrap();
        composite.handle(millis(1), Input::Frame(&frame));
        for place in [0, 2, 5] {
            assert_eq!(heard(&composite, place), ["42F#00"]);
        }
    }

    #[test]
    fn a_station_off_the_bus_or_taken_away_is_deaf_and_mute_until_it_is_back() {
        let mut composite = three();
        composite.bus_off(2, millis(1), millis(4));
        let away = composite.take(5).unwrap();
        assert_eq!(composite.deadline(), Some(millis(0)));
        assert_eq!(all(&mut composite, millis(1)).len(), 2);
        assert!(heard(&composite, 2).is_empty());
        composite.advance(millis(4));
        assert_eq!(all(&mut composite, millis(4)).len(), 1);
        composite.put(5, away);
        assert_eq!(all(&mut composite, millis(5)).len(), 1);
        assert_eq!(heard(&composite, 2), ["42D#"]);
        assert!(composite.station(1).is_none() && composite.take(9).is_none());
    }

    #[test]
    fn a_frame_forgotten_after_64_others_counts_as_sent() {
        let mut composite = Composite::new();
        let texts: Vec<String> = (0..100).map(|count| format!("3C5#{count:02X}")).collect();
        composite.put(0, saying(&texts.iter().map(String::as_str).collect::<Vec<_>>()));
        assert_eq!(all(&mut composite, millis(1)).len(), 100);
        assert_eq!(composite.station(0).unwrap().sent().len(), 36);
    }
}

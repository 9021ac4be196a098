//! Several stations that share one RS-485 port, and hear each other.

use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Instant, Station, earlier};

use crate::seats::Seats;

/// Several stations as one: what the line brings reaches all of them, and one of them speaks at a
/// time, for as long as its telegram takes at the rate of the line.
///
/// The others hear it at its end, as on a wire: a master counts its pauses from there. Where
/// something comes from outside before that, whoever sent it has heard the telegram already, so the
/// others hear it first.
#[derive(Debug)]
pub(crate) struct Composite<S> {
    rate: BaudRate,
    seats: Seats<S>,
    speaking: Option<Speaking>,
    /// What fell due before had its turn.
    advanced_at: Instant,
}

#[derive(Debug)]
struct Speaking {
    place: usize,
    octets: Transmission,
    ends: Instant,
}

impl<S: Node> Composite<S> {
    pub(crate) const fn new(rate: BaudRate) -> Self {
        Self { rate, seats: Seats::new(), speaking: None, advanced_at: Instant::ZERO }
    }

    /// Puts a station on `place`.
    pub(crate) fn put(&mut self, place: usize, station: S) {
        self.seats.put(place, station);
    }

    /// Takes the station from `place`.
    pub(crate) fn take(&mut self, place: usize) -> Option<S> {
        self.seats.take(place)
    }

    pub(crate) fn station(&self, place: usize) -> Option<&S> {
        self.seats.get(place)
    }

    pub(crate) fn station_mut(&mut self, place: usize) -> Option<&mut S> {
        self.seats.get_mut(place)
    }

    /// Lets the others hear what was said.
    fn hear(&mut self, now: Instant, said: Speaking) {
        for (place, station) in self.seats.iter_mut() {
            if place != said.place {
                station.handle(now, Input::Octets(said.octets.octets()));
            }
        }
    }
}

impl<S: Node> Station for Composite<S> {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        if let Some(said) = self.speaking.take() {
            self.hear(now, said);
        }
        for (_, station) in self.seats.iter_mut() {
            station.handle(now, input);
        }
    }

    fn advance(&mut self, now: Instant) {
        self.advanced_at = now;
        if let Some(said) = self.speaking.take_if(|said| said.ends <= now) {
            self.hear(now, said);
        }
        for (_, station) in self.seats.iter_mut() {
            station.advance(now);
        }
    }

    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        if self.speaking.is_some() {
            return None;
        }
        let mut stations = self.seats.iter_mut();
        let (place, octets) =
            stations.find_map(|(place, station)| Some((place, station.transmit(now)?)))?;
        let ends = now + self.rate.characters(octets.octets().len() as u32);
        self.speaking = Some(Speaking { place, octets, ends });
        Some(octets)
    }

    fn deadline(&self) -> Option<Instant> {
        let due = self.seats.iter().filter_map(Station::deadline);
        match &self.speaking {
            None => due.min(),
            // Who is overdue waits for the line.
            Some(said) => earlier(Some(said.ends), due.filter(|due| *due > self.advanced_at).min()),
        }
    }
}

impl<S: Node> Node for Composite<S> {
    fn baud_rate(&self) -> BaudRate {
        self.seats.iter().next().map_or(self.rate, Node::baud_rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_sim::rs485::{Script, parse_telegram};
    use codewheel_station::Duration;

    const RATE: BaudRate = BaudRate::Kbit500;

    fn micros(micros: u64) -> Instant {
        Instant::ZERO + Duration::from_micros(micros)
    }

    fn saying(at: Instant, text: &str) -> Script {
        Script::new(RATE).sending(at, parse_telegram(text).unwrap())
    }

    fn heard(composite: &Composite<Script>, place: usize) -> Vec<u8> {
        composite.station(place).unwrap().octets()
    }

    #[test]
    fn one_speaks_at_a_time_and_the_others_hear_it_at_its_end() {
        let mut composite = Composite::new(RATE);
        composite.put(0, saying(micros(0), "DC 03 02"));
        composite.put(1, saying(micros(10), "E5"));
        composite.advance(micros(0));
        assert_eq!(composite.transmit(micros(0)).unwrap().octets(), [0xDC, 3, 2]);
        composite.advance(micros(10));
        assert_eq!(composite.transmit(micros(10)), None, "the line is busy");
        assert_eq!(composite.deadline(), Some(micros(66)), "three characters of 22 µs");
        composite.advance(micros(66));
        assert_eq!(heard(&composite, 1), [0xDC, 3, 2]);
        assert_eq!(composite.transmit(micros(66)).unwrap().octets(), [0xE5]);
        assert!(heard(&composite, 0).is_empty());
    }

    #[test]
    fn what_comes_from_outside_is_heard_after_what_was_said_before() {
        let mut composite = Composite::new(RATE);
        composite.put(0, saying(micros(0), "E5"));
        composite.put(3, Script::new(RATE));
        composite.advance(micros(0));
        assert!(composite.transmit(micros(0)).is_some());
        composite.handle(micros(1), Input::Octets(&[0x10, 0x07]));
        assert_eq!(heard(&composite, 0), [0x10, 0x07]);
        assert_eq!(heard(&composite, 3), [0xE5, 0x10, 0x07]);
    }
}

//! A line on which octets take no time.

use codewheel_station::rs485::{BaudRate, Input, Node, TRANSMISSION_OCTETS, Transmission};
use codewheel_station::{Instant, Station, earlier};

/// Octets that wait for the end of the own telegram; a peer that sends more than a few telegrams in
/// that time does not follow the bus.
const EARLY: usize = 4 * TRANSMISSION_OCTETS;

/// A station on a line that may carry octets faster than its rate says.
///
/// Over TCP and on a pty octets take no time, so a slave may have answered a request that by the rate
/// of the line is still being sent. What comes before the own telegram ends, the station hears at its
/// end.
#[derive(Debug)]
pub struct Timeless<N> {
    station: N,
    speaks_until: Instant,
    early: Vec<u8>,
}

impl<N: Node> Timeless<N> {
    /// `station` on such a line.
    #[must_use]
    pub const fn new(station: N) -> Self {
        Self { station, speaks_until: Instant::ZERO, early: Vec::new() }
    }

    /// The station.
    #[must_use]
    pub const fn station(&self) -> &N {
        &self.station
    }

    /// The station, to be changed.
    pub const fn station_mut(&mut self) -> &mut N {
        &mut self.station
    }

    /// When the last telegram ends that the station has sent.
    #[must_use]
    pub const fn speaks_until(&self) -> Instant {
        self.speaks_until
    }

    /// Hears what came while it spoke.
    fn catch_up(&mut self, now: Instant) {
        if !self.early.is_empty() && self.speaks_until <= now {
            let early = std::mem::take(&mut self.early);
            self.station.handle(now, Input::Octets(&early));
        }
    }
}

impl<N: Node> Station for Timeless<N> {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        match input {
            Input::Octets(octets) if now < self.speaks_until => {
                let room = EARLY.saturating_sub(self.early.len()).min(octets.len());
                self.early.extend_from_slice(octets.get(..room).unwrap_or_default());
            }
            input => {
                self.catch_up(now);
                self.station.handle(now, input);
            }
        }
    }

    fn advance(&mut self, now: Instant) {
        self.catch_up(now);
        self.station.advance(now);
    }

    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        let telegram = self.station.transmit(now)?;
        let characters = u32::try_from(telegram.octets().len()).unwrap_or(u32::MAX);
        self.speaks_until = now + self.station.baud_rate().characters(characters);
        Some(telegram)
    }

    fn deadline(&self) -> Option<Instant> {
        let early = (!self.early.is_empty()).then_some(self.speaks_until);
        earlier(early, self.station.deadline())
    }
}

impl<N: Node> Node for Timeless<N> {
    fn baud_rate(&self) -> BaudRate {
        self.station.baud_rate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_station::Duration;

    /// Says a token at once, and notes when it heard what.
    #[derive(Debug, Default)]
    struct Toy {
        said: bool,
        heard: Vec<(Instant, Vec<u8>)>,
    }

    impl Station for Toy {
        type Input<'a> = Input<'a>;
        type Output = Transmission;

        fn handle(&mut self, now: Instant, input: Input<'_>) {
            if let Input::Octets(octets) = input {
                self.heard.push((now, octets.to_vec()));
            }
        }

        fn advance(&mut self, _: Instant) {}

        fn transmit(&mut self, _: Instant) -> Option<Transmission> {
            let is_first = !std::mem::replace(&mut self.said, true);
            is_first.then(|| Transmission::new(&[0xDC, 2, 2])).flatten()
        }

        fn deadline(&self) -> Option<Instant> {
            None
        }
    }

    impl Node for Toy {
        fn baud_rate(&self) -> BaudRate {
            BaudRate::Kbit500
        }
    }

    /// Three characters at 500k last 66 µs.
    #[test]
    fn what_comes_while_it_speaks_is_heard_at_the_end_of_its_telegram() {
        let at = |micros| Instant::ZERO + Duration::from_micros(micros);
        let mut line = Timeless::new(Toy::default());
        assert!(line.transmit(at(0)).is_some());
        assert_eq!((line.speaks_until(), line.deadline()), (at(66), None));
        line.handle(at(10), Input::Octets(&[0x10, 0x07]));
        line.handle(at(20), Input::Octets(&[0x02]));
        line.advance(at(65));
        assert!(line.station().heard.is_empty());
        assert_eq!(line.deadline(), Some(at(66)));
        line.advance(at(66));
        line.handle(at(70), Input::Octets(&[0x00]));
        assert_eq!(line.station().heard, [(at(66), vec![0x10, 7, 2]), (at(70), vec![0])]);
        assert_eq!(line.deadline(), None);
    }

    #[test]
    fn a_peer_that_never_stops_fills_no_more_than_its_room() {
        let mut line = Timeless::new(Toy::default());
        assert!(line.transmit(Instant::ZERO).is_some());
        for _ in 0..100 {
            line.handle(Instant::ZERO, Input::Octets(&[0x55; 100]));
        }
        line.advance(line.speaks_until());
        assert_eq!(
            line.station().heard.iter().map(|(_, octets)| octets.len()).sum::<usize>(),
            EARLY
        );
    }
}

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

//! A master that only speaks: it sends its requests in turn, whatever is answered, and admits nobody.

use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Duration, Instant, Station};

pub(crate) struct Speaker {
    rate: BaudRate,
    /// What it says in turn, and the pause before the next.
    says: Vec<(Vec<u8>, Duration)>,
    place: usize,
    at: Instant,
}

impl Speaker {
    pub(crate) fn new(rate: BaudRate, says: Vec<(Vec<u8>, Duration)>) -> Self {
        Self { rate, says, place: 0, at: Instant::ZERO }
    }
}

/// Slave_Diag of a slave, from master 2.
pub(crate) fn slave_diag(of: u8) -> Vec<u8> {
    let sum =
        [of | 0x80, 0x82, 0x6D, 0x3C, 0x3E].iter().fold(0, |sum: u8, it| sum.wrapping_add(*it));
    vec![0x68, 5, 5, 0x68, of | 0x80, 0x82, 0x6D, 0x3C, 0x3E, sum, 0x16]
}

/// FDL status of a station, from master 2.
pub(crate) fn fdl_status(of: u8) -> Vec<u8> {
    vec![0x10, of, 2, 0x49, of.wrapping_add(0x4B), 0x16]
}

/// The token that master 2 alone hands to itself.
pub(crate) const TOKEN: [u8; 3] = [0xDC, 2, 2];

impl Station for Speaker {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, _: Instant, _: Input<'_>) {}

    fn advance(&mut self, _: Instant) {}

    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        if now < self.at {
            return None;
        }
        let (octets, pause) = self.says.get(self.place)?;
        self.at = now + *pause;
        self.place = (self.place + 1) % self.says.len();
        Transmission::new(octets)
    }

    fn deadline(&self) -> Option<Instant> {
        (!self.says.is_empty()).then_some(self.at)
    }
}

impl Node for Speaker {
    fn baud_rate(&self) -> BaudRate {
        self.rate
    }
}

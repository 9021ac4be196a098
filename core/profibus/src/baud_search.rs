//! The search for the rate of the line.
//!
//! Decision: from 12 Mbit/s down, each rate for 50 ms and 3000 bits, then round again, about 1.1 s
//! in all. One error-free telegram with a checksum, to whatever station, is proof; ten such spans
//! without one, and the rate is lost.

use codewheel_station::rs485::BaudRate;
use codewheel_station::{Deadline, Duration, Instant};

use crate::Baud;

/// How many dwells without a telegram a found rate outlasts.
const PATIENCE: u64 = 10;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Given,
    /// The first dwell begins with the first call.
    NotBegun,
    Trying,
    Found,
}

/// What [`BaudSearch::advance`] did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// Another rate is tried.
    Next,
    /// The rate was lost; the search begins again.
    Lost,
}

/// The rate in force, and how it came to be.
#[derive(Clone, Debug)]
pub(crate) struct BaudSearch {
    stage: Stage,
    rate: BaudRate,
    /// How long the rate, once found, outlasts its last telegram.
    patience: Duration,
    /// When this dwell, or all patience, ends; the origin of time before the first call.
    until: Deadline,
}

impl BaudSearch {
    pub(crate) fn new(baud: Baud) -> Self {
        match baud {
            Baud::Search => Self {
                stage: Stage::NotBegun,
                rate: BaudRate::Mbit12,
                patience: patience(BaudRate::Mbit12),
                until: Deadline::at(Instant::ZERO),
            },
            Baud::Fixed(rate) => {
                Self { stage: Stage::Given, rate, patience: patience(rate), until: Deadline::NEVER }
            }
        }
    }

    pub(crate) const fn rate(&self) -> BaudRate {
        self.rate
    }

    /// Whether the rate is given or has been found.
    pub(crate) const fn is_settled(&self) -> bool {
        matches!(self.stage, Stage::Given | Stage::Found)
    }

    /// An error-free SD1, SD2 or SD3 came. Says whether the rate is found by it.
    #[inline]
    pub(crate) fn heard(&mut self, now: Instant) -> bool {
        if self.stage == Stage::Given {
            return false;
        }
        self.until = Deadline::at(now + self.patience);
        let found = !self.is_settled();
        if found {
            self.stage = Stage::Found;
        }
        found
    }

    #[inline]
    pub(crate) fn advance(&mut self, now: Instant) -> Option<Change> {
        if self.until.is_due(now) { self.go_on(now) } else { None }
    }

    #[cold]
    fn go_on(&mut self, now: Instant) -> Option<Change> {
        let (rate, change) = match self.stage {
            Stage::Given | Stage::NotBegun => (self.rate, None),
            Stage::Trying => (next(self.rate), Some(Change::Next)),
            Stage::Found => (BaudRate::Mbit12, Some(Change::Lost)),
        };
        self.rate = rate;
        self.patience = patience(rate);
        self.stage = Stage::Trying;
        self.until = Deadline::at(now + dwell(rate));
        change
    }

    /// When [`advance`](Self::advance) is to be called.
    pub(crate) const fn deadline(&self) -> Deadline {
        self.until
    }
}

fn dwell(rate: BaudRate) -> Duration {
    Duration::from_millis(50) + rate.bits(3_000)
}

fn patience(rate: BaudRate) -> Duration {
    dwell(rate).times(PATIENCE)
}

/// The rate below; below the lowest comes the highest.
fn next(rate: BaudRate) -> BaudRate {
    BaudRate::ALL.into_iter().rev().find(|lower| *lower < rate).unwrap_or(BaudRate::Mbit12)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_takes_about_eleven_hundred_milliseconds() {
        let round = BaudRate::ALL.iter().fold(Duration::ZERO, |sum, rate| sum + dwell(*rate));
        assert!((1_000..1_200).contains(&round.as_millis()), "{round}");
    }

    #[test]
    fn the_rates_follow_each_other_downwards_and_round_again() {
        let mut rate = BaudRate::Mbit12;
        for lower in BaudRate::ALL.into_iter().rev().skip(1) {
            rate = next(rate);
            assert_eq!(rate, lower);
        }
        assert_eq!(next(rate), BaudRate::Mbit12);
    }
}

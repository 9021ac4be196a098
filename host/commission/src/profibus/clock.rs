//! The time that profirust sees.

use codewheel_station::Instant;
use codewheel_station::rs485::BaudRate;
use profirust::Baudrate;

/// Ticks that a bit lasts.
const TICKS_PER_BIT: u64 = 32;

/// Translates the time of the station into the time that profirust sees.
///
/// profirust counts whole microseconds and rounds every span of bits down to them: at 12 Mbit/s,
/// where a microsecond is twelve bits, that leaves 25 idle bits where 33 are due. But it knows
/// microseconds by their name alone. Told that the rate is 31.25 kbit/s, which no rate of
/// PROFIBUS-DP is, it takes a bit for exactly 32 of them; given a clock that ticks 32 times in a
/// bit of the real rate, all its spans are exact at every rate. A tick is 2.6 ns at 12 Mbit/s and
/// 3.3 µs at 9.6 kbit/s.
///
/// Nothing else in profirust depends on absolute time: the watchdog of the slaves is a pair of
/// factors that were worked out before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    baud_rate: BaudRate,
}

/// A moment in ticks. A span of `n` bits is `n * 32` of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Tick(u64);

impl Clock {
    /// The rate that profirust is told.
    pub(super) const TOLD: Baudrate = Baudrate::B31250;

    pub(super) const fn new(baud_rate: BaudRate) -> Self {
        Self { baud_rate }
    }

    const fn ticks_per_second(self) -> u128 {
        self.baud_rate.bits_per_second() as u128 * TICKS_PER_BIT as u128
    }

    /// The tick that `now` lies in. Rounding down keeps the order, so that time never goes back.
    pub(super) fn tick(self, now: Instant) -> Tick {
        let ticks = u128::from(now.as_nanos()) * self.ticks_per_second() / 1_000_000_000;
        Tick(u64::try_from(ticks).unwrap_or(u64::MAX))
    }

    /// The first nanosecond of `tick`.
    pub(super) fn instant(self, tick: Tick) -> Instant {
        let nanos = (u128::from(tick.0) * 1_000_000_000).div_ceil(self.ticks_per_second());
        Instant::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
    }
}

impl Tick {
    /// `bits` bits later.
    pub(super) const fn after_bits(self, bits: u32) -> Self {
        Self(self.0.saturating_add(bits as u64 * TICKS_PER_BIT))
    }

    /// The next tick.
    pub(super) const fn next(self) -> Self {
        Self(self.0.saturating_add(1))
    }

    /// As profirust wants it.
    pub(super) fn time(self) -> profirust::time::Instant {
        profirust::time::Instant::from_micros(i64::try_from(self.0).unwrap_or(i64::MAX))
    }

    /// From what profirust hands back.
    pub(super) fn from_time(time: profirust::time::Instant) -> Self {
        Self(u64::try_from(time.total_micros()).unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_of_bits_is_exact_for_profirust_at_every_rate() {
        for bits in [1, 11, 33, 100, 1_000, 16_383, 630_000] {
            let span = Clock::TOLD.bits_to_time(bits).total_micros();
            assert_eq!(Tick(0).after_bits(bits), Tick(span));
        }
    }

    #[test]
    fn an_instant_lies_in_the_tick_it_begins_and_no_nanosecond_earlier() {
        for rate in BaudRate::ALL {
            let clock = Clock::new(rate);
            for tick in [1, 2, 3, 1_056, 999_999_999, 307_200 * 86_400 * 365] {
                let begins = clock.instant(Tick(tick));
                assert_eq!(clock.tick(begins), Tick(tick), "{rate}");
                let before = Instant::from_nanos(begins.as_nanos() - 1);
                assert_eq!(clock.tick(before), Tick(tick - 1), "{rate}");
            }
        }
    }
}

//! From octets and pauses to telegrams.

use codewheel_station::rs485::{BaudRate, CHARACTER_BITS, TRANSMISSION_OCTETS};
use codewheel_station::{Duration, Instant};

use crate::Timing;
use crate::telegram::{Telegram, length_of};

/// A port that knows no bit times gives a telegram up after so long without an octet. The standard
/// says 33 bits; at every rate that is less, which a test holds.
const ABANDONED_AFTER: Duration = Duration::from_millis(50);
/// Such a port takes a pause this long for an idle line, or 33 bits where they last longer.
const QUIET: Duration = Duration::from_millis(1);

/// The half bits of a character.
const CHARACTER_HALF_BITS: u64 = 2 * CHARACTER_BITS as u64;

/// What octets turned out to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Received {
    /// The beginning of a telegram.
    More,
    /// No telegram, and the first to show it: what follows is dropped up to the next pause.
    Broken,
    /// Octets behind a broken telegram.
    Dropped,
    /// The end of a telegram: [`Receiver::pieced`] has all of it.
    Telegram,
}

/// Puts telegrams together. A broken one is dropped with all that follows until the line is idle:
/// to look for the next start delimiter inside of it would take payload for a telegram.
#[derive(Clone, Debug)]
pub(crate) struct Receiver {
    timing: Timing,
    /// Everything is dropped until the line is idle.
    dropping: bool,
    /// The line was idle before the octet that comes next, or before the telegram begun.
    after_idle: bool,
    /// When the last octet ended; `None` before the first one.
    last: Option<Instant>,
    /// Since when everything is dropped.
    dropping_since: Instant,
    /// It has been dropping for so long that the next telegram may come without a pause.
    impatient: bool,
    filled: u8,
    buffer: [u8; TRANSMISSION_OCTETS],
}

impl Receiver {
    pub(crate) const fn new(timing: Timing) -> Self {
        Self {
            timing,
            dropping: false,
            after_idle: true,
            last: None,
            dropping_since: Instant::ZERO,
            impatient: false,
            filled: 0,
            buffer: [0; TRANSMISSION_OCTETS],
        }
    }

    /// Drops everything until the line is idle. A character with an error ended at `now`, or the
    /// rate is another from now on, and what comes next may be the middle of a telegram.
    pub(crate) fn drop_until_idle(&mut self, now: Instant) {
        self.filled = 0;
        self.begin_dropping(now);
        self.last = Some(now);
    }

    fn begin_dropping(&mut self, now: Instant) {
        if !self.dropping {
            self.dropping = true;
            self.dropping_since = now;
            self.impatient = false;
        }
    }

    /// Judges the pause before `count` octets that end at `now`; [`take`](Self::take) them next.
    /// Says whether a telegram begun before was abandoned.
    #[inline]
    pub(crate) fn arrive(&mut self, now: Instant, count: usize, rate: BaudRate) -> bool {
        let Some(last) = self.last.replace(now) else { return false };
        match self.timing {
            Timing::Exact => self.arrive_exactly(now, count, rate, last),
            Timing::Coarse => {
                if !self.dropping && self.filled == 0 {
                    return false;
                }
                let pause = now.since(last);
                // Over TCP and in a pty octets take no time, so what they would take on a line is not
                // taken off: the slave cannot tell, and after 50 ms it is impatient in any case.
                let abandoned = self.filled > 0 && pause >= ABANDONED_AFTER;
                if abandoned {
                    self.filled = 0;
                }
                if pause >= QUIET.max(rate.bits(33)) {
                    self.dropping = false;
                }
                self.impatient = self.dropping && now.since(self.dropping_since) >= ABANDONED_AFTER;
                abandoned
            }
        }
    }

    /// Bits are counted to the nearest half, a UART does no better, and with what the clocks of two
    /// stations drift apart while octets come in one piece.
    #[inline]
    fn arrive_exactly(
        &mut self,
        now: Instant,
        count: usize,
        rate: BaudRate,
        last: Instant,
    ) -> bool {
        let span = now.since(last);
        let octets = u64::from(u32::try_from(count).unwrap_or(u32::MAX)) * CHARACTER_HALF_BITS;
        // Two clocks may differ by 0.3 % each.
        let drift = octets * 6 / 1_000;
        let idle = lasts(span, octets + 65 - drift.min(32), rate);
        let abandoned = self.filled > 0 && lasts(span, octets + 1 + drift, rate);
        if abandoned {
            self.filled = 0;
            self.begin_dropping(now);
        }
        if idle {
            self.dropping = false;
        }
        if self.filled == 0 {
            self.after_idle = idle;
        }
        abandoned
    }

    /// The telegram that lies whole at the beginning of `octets`; `None` where they are to be
    /// [taken](Self::take) one by one. Nothing is copied.
    #[inline]
    pub(crate) fn whole<'a>(&self, octets: &'a [u8]) -> Option<Telegram<'a>> {
        if self.dropping {
            return self.whole_at_last(octets);
        }
        if self.filled > 0 {
            return None;
        }
        Telegram::decode(octets).ok().flatten()
    }

    /// On a busy bus there may never be a pause of a millisecond. After 50 ms without one, a port that
    /// knows no bit times takes octets that are one telegram with a checksum from the first to the
    /// last (decision).
    #[cold]
    fn whole_at_last<'a>(&self, octets: &'a [u8]) -> Option<Telegram<'a>> {
        let telegram = Telegram::decode(octets).ok().flatten().filter(|_| self.impatient)?;
        let is_sure = matches!(telegram, Telegram::Data(_)) && telegram.length() == octets.len();
        is_sure.then_some(telegram)
    }

    /// Takes octets that [`arrive`](Self::arrive) announced, up to the end of the first telegram,
    /// and says how many that were.
    pub(crate) fn take(&mut self, octets: &[u8]) -> (usize, Received) {
        if self.dropping {
            return (octets.len(), Received::Dropped);
        }
        let mut used = 0;
        loop {
            let begun = self.pieced();
            let filled = begun.len();
            let length = match Telegram::decode(begun) {
                Ok(Some(_)) => return (used, Received::Telegram),
                Ok(None) => length_of(begun).unwrap_or_default(),
                Err(_) => {
                    self.filled = 0;
                    self.begin_dropping(self.last.unwrap_or_default());
                    return (octets.len(), Received::Broken);
                }
            };
            // As long as the length is not known, one by one: damage shows as early as in one piece.
            let wanted = length.map_or(1, |length| length.saturating_sub(filled));
            let rest = octets.get(used..).unwrap_or_default();
            if rest.is_empty() {
                return (used, Received::More);
            }
            let piece = rest.get(..wanted).unwrap_or(rest);
            self.append(piece);
            used += piece.len();
        }
    }

    /// The octets of the telegram that came in pieces.
    pub(crate) fn pieced(&self) -> &[u8] {
        self.buffer.get(..usize::from(self.filled)).unwrap_or_default()
    }

    /// A telegram was taken; the next one follows without a pause. Says whether the line was idle
    /// before this one, as long as a request demands.
    #[inline]
    pub(crate) fn end_telegram(&mut self) -> bool {
        self.filled = 0;
        self.dropping = false;
        let coarse = self.timing == Timing::Coarse;
        core::mem::replace(&mut self.after_idle, coarse)
    }

    fn append(&mut self, octets: &[u8]) {
        let begin = usize::from(self.filled);
        let end = begin.saturating_add(octets.len());
        if let (Some(room), Ok(filled)) = (self.buffer.get_mut(begin..end), u8::try_from(end)) {
            room.copy_from_slice(octets);
            self.filled = filled;
        }
    }
}

/// Whether `span` lasts `half_bits` half bits at `rate`. Nothing is divided: as many times as a
/// second has half bits, a half bit is a second.
#[inline]
fn lasts(span: Duration, half_bits: u64, rate: BaudRate) -> bool {
    let half_bits_per_second = 2 * u64::from(rate.bits_per_second());
    span.times(half_bits_per_second) >= Duration::from_secs(half_bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_bits_are_exact_at_every_rate() {
        for rate in BaudRate::ALL {
            for bits in [1, 33, 11 * 255 + 33] {
                let span = rate.bits(bits);
                assert!(lasts(span, 2 * u64::from(bits), rate), "{bits} bits at {rate}");
                let shorter = Duration::from_nanos(span.as_nanos() - 1);
                assert!(!lasts(shorter, 2 * u64::from(bits), rate), "{bits} bits at {rate}");
            }
        }
        assert!(lasts(Duration::from_nanos(u64::MAX), 1, BaudRate::Mbit12));
    }

    #[test]
    fn fifty_milliseconds_are_longer_than_thirty_three_bits_at_every_rate() {
        assert!(BaudRate::ALL.iter().all(|rate| rate.bits(33) < ABANDONED_AFTER));
    }
}

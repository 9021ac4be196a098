//! Points and spans of time as plain nanoseconds, handed in by whoever drives a station.

use core::fmt;
use core::ops::{Add, AddAssign, Sub};

/// A point in time: nanoseconds since an origin the driver chose, 0 … 2⁶⁴−1 (584 years).
///
/// Arithmetic saturates: a deadline too far to name is simply never reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Instant(u64);

/// A span of time in nanoseconds, 0 … 2⁶⁴−1. Arithmetic saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Duration(u64);

impl Instant {
    /// The origin.
    pub const ZERO: Self = Self(0);

    /// The point `nanos` nanoseconds after the origin.
    #[inline]
    #[must_use]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the origin.
    #[inline]
    #[must_use]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// The span from `earlier` to `self`; zero where `earlier` is later.
    #[inline]
    #[must_use]
    pub const fn since(self, earlier: Self) -> Duration {
        Duration(self.0.saturating_sub(earlier.0))
    }
}

impl Duration {
    /// No time at all.
    pub const ZERO: Self = Self(0);

    /// A span of `nanos` nanoseconds.
    #[inline]
    #[must_use]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// A span of `micros` microseconds.
    #[inline]
    #[must_use]
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros.saturating_mul(1_000))
    }

    /// A span of `millis` milliseconds.
    #[inline]
    #[must_use]
    pub const fn from_millis(millis: u64) -> Self {
        Self(millis.saturating_mul(1_000_000))
    }

    /// A span of `secs` seconds.
    #[inline]
    #[must_use]
    pub const fn from_secs(secs: u64) -> Self {
        Self(secs.saturating_mul(1_000_000_000))
    }

    /// The span in nanoseconds.
    #[inline]
    #[must_use]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// The span in whole milliseconds, rounded down.
    #[inline]
    #[must_use]
    pub const fn as_millis(self) -> u64 {
        self.0 / 1_000_000
    }

    /// `factor` times the span.
    #[inline]
    #[must_use]
    pub const fn times(self, factor: u64) -> Self {
        Self(self.0.saturating_mul(factor))
    }
}

/// A deadline, or none, in eight octets: what stations keep for each of their timers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Deadline(Instant);

impl Deadline {
    /// No deadline.
    pub const NEVER: Self = Self(Instant(u64::MAX));

    /// A deadline at `instant`.
    #[inline]
    #[must_use]
    pub const fn at(instant: Instant) -> Self {
        Self(instant)
    }

    /// Whether it has been reached. At the end of time, which is what [`NEVER`](Self::NEVER) means,
    /// nothing is.
    #[inline]
    #[must_use]
    pub const fn is_due(self, now: Instant) -> bool {
        // One comparison, and the sum is shared by all that are asked at the same time.
        self.0.0 < now.0.wrapping_add(1)
    }

    /// Whether there is none.
    #[inline]
    #[must_use]
    pub const fn is_never(self) -> bool {
        self.0.0 == u64::MAX
    }

    /// When it is; `None` for never.
    #[inline]
    #[must_use]
    pub const fn instant(self) -> Option<Instant> {
        if self.is_never() { None } else { Some(self.0) }
    }

    /// The earlier of the two.
    #[inline]
    #[must_use]
    pub fn or_earlier(self, other: Self) -> Self {
        self.min(other)
    }

    /// Takes the deadline away where it has been reached, and says whether it has.
    #[inline]
    pub fn take_due(&mut self, now: Instant) -> bool {
        let due = self.is_due(now);
        if due {
            *self = Self::NEVER;
        }
        due
    }
}

impl Default for Deadline {
    /// [`Deadline::NEVER`].
    #[inline]
    fn default() -> Self {
        Self::NEVER
    }
}

impl From<Option<Instant>> for Deadline {
    #[inline]
    fn from(instant: Option<Instant>) -> Self {
        instant.map_or(Self::NEVER, Self)
    }
}

/// The earlier of two deadlines, where `None` means never.
#[inline]
#[must_use]
pub fn earlier(a: Option<Instant>, b: Option<Instant>) -> Option<Instant> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

impl Add<Duration> for Instant {
    type Output = Self;
    #[inline]
    fn add(self, span: Duration) -> Self {
        Self(self.0.saturating_add(span.0))
    }
}

impl AddAssign<Duration> for Instant {
    #[inline]
    fn add_assign(&mut self, span: Duration) {
        *self = *self + span;
    }
}

impl Sub<Duration> for Instant {
    type Output = Self;
    #[inline]
    fn sub(self, span: Duration) -> Self {
        Self(self.0.saturating_sub(span.0))
    }
}

impl Add for Duration {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl From<core::time::Duration> for Duration {
    fn from(span: core::time::Duration) -> Self {
        Self(u64::try_from(span.as_nanos()).unwrap_or(u64::MAX))
    }
}

impl From<Duration> for core::time::Duration {
    fn from(span: Duration) -> Self {
        Self::from_nanos(span.0)
    }
}

impl fmt::Display for Instant {
    /// Seconds with six decimals, as candump prints them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:06}", self.0 / 1_000_000_000, self.0 / 1_000 % 1_000_000)
    }
}

impl fmt::Display for Duration {
    /// Seconds with six decimals.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Instant(self.0).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn a_deadline_too_far_to_name_saturates_instead_of_wrapping() {
        let never = Instant::from_nanos(u64::MAX - 1) + Duration::from_secs(1);
        assert_eq!(never.as_nanos(), u64::MAX);
        assert_eq!(Duration::from_secs(u64::MAX).as_nanos(), u64::MAX);
        assert_eq!(Instant::ZERO - Duration::from_secs(1), Instant::ZERO);
    }

    #[test]
    fn a_span_back_in_time_is_zero() {
        let (early, late) = (Instant::from_nanos(5), Instant::from_nanos(9));
        assert_eq!(late.since(early), Duration::from_nanos(4));
        assert_eq!(early.since(late), Duration::ZERO);
    }

    #[test]
    fn never_is_later_than_any_deadline() {
        let at = Some(Instant::from_nanos(7));
        assert_eq!(earlier(None, at), at);
        assert_eq!(earlier(at, None), at);
        assert_eq!(earlier(at, Some(Instant::from_nanos(3))), Some(Instant::from_nanos(3)));
        assert_eq!(earlier(None, None), None);
    }

    #[test]
    fn a_deadline_is_due_from_its_moment_on_and_never_is_never_due() {
        let at = |nanos| Instant::from_nanos(nanos);
        let mut deadline = Deadline::at(at(5));
        assert!(!deadline.is_due(at(4)));
        assert!(deadline.is_due(at(5)));
        assert_eq!(deadline.or_earlier(Deadline::NEVER), deadline);
        assert!(deadline.take_due(at(6)));
        assert_eq!(deadline, Deadline::NEVER);
        assert!(!deadline.is_due(at(u64::MAX)));
        assert_eq!(deadline.instant(), None);
        assert_eq!(Deadline::from(Some(at(7))).instant(), Some(at(7)));
        assert_eq!(size_of::<Deadline>(), 8);
    }

    #[test]
    fn time_is_printed_as_seconds_with_microseconds() {
        assert_eq!(Instant::from_nanos(2_000_045_999).to_string(), "2.000045");
    }
}

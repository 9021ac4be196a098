//! Connection objects (class 05): state, expected packet rate, watchdog, produced path.

use codewheel_station::{Deadline, Duration, Full, Instant, Writer};

use crate::explicit::{Error, GeneralStatus, class};

/// Instance number of the explicit connection.
pub const EXPLICIT: u8 = 1;
/// Instance number of the poll connection.
pub const POLL: u8 = 2;
/// Instance number of the change of state or cyclic connection.
pub const CHANGE_OF_STATE: u8 = 4;

/// The state of a connection (attribute 1). A connection that does not exist has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// 1: allocated; waits for its expected packet rate.
    Configuring = 1,
    /// 3: exchanges data.
    Established = 3,
    /// 4: the peer has been silent for too long.
    TimedOut = 4,
    /// 5: an explicit connection that timed out and lives on while an I/O connection is
    /// established.
    DeferredDelete = 5,
}

/// The least time until the first inactivity time-out after an I/O connection was established
/// (pre-consumption time-out).
pub const PRE_CONSUMPTION_TIME: Duration = Duration::from_secs(10);

/// The time without reception after which a connection with expected packet rate `rate_ms` has
/// timed out: four times the rate; `None` for rate 0.
#[must_use]
pub const fn inactivity_time(rate_ms: u16) -> Option<Duration> {
    if rate_ms == 0 { None } else { Some(Duration::from_millis(rate_ms as u64 * 4)) }
}

/// The state and timers that every connection has.
#[derive(Clone, Debug)]
pub struct Connection {
    /// Attribute 1.
    pub state: State,
    /// Attribute 9, expected packet rate in ms; 0 = no time-out.
    pub expected_packet_rate: u16,
    /// Attribute 12, what a time-out does.
    pub watchdog_action: u8,
    /// Attribute 17, production inhibit time in ms; 0 = none.
    pub production_inhibit: u16,
    /// Whether anything is consumed at all; without, nothing can be missed and nothing times out.
    pub(crate) consumes: bool,
    /// When the connection times out unless something arrives.
    inactive_at: Deadline,
}

impl Connection {
    /// Watchdog action 0: to state timed out.
    pub const TRANSITION_TO_TIMED_OUT: u8 = 0;
    /// Watchdog action 1: the connection is deleted.
    pub const AUTO_DELETE: u8 = 1;
    /// Watchdog action 2: the connection stays established and the timer begins anew.
    pub const AUTO_RESET: u8 = 2;
    /// Watchdog action 3: deleted once no I/O connection is established.
    pub const DEFERRED_DELETE: u8 = 3;

    /// A fresh explicit connection: established at once, 2500 ms, auto delete.
    #[must_use]
    pub fn explicit(now: Instant) -> Self {
        let mut connection = Self {
            state: State::Established,
            expected_packet_rate: 2500,
            watchdog_action: Self::AUTO_DELETE,
            production_inhibit: 0,
            consumes: true,
            inactive_at: Deadline::NEVER,
        };
        connection.arm(now);
        connection
    }

    /// A fresh I/O connection: configuring, no rate, time-out leads to timed out.
    #[must_use]
    pub const fn io() -> Self {
        Self {
            state: State::Configuring,
            expected_packet_rate: 0,
            watchdog_action: Self::TRANSITION_TO_TIMED_OUT,
            production_inhibit: 0,
            consumes: true,
            inactive_at: Deadline::NEVER,
        }
    }

    /// Whether it exchanges data.
    #[must_use]
    pub fn is_established(&self) -> bool {
        self.state == State::Established
    }

    /// Something arrived on the connection: the inactivity timer begins anew.
    pub fn arm(&mut self, now: Instant) {
        self.inactive_at = self.inactive_after(now, Duration::ZERO);
    }

    /// From configuring to established; the first interval is the pre-consumption time.
    pub fn establish(&mut self, now: Instant) {
        self.state = State::Established;
        self.inactive_at = self.inactive_after(now, PRE_CONSUMPTION_TIME);
    }

    fn inactive_after(&self, now: Instant, least: Duration) -> Deadline {
        match inactivity_time(self.expected_packet_rate) {
            Some(time) if self.consumes => Deadline::at(now + time.max(least)),
            _ => Deadline::NEVER,
        }
    }

    /// From now on the connection lasts ten seconds at most without reception, also with expected
    /// packet rate 0.
    pub(crate) fn limit(&mut self, now: Instant) {
        self.inactive_at = self.inactive_at.min(Deadline::at(now + PRE_CONSUMPTION_TIME));
    }

    /// Stops the inactivity timer.
    pub const fn disarm(&mut self) {
        self.inactive_at = Deadline::NEVER;
    }

    /// Whether the peer has been silent for too long.
    #[must_use]
    pub const fn is_inactive(&self, now: Instant) -> bool {
        self.inactive_at.is_due(now)
    }

    /// When [`is_inactive`](Self::is_inactive) becomes true.
    #[must_use]
    pub const fn deadline(&self) -> Deadline {
        self.inactive_at
    }

    /// Grants an expected packet rate. The tick is 1 ms, so what is asked for is what is granted.
    ///
    /// # Errors
    /// 09/11 where the production inhibit time is longer.
    pub fn set_expected_packet_rate(&mut self, now: Instant, rate_ms: u16) -> Result<(), Error> {
        Self::check_inhibit(rate_ms, self.production_inhibit)?;
        self.expected_packet_rate = rate_ms;
        match self.state {
            State::Configuring => self.establish(now),
            State::Established | State::DeferredDelete => self.arm(now),
            State::TimedOut => {}
        }
        Ok(())
    }

    /// Grants a production inhibit time, while configuring.
    ///
    /// # Errors
    /// 0C once configured; 09/11 where it is longer than the expected packet rate.
    pub fn set_production_inhibit(&mut self, inhibit_ms: u16) -> Result<(), Error> {
        if self.state != State::Configuring {
            return Err(GeneralStatus::OBJECT_STATE_CONFLICT.into());
        }
        Self::check_inhibit(self.expected_packet_rate, inhibit_ms)?;
        self.production_inhibit = inhibit_ms;
        Ok(())
    }

    fn check_inhibit(rate_ms: u16, inhibit_ms: u16) -> Result<(), Error> {
        if rate_ms != 0 && inhibit_ms > rate_ms {
            return Err(Error::with(GeneralStatus::INVALID_ATTRIBUTE_VALUE, 0x11));
        }
        Ok(())
    }
}

/// Where an I/O connection's data come from (attribute 14): an assembly instance, in the short or
/// in the long form of the path. Get returns the form that was set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ProducedPath {
    /// The assembly instance.
    pub assembly: u8,
    /// `20 04 24 0x 30 03`, which names attribute 3 as well, rather than `20 04 24 0x`.
    pub names_attribute: bool,
}

impl Default for ProducedPath {
    /// Assembly 1 in the short form (AMG manual §6: "The default value is instance 1").
    fn default() -> Self {
        Self { assembly: 1, names_attribute: false }
    }
}

impl ProducedPath {
    /// Reads a path to an assembly's data.
    #[must_use]
    pub const fn parse(octets: &[u8]) -> Option<Self> {
        match *octets {
            [0x20, class::ASSEMBLY, 0x24, assembly] => {
                Some(Self { assembly, names_attribute: false })
            }
            [0x20, class::ASSEMBLY, 0x24, assembly, 0x30, 0x03] => {
                Some(Self { assembly, names_attribute: true })
            }
            _ => None,
        }
    }

    /// The octets of the path, 4 or 6 (attribute 13).
    #[must_use]
    pub const fn length(&self) -> usize {
        if self.names_attribute { 6 } else { 4 }
    }

    /// Writes the path.
    ///
    /// # Errors
    /// [`Full`] where the output cannot take it.
    pub fn write(&self, out: &mut Writer<'_>) -> Result<(), Full> {
        out.octets(&[0x20, class::ASSEMBLY, 0x24, self.assembly])?;
        if self.names_attribute {
            out.octets(&[0x30, 0x03])?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Instant = Instant::from_nanos(1_000);

    #[test]
    fn the_first_inactivity_time_is_ten_seconds_or_four_times_the_rate() {
        let mut connection = Connection::io();
        connection.set_expected_packet_rate(START, 100).unwrap();
        assert_eq!(connection.deadline(), Deadline::at(START + Duration::from_secs(10)));
        connection.arm(START);
        assert_eq!(connection.deadline(), Deadline::at(START + Duration::from_millis(400)));
        let mut slow = Connection::io();
        slow.set_expected_packet_rate(START, 65535).unwrap();
        assert_eq!(slow.deadline(), Deadline::at(START + Duration::from_millis(4 * 65535)));
    }

    #[test]
    fn rate_zero_never_times_out() {
        let mut connection = Connection::io();
        connection.set_expected_packet_rate(START, 0).unwrap();
        assert!(connection.is_established());
        assert_eq!(connection.deadline(), Deadline::NEVER);
    }

    #[test]
    fn inhibit_beyond_the_rate_is_refused_whichever_is_set_second() {
        let refusal = Error::with(GeneralStatus::INVALID_ATTRIBUTE_VALUE, 0x11);
        let mut connection = Connection::io();
        connection.set_production_inhibit(200).unwrap();
        assert_eq!(connection.set_expected_packet_rate(START, 199), Err(refusal));
        assert_eq!(connection.state, State::Configuring);
        connection.set_expected_packet_rate(START, 200).unwrap();
        let conflict = Err(GeneralStatus::OBJECT_STATE_CONFLICT.into());
        assert_eq!(connection.set_production_inhibit(1), conflict);
    }

    #[test]
    fn only_paths_to_an_assembly_are_read() {
        let short = ProducedPath { assembly: 2, names_attribute: false };
        let long = ProducedPath { assembly: 2, names_attribute: true };
        assert_eq!(ProducedPath::parse(&[0x20, 4, 0x24, 2]), Some(short));
        assert_eq!(ProducedPath::parse(&[0x20, 4, 0x24, 2, 0x30, 3]), Some(long));
        for wrong in [
            &[][..],
            &[0x20, 4, 0x24],
            &[0x20, 5, 0x24, 2],
            &[0x20, 4, 0x24, 2, 0x30, 4],
            &[0x20, 4, 0x24, 2, 0],
        ] {
            assert_eq!(ProducedPath::parse(wrong), None);
        }
    }
}

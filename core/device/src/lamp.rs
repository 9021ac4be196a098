//! The bicolour lamp in the bus cover: combined module and network status (AMG manual §9.2; PROFIBUS
//! manual §9.5).

use core::fmt;

use codewheel_devicenet::NetworkStatus;
use codewheel_station::Duration;

/// What the lamp says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lamp {
    /// No power, or the duplicate MAC ID check is not finished.
    Off,
    /// On-line, no connection.
    GreenFlashing,
    /// A connection is established. On PROFIBUS: data is exchanged.
    Green,
    /// On PROFIBUS: the slave is on its way to the exchange of data.
    Yellow,
    /// An I/O connection has timed out. On PROFIBUS: a parameterization error.
    RedFlashing,
    /// On PROFIBUS, five times a second: a preset out of range.
    RedFlashingFast,
    /// Critical: duplicate MAC ID, bus-off, illegal switches. On PROFIBUS: a position error.
    Red,
    /// The self test at power-on: green, then red, for a quarter of a second each.
    SelfTest,
}

/// What the eye sees at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Colour {
    /// Dark.
    Dark,
    /// Green light.
    Green,
    /// Yellow light: green and red at once.
    Yellow,
    /// Red light.
    Red,
}

/// What the lamp of a slave depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SlaveStatus {
    pub(crate) preset_out_of_range: bool,
    pub(crate) position_error: bool,
    pub(crate) parameterization_error: bool,
    pub(crate) exchanges_data: bool,
}

/// How long each colour of the self test shines.
const SELF_TEST: Duration = Duration::from_millis(250);
/// How long a flashing lamp is on, and then off.
const HALF_PERIOD: u64 = Duration::from_millis(500).as_nanos();
/// The same for five times a second.
const FAST_HALF_PERIOD: u64 = Duration::from_millis(100).as_nanos();

impl Lamp {
    /// The lamp `since` after power-up, with the network as it is.
    #[must_use]
    pub fn of(network: NetworkStatus, since: Duration) -> Self {
        if since < SELF_TEST.times(2) {
            return Self::SelfTest;
        }
        match network {
            NetworkStatus::NotOnLine => Self::Off,
            NetworkStatus::OnLine => Self::GreenFlashing,
            NetworkStatus::Connected => Self::Green,
            NetworkStatus::TimedOut => Self::RedFlashing,
            NetworkStatus::Faulted(_) => Self::Red,
        }
    }

    /// The lamp of a PROFIBUS slave. Decision: what needs a person most comes first.
    pub(crate) const fn of_slave(status: SlaveStatus) -> Self {
        match status {
            SlaveStatus { preset_out_of_range: true, .. } => Self::RedFlashingFast,
            SlaveStatus { position_error: true, .. } => Self::Red,
            SlaveStatus { parameterization_error: true, .. } => Self::RedFlashing,
            SlaveStatus { exchanges_data: true, .. } => Self::Green,
            SlaveStatus { exchanges_data: false, .. } => Self::Yellow,
        }
    }

    /// The colour `since` after power-up.
    #[must_use]
    pub fn colour(self, since: Duration) -> Colour {
        let half_period =
            if self == Self::RedFlashingFast { FAST_HALF_PERIOD } else { HALF_PERIOD };
        let lit = (since.as_nanos() / half_period).is_multiple_of(2);
        match self {
            Self::Off => Colour::Dark,
            Self::Green => Colour::Green,
            Self::Yellow => Colour::Yellow,
            Self::Red => Colour::Red,
            Self::GreenFlashing if lit => Colour::Green,
            Self::RedFlashing | Self::RedFlashingFast if lit => Colour::Red,
            Self::GreenFlashing | Self::RedFlashing | Self::RedFlashingFast => Colour::Dark,
            Self::SelfTest if since < SELF_TEST => Colour::Green,
            Self::SelfTest => Colour::Red,
        }
    }
}

impl fmt::Display for Lamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Off => "off",
            Self::GreenFlashing => "green flashing",
            Self::Green => "green",
            Self::Yellow => "yellow",
            Self::RedFlashing => "red flashing",
            Self::RedFlashingFast => "red flashing fast",
            Self::Red => "red",
            Self::SelfTest => "self test",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_devicenet::Fault;

    fn at(network: NetworkStatus, millis: u64) -> Colour {
        let since = Duration::from_millis(millis);
        Lamp::of(network, since).colour(since)
    }

    #[test]
    fn the_self_test_shows_green_then_red_for_a_quarter_of_a_second_each() {
        let network = NetworkStatus::NotOnLine;
        let colours = [0, 249, 250, 499, 500].map(|millis| at(network, millis));
        let expected = [Colour::Green, Colour::Green, Colour::Red, Colour::Red, Colour::Dark];
        assert_eq!(colours, expected);
    }

    #[test]
    fn each_status_has_its_light() {
        assert_eq!(at(NetworkStatus::NotOnLine, 1_900), Colour::Dark);
        assert_eq!(at(NetworkStatus::Connected, 9_700), Colour::Green);
        assert_eq!(at(NetworkStatus::Faulted(Fault::DuplicateMac), 9_700), Colour::Red);
    }

    #[test]
    fn flashing_is_half_a_second_on_and_half_a_second_off() {
        for (network, colour) in
            [(NetworkStatus::OnLine, Colour::Green), (NetworkStatus::TimedOut, Colour::Red)]
        {
            assert_eq!(at(network, 3_000), colour);
            assert_eq!(at(network, 3_499), colour);
            assert_eq!(at(network, 3_500), Colour::Dark);
            assert_eq!(at(network, 3_999), Colour::Dark);
            assert_eq!(at(network, 4_000), colour);
        }
    }

    #[test]
    fn a_preset_out_of_range_flashes_five_times_a_second() {
        let at = |millis| Lamp::RedFlashingFast.colour(Duration::from_millis(millis));
        assert_eq!(
            [at(0), at(99), at(100), at(199)].map(|colour| colour == Colour::Red),
            [true, true, false, false]
        );
        let flashes = (0..1_000).filter(|millis| at(*millis) != at(millis + 1)).count();
        assert_eq!(flashes, 10, "five times on and off in a second");
    }

    /// Decision: 5 Hz > red > 1 Hz > yellow or green.
    #[test]
    fn of_several_troubles_of_a_slave_the_lamp_shows_the_one_that_needs_a_person_most() {
        for bits in 0..16 {
            let status = SlaveStatus {
                preset_out_of_range: bits & 8 != 0,
                position_error: bits & 4 != 0,
                parameterization_error: bits & 2 != 0,
                exchanges_data: bits & 1 != 0,
            };
            let expected = match bits {
                8.. => Lamp::RedFlashingFast,
                4.. => Lamp::Red,
                2.. => Lamp::RedFlashing,
                1 => Lamp::Green,
                _ => Lamp::Yellow,
            };
            assert_eq!(Lamp::of_slave(status), expected, "{status:?}");
        }
    }
}

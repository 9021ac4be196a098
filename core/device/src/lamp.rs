//! The bicolour lamp in the bus cover: combined module and network status (AMG manual §9.2).

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
    /// A connection is established.
    Green,
    /// An I/O connection has timed out.
    RedFlashing,
    /// Critical: duplicate MAC ID, bus-off, illegal switches.
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
    /// Red light.
    Red,
}

/// How long each colour of the self test shines.
const SELF_TEST: Duration = Duration::from_millis(250);
/// How long a flashing lamp is on, and then off.
const HALF_PERIOD: u64 = Duration::from_millis(500).as_nanos();

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

    /// The colour `since` after power-up.
    #[must_use]
    pub fn colour(self, since: Duration) -> Colour {
        let lit = (since.as_nanos() / HALF_PERIOD).is_multiple_of(2);
        match self {
            Self::Off => Colour::Dark,
            Self::Green => Colour::Green,
            Self::Red => Colour::Red,
            Self::GreenFlashing if lit => Colour::Green,
            Self::RedFlashing if lit => Colour::Red,
            Self::GreenFlashing | Self::RedFlashing => Colour::Dark,
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
            Self::RedFlashing => "red flashing",
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
}

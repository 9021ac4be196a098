//! Rotary and DIP switches of the bus cover, and the terminating resistor (AMG manual §9.1).

use codewheel_devicenet::MacId;
use codewheel_station::can::BitRate;

/// The switches of a DeviceNet bus cover. They are read once, at power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Switches {
    /// Rotary switch 1, 0 … 9: tens of the address (decision: the manual does not say which).
    pub rotary_1: u8,
    /// Rotary switch 2, 0 … 9: units of the address.
    pub rotary_2: u8,
    /// DIP switch 2 of the bit rate.
    pub dip_2: bool,
    /// DIP switch 3 of the bit rate.
    pub dip_3: bool,
    /// The terminating resistor; ON at the last user of the bus line.
    pub termination: bool,
}

impl Default for Switches {
    /// As delivered: address 00, 125 kbit/s, termination OFF.
    fn default() -> Self {
        Self { rotary_1: 0, rotary_2: 0, dip_2: false, dip_3: false, termination: false }
    }
}

impl Switches {
    /// The switches set to `address` (0 … 99) and `bit_rate`, termination OFF.
    #[must_use]
    pub const fn set_to(address: u8, bit_rate: BitRate) -> Self {
        let (dip_2, dip_3) = match bit_rate {
            BitRate::Kbit125 => (false, false),
            BitRate::Kbit250 => (false, true),
            BitRate::Kbit500 => (true, false),
        };
        Self {
            rotary_1: address / 10 % 10,
            rotary_2: address % 10,
            dip_2,
            dip_3,
            termination: false,
        }
    }

    /// What the rotary switches say, 0 … 99.
    #[must_use]
    pub const fn address(&self) -> u8 {
        self.rotary_1 % 10 * 10 + self.rotary_2 % 10
    }

    /// The MAC ID, or `None` above 63: DeviceNet has no such address.
    #[must_use]
    pub const fn mac(&self) -> Option<MacId> {
        MacId::new(self.address())
    }

    /// The bit rate; both switches ON means the default of 125 kbit/s (AMG manual §9.1.2, *).
    #[must_use]
    pub const fn bit_rate(&self) -> BitRate {
        match (self.dip_2, self.dip_3) {
            (false, true) => BitRate::Kbit250,
            (true, false) => BitRate::Kbit500,
            (false, false) | (true, true) => BitRate::Kbit125,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dip_switches_set_the_rates_of_the_table() {
        let rate = |dip_2, dip_3| Switches { dip_2, dip_3, ..Switches::default() }.bit_rate();
        assert_eq!(rate(false, false), BitRate::Kbit125);
        assert_eq!(rate(false, true), BitRate::Kbit250);
        assert_eq!(rate(true, false), BitRate::Kbit500);
        assert_eq!(rate(true, true), BitRate::Kbit125);
        for bit_rate in BitRate::ALL {
            assert_eq!(Switches::set_to(23, bit_rate).bit_rate(), bit_rate);
        }
    }

    /// AMG manual §9.1: 125 kbit/s and OFF are printed; address 00 is a decision.
    #[test]
    fn as_delivered_the_switches_say_address_0_125_kbit_and_no_termination() {
        let switches = Switches::default();
        assert_eq!(switches.mac(), MacId::new(0));
        assert_eq!(switches.bit_rate(), BitRate::Kbit125);
        assert!(!switches.termination);
    }

    #[test]
    fn the_rotary_switches_read_in_decimal() {
        let switches = Switches { rotary_1: 2, rotary_2: 3, ..Switches::default() };
        assert_eq!(switches.mac(), MacId::new(23));
        assert_eq!(Switches::set_to(63, BitRate::Kbit125).mac(), MacId::new(63));
        for address in 64..=99 {
            assert_eq!(Switches::set_to(address, BitRate::Kbit125).mac(), None);
            assert_eq!(Switches::set_to(address, BitRate::Kbit125).address(), address);
        }
    }
}

//! The switches of a PROFIBUS bus cover: two rotary switches and the terminating resistor
//! (PROFIBUS manual §9.2 and §9.3).

/// Where they stand. The address is read once, at power-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Switches {
    /// Rotary switch 1, 0 … 9: tens of the address (decision: the manual does not say which).
    pub rotary_1: u8,
    /// Rotary switch 2, 0 … 9: units of the address.
    pub rotary_2: u8,
    /// The two-pole DIP switch of the terminating resistors; ON at the last user of the bus line.
    pub termination: bool,
}

impl Switches {
    /// The switches set to `address` (0 … 99), termination OFF.
    #[must_use]
    pub const fn set_to(address: u8) -> Self {
        Self { rotary_1: address / 10 % 10, rotary_2: address % 10, termination: false }
    }

    /// The station address, 0 … 99.
    #[must_use]
    pub const fn address(&self) -> u8 {
        self.rotary_1 % 10 * 10 + self.rotary_2 % 10
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// PROFIBUS manual §9.2: default setting 00, example 23.
    #[test]
    fn the_rotary_switches_read_in_decimal() {
        assert_eq!(Switches::default().address(), 0);
        let example = Switches { rotary_1: 2, rotary_2: 3, termination: false };
        assert_eq!(example.address(), 23);
        for address in 0..=99 {
            assert_eq!(Switches::set_to(address).address(), address);
        }
    }
}

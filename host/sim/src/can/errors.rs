//! The transmit error counter of a controller (ISO 11898-1, 12.1.4).

/// How often a controller has failed to send, as the standard weighs it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct TransmitErrors(u16);

/// What one failure counts.
const FAILURE: u16 = 8;
/// From here on a controller is error-passive.
const PASSIVE: u16 = 128;
/// Above this it is bus-off.
const LAST: u16 = 255;

impl TransmitErrors {
    /// A frame was destroyed: eight more.
    pub(super) fn failed(&mut self) {
        self.0 = self.0.saturating_add(FAILURE);
    }

    /// A frame was not acknowledged, which makes a controller error-passive and never bus-off.
    pub(super) fn failed_at_most_passive(&mut self) {
        self.0 = (self.0 + FAILURE).min(LAST).max(self.0);
    }

    /// A frame went out: one less.
    pub(super) fn succeeded(&mut self) {
        self.0 = self.0.saturating_sub(1);
    }

    /// Whether the controller is error-passive: its error flags no longer disturb others.
    pub(super) const fn passive(self) -> bool {
        self.0 >= PASSIVE
    }

    /// Whether the controller has to leave the bus.
    pub(super) const fn bus_off(self) -> bool {
        self.0 > LAST
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_failures_make_a_controller_passive_and_one_success_active_again() {
        let mut errors = TransmitErrors::default();
        (0..15).for_each(|_| errors.failed());
        assert!(!errors.passive());
        errors.failed();
        assert!(errors.passive());
        errors.succeeded();
        assert!(!errors.passive());
    }

    #[test]
    fn thirty_two_failures_make_it_bus_off_and_want_of_an_acknowledge_never_does() {
        let mut errors = TransmitErrors::default();
        (0..1_000).for_each(|_| errors.failed_at_most_passive());
        assert!(errors.passive() && !errors.bus_off());
        let mut errors = TransmitErrors::default();
        (0..31).for_each(|_| errors.failed());
        assert!(!errors.bus_off());
        errors.failed();
        assert!(errors.bus_off());
    }
}

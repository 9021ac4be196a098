//! The transmit error counter of a controller (ISO 11898-1, 12.1.4).

/// How often a controller has failed to send, as the standard weighs it.
///
/// Bus-off, which begins above 255, is not modelled: the counter stops there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct TransmitErrors(u8);

impl TransmitErrors {
    /// A frame was destroyed or not acknowledged: eight more.
    pub(super) fn failed(&mut self) {
        self.0 = self.0.saturating_add(8);
    }

    /// A frame went out: one less.
    pub(super) fn succeeded(&mut self) {
        self.0 = self.0.saturating_sub(1);
    }

    /// Whether the controller is error-passive: its error flags no longer disturb others.
    pub(super) const fn passive(self) -> bool {
        self.0 >= 128
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
        (0..100).for_each(|_| errors.failed());
        assert!(errors.passive());
    }
}

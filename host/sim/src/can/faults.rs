//! Faults drawn from a seed.

/// How often the wire fails. Probabilities from 0 (never, the default) to 1 (always); what lies
/// outside counts as the nearer end, what is no number as 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// How likely a station that should take a frame does not see it; drawn for each taker. The
    /// sender still counts the frame as sent.
    pub loss: f64,
    /// How likely a frame is destroyed on the wire: nobody takes it, and its sender repeats it. This
    /// noise makes nobody bus-off, however strong it is; a bad transceiver does,
    /// [`Wire::set_corruption_at`](super::Wire::set_corruption_at).
    pub corruption: f64,
}

//! How often the line fails.

/// How often the line fails. Probabilities from 0 (never, the default) to 1 (always); what lies
/// outside counts as the nearer end, what is no number as 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// How likely a station does not hear a telegram at all; drawn for each telegram and each
    /// station.
    pub loss: f64,
    /// How likely the driver of a sender gives out in a telegram: from a drawn character on, all are
    /// broken.
    pub corruption: f64,
    /// How likely a character is broken: parity or framing.
    pub broken: f64,
    /// How likely two bits of a character are turned over, so that its parity is good and its octet
    /// wrong.
    pub flipped: f64,
    /// How likely a telegram has a pause of 11 to 66 bits between two of its characters.
    pub pause: f64,
}

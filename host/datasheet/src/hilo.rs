//! A number of 32 bits as the two words that many configuration tools take in its place.

use thiserror::Error;

/// What one of the two fields of a configuration tool cannot hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum NotAWord {
    /// The upper one.
    #[error("hi {0} does not fit 16 bits: 0 to 65535 are possible")]
    Hi(u32),
    /// The lower one.
    #[error("lo {0} does not fit 16 bits: 0 to 65535 are possible")]
    Lo(u32),
}

/// The upper and the lower 16 bits, to be entered as "hi" and "lo" (PROFIBUS manual §8).
///
/// ```
/// assert_eq!(codewheel_datasheet::hilo(3_600 * 256), (14, 4_096));
/// ```
#[must_use]
pub const fn hilo(value: u32) -> (u16, u16) {
    ((value >> 16) as u16, value as u16)
}

/// The number whose "hi" and "lo" these are.
///
/// # Errors
/// The first that does not fit 16 bits.
pub const fn from_hilo(hi: u32, lo: u32) -> Result<u32, NotAWord> {
    if hi > u16::MAX as u32 {
        return Err(NotAWord::Hi(hi));
    }
    if lo > u16::MAX as u32 {
        return Err(NotAWord::Lo(lo));
    }
    Ok(hi << 16 | lo)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// PROFIBUS manual §8: 3600 steps, 256 turns.
    #[test]
    fn the_example_of_the_manual_comes_out_and_goes_back_in() {
        assert_eq!(hilo(921_600), (14, 4_096));
        assert_eq!(hilo(3_600), (0, 3_600));
        assert_eq!(from_hilo(14, 4_096), Ok(921_600));
        assert_eq!(from_hilo(0, 3_600), Ok(3_600));
    }

    #[test]
    fn every_limit_of_every_geometry_survives_both_ways() {
        for value in [0, 1, 8_192, 65_535, 65_536, 262_144, 536_870_912, u32::MAX] {
            let (hi, lo) = hilo(value);
            assert_eq!(from_hilo(hi.into(), lo.into()), Ok(value));
        }
    }

    #[test]
    fn what_fits_no_word_is_refused_with_the_field_it_stands_in() {
        assert_eq!(from_hilo(65_536, 0), Err(NotAWord::Hi(65_536)));
        assert_eq!(from_hilo(0, 65_536), Err(NotAWord::Lo(65_536)));
        assert_eq!(from_hilo(u32::MAX, u32::MAX), Err(NotAWord::Hi(u32::MAX)));
        let refusal = from_hilo(0, 921_600).unwrap_err();
        assert_eq!(refusal.to_string(), "lo 921600 does not fit 16 bits: 0 to 65535 are possible");
    }
}

//! Positions on the ring of the measuring range, and whether a shaft is at rest.

use codewheel_station::Duration;

use crate::{Session, Trouble};

/// What was seen of a shaft for a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Watched {
    /// The newest position.
    pub(super) position: u32,
    /// Whether it stayed within a step of the first one.
    pub(super) at_rest: bool,
}

/// A session that gives samples of one moment for ever must not hang anybody.
const MOST_SAMPLES: usize = 100_000;

/// Watches the shaft for `span`. `total` is the measuring range, where it is known.
///
/// # Errors
/// What the samples meet with.
pub(super) fn watch(
    session: &mut dyn Session,
    span: Duration,
    total: Option<u32>,
) -> Result<Watched, Trouble> {
    let first = session.sample()?;
    let mut watched = Watched { position: first.position, at_rest: true };
    for _ in 0..MOST_SAMPLES {
        let sample = session.sample()?;
        watched.position = sample.position;
        watched.at_rest &= distance(first.position, sample.position, total) <= 1;
        if sample.at.since(first.at) >= span {
            break;
        }
    }
    Ok(watched)
}

/// How far two positions are apart, the shorter way round where the range is known.
pub(super) fn distance(a: u32, b: u32, total: Option<u32>) -> u32 {
    let apart = a.abs_diff(b);
    match total {
        Some(total) if apart < total => apart.min(total - apart),
        _ => apart,
    }
}

/// `value` mod `total`, 0 … total−1; 0 of no range at all.
pub(super) fn modulo(value: i64, total: u32) -> u32 {
    // What is left of a division by 32 bits has 32 bits.
    value.checked_rem_euclid(i64::from(total)).map_or(0, |rest| rest as u32)
}

/// The preset that makes the offset `wanted`, mod `total`, of an encoder that is at `position` with
/// `offset`.
pub(super) fn preset_for(wanted: i64, position: u32, offset: i64, total: u32) -> u32 {
    let [scaled, wanted] = [i64::from(position).saturating_sub(offset), wanted];
    modulo(i64::from(modulo(scaled, total)) + i64::from(modulo(wanted, total)), total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shorter_way_goes_across_the_wrap() {
        assert_eq!(distance(3_599, 0, Some(3_600)), 1);
        assert_eq!(distance(0, 1_800, Some(3_600)), 1_800);
        assert_eq!(distance(0, 3_599, None), 3_599);
        assert_eq!(distance(9, 3_700, Some(3_600)), 3_691, "beyond the range nothing is a ring");
    }

    #[test]
    fn a_preset_brings_an_offset_back_from_anywhere() {
        for total in [1_u32, 7, 3_600, 3_601, 1 << 29] {
            for wanted in [0, 5, -5, 1 - i64::from(total), i64::MIN, i64::MAX] {
                for scaled in [0, total / 2, total - 1] {
                    for offset in [0, 3, -2] {
                        let position = modulo(i64::from(scaled) + offset, total);
                        let preset = preset_for(wanted, position, offset, total);
                        assert!(preset < total);
                        let made = i64::from(preset) - i64::from(scaled);
                        assert_eq!(modulo(made, total), modulo(wanted, total));
                    }
                }
            }
        }
    }
}

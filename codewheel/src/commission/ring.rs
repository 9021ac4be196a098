//! Positions lie on a ring: behind the last comes the first.

/// `way` in steps as the shorter way around a ring of `range` steps; as it is where there is none.
pub(super) fn shortest(way: i64, range: i64) -> i64 {
    if range <= 0 {
        return way;
    }
    let way = way.rem_euclid(range);
    if way > range / 2 { way - range } else { way }
}

/// `position` moved by `by` on a ring of `range` steps.
pub(super) fn moved(position: u32, by: i64, range: u32) -> u32 {
    let moved = i128::from(position) + i128::from(by);
    let range = i128::from(range.max(1));
    u32::try_from(moved.rem_euclid(range)).unwrap_or(position)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_and_the_way_back_end_where_they_began() {
        for (before, after) in [(0, 999), (999, 0), (10, 20), (20, 10), (0, 500), (501, 0)] {
            let back = shortest(i64::from(before) - i64::from(after), 1_000);
            assert_eq!(moved(after, back, 1_000), before, "{before} {after}");
            assert!(back.abs() <= 500);
        }
    }

    #[test]
    fn no_way_is_too_long() {
        assert_eq!(moved(0, i64::MIN, 1 << 10), 0);
        assert_eq!(moved(7, i64::MAX, 1 << 10), 6);
        assert_eq!(shortest(i64::MIN, 0), i64::MIN);
        assert_eq!(moved(7, 1, 0), 0);
    }
}

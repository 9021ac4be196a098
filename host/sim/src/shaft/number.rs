//! Numbers, angles and times as a user writes them, kept exact.

use codewheel_station::Duration;

use super::PARTS;

/// The decimals that are kept.
const DECIMALS: usize = 9;

/// One, as a [`decimal`].
pub(super) const ONE: i128 = 1_000_000_000;

/// The largest number taken, either way: large enough for any shaft, small enough that exact
/// arithmetic fits its type.
const LIMIT: i128 = 1_000_000_000 * ONE;

/// The longest time taken: 2⁶² ns, 146 years.
const LONGEST: i128 = 1 << 62;

/// What is allowed where an angle is due.
pub(super) const AN_ANGLE: &str =
    "an angle in whole raw steps (4096), degrees (90deg) or turns (1.5turns)";

/// What is allowed where a time is due.
pub(super) const A_TIME: &str = "a time in seconds (1.5s) or milliseconds (500ms)";

/// The decimal number `text` in units of 10⁻⁹; `None` where it is none, has more than nine decimals
/// or is beyond ±10⁹.
pub(super) fn decimal(text: &str) -> Option<i128> {
    let (negative, digits) = match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |text: &str| text.bytes().all(|octet| octet.is_ascii_digit());
    if whole.len() + fraction.len() == 0 || !all_digits(whole) || !all_digits(fraction) {
        return None;
    }
    let whole = whole.trim_start_matches('0');
    if whole.len() > 10 || fraction.len() > DECIMALS {
        return None;
    }
    let number = |text: &str| if text.is_empty() { Some(0) } else { text.parse::<i128>().ok() };
    let fraction = number(&format!("{fraction:0<DECIMALS$}"))?;
    let value = number(whole)? * ONE + fraction;
    (value <= LIMIT).then_some(if negative { -value } else { value })
}

/// `turns`, a [`decimal`], as an angle.
pub(super) fn turns(turns: i128, singleturn_resolution: u32) -> i128 {
    turns * i128::from(singleturn_resolution) * (PARTS / ONE)
}

/// The angle that `text` writes, [`AN_ANGLE`].
pub(super) fn angle(text: &str, singleturn_resolution: u32) -> Option<i128> {
    if let Some(degrees) = text.strip_suffix("deg") {
        return Some(decimal(degrees)? * i128::from(singleturn_resolution));
    }
    if let Some(number) = text.strip_suffix("turns").or_else(|| text.strip_suffix("turn")) {
        return Some(turns(decimal(number)?, singleturn_resolution));
    }
    // A fraction of a step is nearly always a forgotten unit.
    let steps = decimal(text).filter(|steps| steps % ONE == 0)?;
    Some(steps / ONE * PARTS)
}

/// The time that `text` writes, [`A_TIME`].
pub(super) fn time(text: &str) -> Option<Duration> {
    let nanos = match text.strip_suffix("ms") {
        Some(millis) => decimal(millis)? / 1_000,
        None => decimal(text.strip_suffix('s').unwrap_or(text))?,
    };
    (0..=LONGEST).contains(&nanos).then(|| Duration::from_nanos(nanos as u64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_exact() {
        assert_eq!(decimal("60"), Some(60 * ONE));
        assert_eq!(decimal("-0.5"), Some(-ONE / 2));
        assert_eq!(decimal("+.000000001"), Some(1));
        assert_eq!(decimal("007."), Some(7 * ONE));
        assert_eq!(decimal("1000000000"), Some(LIMIT));
    }

    #[test]
    fn what_is_no_plain_decimal_is_no_number() {
        let bad = ["", "-", ".", "inf", "NaN", "1e3", "1,5", "--1", "1.0000000001", "1000000000.1"];
        for text in bad.into_iter().chain(["99999999999999999999999999999999999999999999", "１"]) {
            assert_eq!(decimal(text), None, "{text}");
        }
    }

    #[test]
    fn angles_carry_their_unit() {
        assert_eq!(angle("4096", 8192), Some(4096 * PARTS));
        assert_eq!(angle("180deg", 8192), angle("4096", 8192));
        assert_eq!(angle("-0.5turns", 8192), angle("-4096", 8192));
        assert_eq!(angle("1turn", 8192), angle("8192", 8192));
        assert_eq!(angle("0.25", 8192), None);
        assert_eq!(angle("90 deg", 8192), None);
    }

    #[test]
    fn times_are_seconds_unless_they_say_milliseconds() {
        assert_eq!(time("1.5"), Some(Duration::from_millis(1_500)));
        assert_eq!(time("1.5s"), time("1500ms"));
        assert_eq!(time("-1s"), None);
        assert_eq!(time("1h"), None);
    }
}

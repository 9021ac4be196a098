//! Spans of time as people write them: `10ms`, `1.5s`, `2m`.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use codewheel_station::Duration;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use thiserror::Error;

/// A span of time with its unit: a decimal number and `us`, `ms`, `s`, `m` or `h`, in whole
/// microseconds, at most a year.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TimeSpan(pub Duration);

/// A text that is no span of time.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "'{0}' is no span of time: write a number and its unit, us, ms, s, m or h, as in 10ms or 1.5s"
)]
pub struct NoTimeSpan(String);

/// The units with their nanoseconds. `ms` stands before `s` and `m`, which it ends and begins with.
const UNITS: [(&str, u64); 5] = [
    ("us", 1_000),
    ("ms", 1_000_000),
    ("s", 1_000_000_000),
    ("m", 60_000_000_000),
    ("h", 3_600_000_000_000),
];

/// A year.
const LONGEST: u64 = 365 * 24 * 3_600_000_000_000;

impl FromStr for TimeSpan {
    type Err = NoTimeSpan;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        parse(text.trim()).map(Self).ok_or_else(|| NoTimeSpan(text.to_owned()))
    }
}

fn parse(text: &str) -> Option<Duration> {
    let (number, unit) =
        UNITS.iter().find_map(|(name, nanos)| Some((text.strip_suffix(name)?, *nanos)))?;
    let (whole, decimals) = number.trim_end().split_once('.').unwrap_or((number.trim_end(), ""));
    let digits = |text: &str| text.bytes().all(|octet| octet.is_ascii_digit());
    if whole.is_empty() || !digits(whole) || !digits(decimals) || decimals.len() > 9 {
        return None;
    }
    let mut nanos = whole.parse::<u64>().ok()?.checked_mul(unit)?;
    if !decimals.is_empty() {
        let parts = u128::from(decimals.parse::<u64>().ok()?) * u128::from(unit);
        nanos += u64::try_from(parts / 10_u128.pow(decimals.len() as u32)).ok()?;
    }
    (nanos <= LONGEST && nanos.is_multiple_of(1_000)).then(|| Duration::from_nanos(nanos))
}

impl fmt::Display for TimeSpan {
    /// In the largest unit that gives a whole number, at least microseconds.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nanos = self.0.as_nanos();
        if nanos == 0 {
            return f.write_str("0ms");
        }
        let (name, unit) =
            UNITS.iter().rev().find(|(_, unit)| nanos.is_multiple_of(*unit)).unwrap_or(&UNITS[0]);
        write!(f, "{}{name}", nanos / unit)
    }
}

impl Serialize for TimeSpan {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for TimeSpan {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

impl JsonSchema for TimeSpan {
    fn schema_name() -> Cow<'static, str> {
        "TimeSpan".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A number and its unit: us, ms, s, m or h",
            "type": "string",
            "pattern": r"^\s*[0-9]+(\.[0-9]{0,9})?\s*(us|ms|s|m|h)\s*$",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_reads_back_as_it_is_written() {
        for (text, written) in [
            ("10ms", "10ms"),
            ("1.5s", "1500ms"),
            ("0s", "0ms"),
            ("120s", "2m"),
            ("2.5 h", "150m"),
            ("250us", "250us"),
            ("8760h", "8760h"),
        ] {
            let span: TimeSpan = text.parse().unwrap();
            assert_eq!(span.to_string(), written);
            assert_eq!(written.parse(), Ok(span));
        }
    }

    #[test]
    fn what_is_no_span_is_refused_with_an_example() {
        for text in [
            "",
            "10",
            "ms",
            "-1s",
            "1e3s",
            "1,5s",
            "9000h",
            "1.0000000001s",
            "0.0000001s",
            "10 days",
            "+1s",
        ] {
            let error = text.parse::<TimeSpan>().expect_err(text).to_string();
            assert!(error.contains("as in 10ms or 1.5s"), "{error}");
        }
    }
}

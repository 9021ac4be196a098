//! `codewheel hilo`: a number as the two words that configuration tools ask for, and back.

use std::io::Write;

use codewheel_datasheet::{from_hilo, hilo};
use serde::Serialize;

use crate::arguments::HiloArguments;
use crate::failure::Failure;

#[derive(Serialize)]
struct Split {
    value: u32,
    hi: u16,
    lo: u16,
}

pub(crate) fn run(arguments: &HiloArguments) -> Result<(), Failure> {
    let value = match arguments.lo {
        None => arguments.value,
        Some(lo) => {
            from_hilo(arguments.value, lo).map_err(|refusal| Failure::Usage(refusal.to_string()))?
        }
    };
    let (hi, lo) = hilo(value);
    let mut out = std::io::stdout().lock();
    if arguments.json {
        let text = serde_json::to_string(&Split { value, hi, lo }).map_err(std::io::Error::from)?;
        writeln!(out, "{text}")?;
    } else if arguments.lo.is_some() {
        writeln!(out, "{value}")?;
    } else {
        writeln!(out, "hi {hi} lo {lo}")?;
    }
    Ok(())
}

/// A number of 32 bits: `921600`, `0xE1000` or, as the manuals write it, `E1000h`.
pub(crate) fn number(text: &str) -> Result<u32, String> {
    let hexadecimal = text
        .strip_prefix("0x")
        .or_else(|| text.strip_prefix("0X"))
        .or_else(|| text.strip_suffix(['h', 'H']));
    let (digits, radix) = hexadecimal.map_or((text, 10), |digits| (digits, 16));
    // `from_str_radix` would also take a sign.
    let number = digits.bytes().all(|octet| octet.is_ascii_hexdigit());
    number.then(|| u32::from_str_radix(digits, radix).ok()).flatten().ok_or_else(|| {
        "write a number from 0 to 4294967295, decimal or hexadecimal, as in 921600, 0xE1000 or \
         E1000h"
            .to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_people_and_manuals_write_them() {
        for text in ["921600", "0xE1000", "0Xe1000", "E1000h", "e1000H"] {
            assert_eq!(number(text), Ok(921_600), "{text}");
        }
        assert_eq!(number("4294967295"), Ok(u32::MAX));
        assert_eq!(number("0xFFFFFFFF"), Ok(u32::MAX));
        for text in ["", "h", "0x", "-1", "+1", "0x-1", "4294967296", "1.5", "E1000", "hh", "14 "] {
            assert!(number(text).is_err(), "{text:?}");
        }
    }
}

//! Numbers as text, without allocation.

const DIGITS: &[u8; 16] = b"0123456789ABCDEF";

/// Appends `octet` as two hexadecimal digits.
pub(crate) fn push_octet(out: &mut Vec<u8>, octet: u8) {
    let digit = |nibble: u8| DIGITS.get(usize::from(nibble & 0xF)).copied().unwrap_or_default();
    out.extend_from_slice(&[digit(octet >> 4), digit(octet)]);
}

/// Appends `octets`, `separator` between them.
pub(crate) fn push_octets(out: &mut Vec<u8>, octets: &[u8], separator: &[u8]) {
    for (place, octet) in octets.iter().enumerate() {
        if place > 0 {
            out.extend_from_slice(separator);
        }
        push_octet(out, *octet);
    }
}

/// Appends the low `digits` hexadecimal digits of `value`.
pub(crate) fn push_hex(out: &mut Vec<u8>, value: u32, digits: u32) {
    for place in (0..digits).rev() {
        let nibble = (value >> (4 * place) & 0xF) as usize;
        out.push(DIGITS.get(nibble).copied().unwrap_or_default());
    }
}

/// Appends `value` in decimal, with leading zeros up to `width` digits.
pub(crate) fn push_decimal(out: &mut Vec<u8>, value: u64, width: usize) {
    let mut digits = [b'0'; 20];
    let mut rest = value;
    let mut used = 0;
    for digit in digits.iter_mut().rev() {
        *digit = b'0' + (rest % 10) as u8;
        rest /= 10;
        used += 1;
        if rest == 0 {
            break;
        }
    }
    let shown = used.max(width.min(20));
    out.extend_from_slice(digits.get(20 - shown..).unwrap_or_default());
}

/// The number that hexadecimal digits are, nothing else allowed and at most eight of them.
pub(crate) fn parse_hex(digits: &[u8]) -> Option<u32> {
    if digits.is_empty() || digits.len() > 8 {
        return None;
    }
    digits.iter().try_fold(0, |value, digit| Some(value << 4 | u32::from(nibble(*digit)?)))
}

/// The octet that two hexadecimal digits are.
pub(crate) fn parse_octet(digits: &[u8]) -> Option<u8> {
    match digits {
        &[high, low] => Some(nibble(high)? << 4 | nibble(low)?),
        _ => None,
    }
}

const fn nibble(digit: u8) -> Option<u8> {
    match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'a'..=b'f' => Some(digit - b'a' + 10),
        b'A'..=b'F' => Some(digit - b'A' + 10),
        _ => None,
    }
}

/// The number that decimal digits are, nothing else allowed.
pub(crate) fn parse_decimal(digits: &[u8]) -> Option<u64> {
    if digits.is_empty() {
        return None;
    }
    digits.iter().try_fold(0_u64, |value, digit| {
        let digit = digit.is_ascii_digit().then(|| u64::from(digit - b'0'))?;
        value.checked_mul(10)?.checked_add(digit)
    })
}

/// The decimal `text` times ten to the power of `decimals`; what is finer is cut off.
pub(crate) fn parse_scaled(text: &[u8], decimals: u32) -> Option<u64> {
    let mut parts = text.splitn(2, |octet| *octet == b'.');
    let whole = parse_decimal(parts.next()?)?.checked_mul(10_u64.checked_pow(decimals)?)?;
    let mut fraction = 0_u64;
    let digits = parts.next().unwrap_or_default();
    if !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    for place in 0..decimals as usize {
        let digit = digits.get(place).map_or(0, |digit| digit - b'0');
        fraction = fraction * 10 + u64::from(digit);
    }
    whole.checked_add(fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_as_they_are_written() {
        let mut out = Vec::new();
        for value in [0, 9, 10, 1_234_567_890, u64::MAX] {
            out.clear();
            push_decimal(&mut out, value, 1);
            assert_eq!(out, value.to_string().as_bytes());
            assert_eq!(parse_decimal(&out), Some(value));
        }
        out.clear();
        push_decimal(&mut out, 45, 6);
        push_hex(&mut out, 0x42B, 3);
        push_octets(&mut out, &[0x0A, 0xFF], b" ");
        assert_eq!(out, b"00004542B0A FF");
    }

    #[test]
    fn a_decimal_point_shifts_as_far_as_asked_and_signs_are_no_digits() {
        assert_eq!(parse_scaled(b"12.5", 3), Some(12_500));
        assert_eq!(parse_scaled(b"12", 3), Some(12_000));
        assert_eq!(parse_scaled(b"0.0000019", 6), Some(1));
        for wrong in [&b"-1"[..], b"+1", b"", b".5", b"1.x", b"1e3", b"99999999999999999999"] {
            assert_eq!(parse_scaled(wrong, 9), None, "{wrong:?}");
        }
        assert_eq!(parse_hex(b"+1"), None);
        assert_eq!(parse_hex(b"123456789"), None);
        assert_eq!(parse_octet(b"aF"), Some(0xAF));
    }
}

//! `.asc` of Vector: a text with times from the beginning of the measurement.
//!
//! Its dates have no time zone. We write UTC, and read as UTC.

use codewheel_station::can::{Frame, Identifier};
use jiff::civil::DateTime;
use jiff::tz::TimeZone;

use crate::hex::{parse_decimal, parse_hex, parse_scaled, push_decimal, push_hex};
use crate::lines::words;
use crate::reader::{Buses, Damage, Found, Head, HeadContent};
use crate::{Content, Direction, Record, Timestamp};

const MILLI: u64 = 1_000_000;

/// The head names milliseconds, so times count from a whole one.
pub(crate) const fn begin_of(begin: Timestamp) -> Timestamp {
    Timestamp::from_nanos(begin.as_nanos() / MILLI * MILLI)
}

pub(crate) fn head(out: &mut Vec<u8>, begin: Timestamp) {
    let date = date(begin);
    let text = format!(
        "date {date}\nbase hex  timestamps absolute\nno internal events logged\n\
         Begin Triggerblock {date}\n   0.000000 Start of measurement\n"
    );
    out.extend_from_slice(text.as_bytes());
}

pub(crate) fn tail(out: &mut Vec<u8>) {
    out.extend_from_slice(b"End TriggerBlock\n");
}

fn date(begin: Timestamp) -> String {
    let moment = jiff::Timestamp::from_nanosecond(begin.as_nanos().into()).unwrap_or_default();
    moment.to_zoned(TimeZone::UTC).strftime("%a %b %d %H:%M:%S.%3f %Y").to_string()
}

/// The moment of a date without its weekday: `Nov 22 07:53:11.123 2026`, or with `am` and `pm`.
fn moment(text: &str) -> Option<Timestamp> {
    // Jiff reads AM and PM in both cases, German Vector tools write months we cannot know.
    let forms = [
        "%b %d %I:%M:%S%.f %p %Y",
        "%b %d %H:%M:%S%.f %Y",
        "%b %d %I:%M:%S %p %Y",
        "%b %d %H:%M:%S %Y",
    ];
    let date = forms.iter().find_map(|form| DateTime::strptime(form, text).ok())?;
    let nanos = date.to_zoned(TimeZone::UTC).ok()?.timestamp().as_nanosecond();
    Some(Timestamp::from_nanos(u64::try_from(nanos).ok()?))
}

pub(crate) fn record(out: &mut Vec<u8>, begin: Timestamp, record: &Record<'_>) {
    let Content::Frame(frame) = record.content else { return };
    let micros = record.at.since(begin).as_nanos() / 1_000;
    push_decimal(out, micros / 1_000_000, 1);
    out.push(b'.');
    push_decimal(out, micros % 1_000_000, 6);
    out.push(b' ');
    push_decimal(out, u64::from(record.bus) + 1, 1);
    out.extend_from_slice(b"  ");
    let before = out.len();
    match frame.identifier() {
        Identifier::Standard(bits) => push_hex(out, bits.into(), 3),
        Identifier::Extended(bits) => {
            push_hex(out, bits, 8);
            out.push(b'x');
        }
    }
    out.resize(before + 16, b' ');
    out.extend_from_slice(match record.direction {
        Direction::Received => b"Rx   ",
        Direction::Sent => b"Tx   ",
    });
    out.extend_from_slice(if frame.is_remote() { b"r " } else { b"d " });
    push_decimal(out, frame.length() as u64, 1);
    for octet in frame.data() {
        out.push(b' ');
        push_hex(out, (*octet).into(), 2);
    }
    out.push(b'\n');
}

/// What the head of a file says.
#[derive(Debug)]
pub(crate) struct Parser {
    begin: Timestamp,
    last: Timestamp,
    decimal: bool,
    /// Times count from the line before.
    relative: bool,
}

impl Parser {
    pub(crate) const fn new() -> Self {
        let begin = Timestamp::from_nanos(0);
        Self { begin, last: begin, decimal: false, relative: false }
    }

    pub(crate) fn read(&mut self, line: &[u8], buses: &mut Buses) -> Result<Found, Damage> {
        let mut rest = words(line);
        let (Some(first), second) = (rest.next(), rest.next()) else { return Ok(Found::Nothing) };
        if !first.first().is_some_and(u8::is_ascii_digit) {
            return self.read_head(line, first, second);
        }
        let time = parse_scaled(first, 9).ok_or(Damage::Time)?;
        let from = if self.relative { self.last } else { self.begin };
        let nanos = from.as_nanos().checked_add(time).ok_or(Damage::Time)?;
        let at = Timestamp::from_nanos(nanos);
        self.last = at;
        // "0.0 Start of measurement", statistics, CANFD, and what else there is besides frames.
        let Some(channel) = second.and_then(parse_decimal) else {
            return match second {
                Some(b"CANFD") => Err(Damage::CanFd),
                Some(_) => Ok(Found::Nothing),
                None => Err(Damage::Short),
            };
        };
        let identifier = rest.next().ok_or(Damage::Short)?;
        let is_identifier =
            identifier.first().is_some_and(u8::is_ascii_hexdigit) && identifier != b"ErrorFrame";
        let direction = match rest.next() {
            Some(b"Rx" | b"rx") => Direction::Received,
            Some(b"Tx" | b"tx") => Direction::Sent,
            _ if !is_identifier => return Ok(Found::Skipped),
            Some(b"TxRq") => return Ok(Found::Skipped),
            Some(_) => return Err(Damage::Direction),
            None => return Err(Damage::Short),
        };
        let identifier = match identifier.strip_suffix(b"x") {
            Some(digits) => Identifier::Extended(self.number(digits).ok_or(Damage::Identifier)?),
            None => {
                let bits = self.number(identifier).ok_or(Damage::Identifier)?;
                Identifier::Standard(u16::try_from(bits).map_err(|_| Damage::Identifier)?)
            }
        };
        let is_remote = match rest.next() {
            Some(b"d" | b"D") => false,
            Some(b"r" | b"R") => true,
            Some(_) => return Err(Damage::Length),
            None => return Err(Damage::Short),
        };
        let length = match rest.next() {
            Some(length) => self.number(length).ok_or(Damage::Length)? as usize,
            None if is_remote => 0,
            None => return Err(Damage::Short),
        };
        let frame = if is_remote {
            Frame::remote(identifier, length)?
        } else {
            let mut octets = [0; 8];
            let octets = octets.get_mut(..length).ok_or(Damage::Length)?;
            for octet in octets.iter_mut() {
                let value = self.number(rest.next().ok_or(Damage::Short)?).ok_or(Damage::Octet)?;
                *octet = u8::try_from(value).map_err(|_| Damage::Octet)?;
            }
            Frame::new(identifier, octets)?
        };
        let bus = buses.numbered(channel)?;
        Ok(Found::Record(Head { at, bus, direction, content: HeadContent::Frame(frame) }))
    }

    fn read_head(
        &mut self,
        line: &[u8],
        first: &[u8],
        second: Option<&[u8]>,
    ) -> Result<Found, Damage> {
        let is = |word: &[u8], text: &str| word.eq_ignore_ascii_case(text.as_bytes());
        // The weekday says nothing new and stands in the language of the writer.
        let skip = match second {
            Some(second) if is(first, "begin") && is(second, "triggerblock") => 3,
            Some(_) if is(first, "date") => 2,
            Some(second) if is(first, "base") => {
                self.decimal = is(second, "dec");
                self.relative = words(line).any(|word| is(word, "relative"));
                return Ok(Found::Nothing);
            }
            _ => return Ok(Found::Nothing),
        };
        let date: Result<Vec<&str>, _> = words(line).skip(skip).map(str::from_utf8).collect();
        let date = date.map_err(|_| Damage::Date)?;
        if date.is_empty() {
            return Ok(Found::Nothing);
        }
        self.begin = moment(&date.join(" ")).ok_or(Damage::Date)?;
        self.last = self.begin;
        Ok(Found::Nothing)
    }

    fn number(&self, digits: &[u8]) -> Option<u32> {
        if self.decimal { u32::try_from(parse_decimal(digits)?).ok() } else { parse_hex(digits) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_reads_back_and_so_does_one_of_twelve_hours() {
        let begin = Timestamp::from_nanos(1_795_334_400_123_000_000);
        let text = date(begin);
        let behind = text.split_once(' ').unwrap().1;
        assert_eq!(moment(behind), Some(begin), "{text}");
        let noon = moment("Nov 22 12:00:00.000 pm 2026");
        assert!(noon.is_some());
        assert_eq!(moment("Nov 22 12:00:00.000 2026"), noon);
        assert_eq!(moment("Nov 22 12:00:00 PM 2026"), noon);
        assert_eq!(moment("Nov 99 12:00:00 PM 2026"), None);
    }
}

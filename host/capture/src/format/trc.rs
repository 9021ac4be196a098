//! `.trc` of PEAK: written as version 2.1, read from 1.1 on.

use codewheel_station::can::{Frame, Identifier};

use crate::hex::{parse_decimal, parse_hex, parse_octet, parse_scaled, push_decimal, push_hex};
use crate::lines::words;
use crate::reader::{Buses, Damage, Found, Head, HeadContent};
use crate::{Bus, Content, Direction, Record, Timestamp};

const DAY: u128 = 86_400_000_000_000;
/// Days from 1899-12-30, from which PEAK counts, to 1970-01-01.
const EPOCH_DAYS: u128 = 25_569;
/// Decimals of a day: the last one is less than a nanosecond.
const DECIMALS: u32 = 15;

pub(crate) fn head(out: &mut Vec<u8>, begin: Timestamp, buses: &[Bus]) {
    let nanos = u128::from(begin.as_nanos());
    let days = EPOCH_DAYS + nanos / DAY;
    // Rounded up, so that reading, which cuts off, gives the same nanosecond.
    let fraction = (nanos % DAY * 10_u128.pow(DECIMALS)).div_ceil(DAY);
    let mut text = format!(
        ";$FILEVERSION=2.1\r\n;$STARTTIME={days}.{fraction:0width$}\r\n\
         ;$COLUMNS=N,O,T,B,I,d,R,L,D\r\n;\r\n;   Recorded by codewheel\r\n;\r\n",
        width = DECIMALS as usize
    );
    for (bus, number) in buses.iter().zip(1..) {
        let rate = bus.bits_per_second.map_or(0, |rate| rate / 1_000);
        text.push_str(&format!(";   Bus {number}: {}, {rate} kbit/s\r\n", bus.name));
    }
    text.push_str(
        ";   Message   Time    Type    ID     Rx/Tx\r\n\
         ;   Number    Offset  |  Bus  [hex]  |  Reserved\r\n\
         ;   |         [ms]    |  |    |      |  |  Data Length Code\r\n\
         ;   |         |       |  |    |      |  |  |    Data [hex] ...\r\n\
         ;---+-- ------+------ +- +- --+----- +- +- +--- +- -- -- -- -- -- -- --\r\n",
    );
    out.extend_from_slice(text.as_bytes());
}

pub(crate) fn record(out: &mut Vec<u8>, begin: Timestamp, number: &mut u64, record: &Record<'_>) {
    let Content::Frame(frame) = record.content else { return };
    *number += 1;
    let micros = record.at.since(begin).as_nanos() / 1_000;
    push_right(out, *number, 7);
    push_right(out, micros / 1_000, 10);
    out.push(b'.');
    push_decimal(out, micros % 1_000, 3);
    out.extend_from_slice(if frame.is_remote() { b" RR" } else { b" DT" });
    push_right(out, u64::from(record.bus) + 1, 3);
    match frame.identifier() {
        Identifier::Standard(bits) => {
            out.extend_from_slice(b"     ");
            push_hex(out, bits.into(), 4);
        }
        Identifier::Extended(bits) => {
            out.push(b' ');
            push_hex(out, bits, 8);
        }
    }
    out.extend_from_slice(match record.direction {
        Direction::Received => b" Rx -  ",
        Direction::Sent => b" Tx -  ",
    });
    push_decimal(out, frame.length() as u64, 1);
    out.extend_from_slice(b"   ");
    for octet in frame.data() {
        out.push(b' ');
        push_hex(out, (*octet).into(), 2);
    }
    out.extend_from_slice(b"\r\n");
}

fn push_right(out: &mut Vec<u8>, value: u64, width: usize) {
    let before = out.len();
    push_decimal(out, value, 1);
    let digits = out.len() - before;
    for _ in digits..width {
        out.insert(before, b' ');
    }
}

/// Where a column stands, from 0 on; `None` where there is none.
#[derive(Clone, Copy, Debug)]
struct Columns {
    offset: usize,
    kind: Option<usize>,
    bus: Option<usize>,
    identifier: usize,
    direction: usize,
    length: usize,
    data: usize,
}

/// Versions 1.x have no type of frames but the word RTR in the place of data.
const VERSION_1_1: Columns =
    Columns { offset: 1, kind: None, bus: None, identifier: 3, direction: 2, length: 4, data: 5 };
const VERSION_1_2: Columns = Columns {
    offset: 1,
    kind: None,
    bus: Some(2),
    identifier: 4,
    direction: 3,
    length: 5,
    data: 6,
};
const VERSION_1_3: Columns = Columns {
    offset: 1,
    kind: None,
    bus: Some(2),
    identifier: 4,
    direction: 3,
    length: 6,
    data: 7,
};

/// What the head of a file says.
#[derive(Debug)]
pub(crate) struct Parser {
    begin: Timestamp,
    columns: Option<Columns>,
}

impl Parser {
    pub(crate) const fn new() -> Self {
        Self { begin: Timestamp::from_nanos(0), columns: None }
    }

    pub(crate) fn read(&mut self, line: &[u8], buses: &mut Buses) -> Result<Found, Damage> {
        if line.is_empty() {
            return Ok(Found::Nothing);
        }
        if let Some(comment) = line.strip_prefix(b";") {
            return self.read_head(comment.trim_ascii()).map(|()| Found::Nothing);
        }
        let columns = self.columns.ok_or(Damage::Head)?;
        let mut cells = [&b""[..]; 24];
        let mut count = 0;
        for (cell, word) in cells.iter_mut().zip(words(line)) {
            *cell = word;
            count += 1;
        }
        let cell = |place: usize| cells.get(place).filter(|_| place < count).copied();
        let offset = cell(columns.offset).ok_or(Damage::Short)?;
        let offset = parse_scaled(offset, 6).ok_or(Damage::Time)?;
        let nanos = self.begin.as_nanos().checked_add(offset).ok_or(Damage::Time)?;
        let at = Timestamp::from_nanos(nanos);
        let mut is_remote = match columns.kind.map(|kind| cell(kind).ok_or(Damage::Short)) {
            None => false,
            Some(kind) => match kind? {
                b"DT" => false,
                b"RR" => true,
                b"FD" | b"FB" | b"FE" | b"BI" => return Err(Damage::CanFd),
                // States of the bus, errors, events: not traffic.
                _ => return Ok(Found::Skipped),
            },
        };
        let direction = match cell(columns.direction).ok_or(Damage::Short)? {
            b"Rx" => Direction::Received,
            b"Tx" => Direction::Sent,
            // In versions 1.x warnings and errors stand where the direction does.
            _ if columns.kind.is_none() => return Ok(Found::Skipped),
            _ => return Err(Damage::Direction),
        };
        let digits = cell(columns.identifier).ok_or(Damage::Short)?;
        let bits = parse_hex(digits).ok_or(Damage::Identifier)?;
        let identifier = match digits.len() {
            0..=4 => Identifier::Standard(bits as u16),
            _ => Identifier::Extended(bits),
        };
        let length = cell(columns.length).and_then(parse_decimal).ok_or(Damage::Length)?;
        let length = usize::try_from(length).map_err(|_| Damage::Length)?;
        is_remote |= cell(columns.data) == Some(b"RTR");
        let frame = if is_remote {
            Frame::remote(identifier, length)?
        } else {
            let mut octets = [0; 8];
            let octets = octets.get_mut(..length).ok_or(Damage::Length)?;
            for (octet, place) in octets.iter_mut().zip(columns.data..) {
                let word = cell(place).ok_or(Damage::Short)?;
                *octet = parse_octet(word).ok_or(Damage::Octet)?;
            }
            Frame::new(identifier, octets)?
        };
        let bus = match columns.bus {
            Some(bus) => cell(bus).and_then(parse_decimal).ok_or(Damage::Bus)?,
            None => 1,
        };
        let bus = buses.numbered(bus)?;
        Ok(Found::Record(Head { at, bus, direction, content: HeadContent::Frame(frame) }))
    }

    fn read_head(&mut self, comment: &[u8]) -> Result<(), Damage> {
        let Some((key, value)) = comment.strip_prefix(b"$").and_then(|keyed| {
            let place = keyed.iter().position(|octet| *octet == b'=')?;
            Some((keyed.get(..place)?, keyed.get(place + 1..)?.trim_ascii()))
        }) else {
            return Ok(());
        };
        match key {
            b"FILEVERSION" => {
                self.columns = match value {
                    b"1.1" => Some(VERSION_1_1),
                    b"1.2" => Some(VERSION_1_2),
                    b"1.3" => Some(VERSION_1_3),
                    // They say their columns themselves.
                    b"2.0" | b"2.1" => None,
                    _ => return Err(Damage::Version),
                };
            }
            b"STARTTIME" => {
                // PCAN-Explorer 5 writes a semicolon behind it.
                let days = value.strip_suffix(b";").unwrap_or(value);
                self.begin = start_time(days).ok_or(Damage::Date)?;
            }
            b"COLUMNS" => self.columns = Some(columns(value).ok_or(Damage::Head)?),
            _ => {}
        }
        Ok(())
    }
}

/// The moment that so many days after 1899-12-30 are.
fn start_time(days: &[u8]) -> Option<Timestamp> {
    let mut parts = days.splitn(2, |octet| *octet == b'.');
    let whole = u128::from(parse_decimal(parts.next()?)?);
    let fraction = match parts.next() {
        Some(digits) => {
            let digits = digits.get(..digits.len().min(DECIMALS as usize)).unwrap_or_default();
            let used = digits.len() as u32;
            u128::from(parse_decimal(digits)?) * 10_u128.pow(DECIMALS - used)
        }
        None => 0,
    };
    let nanos = whole.checked_sub(EPOCH_DAYS)?.checked_mul(DAY)?;
    let nanos = nanos.checked_add(fraction * DAY / 10_u128.pow(DECIMALS))?;
    Some(Timestamp::from_nanos(u64::try_from(nanos).ok()?))
}

/// The columns that `N,O,T,B,I,d,R,L,D` names.
fn columns(text: &[u8]) -> Option<Columns> {
    let place = |name: &[u8]| text.split(|octet| *octet == b',').position(|word| word == name);
    let columns = Columns {
        offset: place(b"O")?,
        kind: Some(place(b"T")?),
        bus: place(b"B"),
        identifier: place(b"I")?,
        direction: place(b"d")?,
        length: place(b"L").or_else(|| place(b"l"))?,
        data: place(b"D")?,
    };
    (columns.data < 16).then_some(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_start_time_keeps_its_nanoseconds() {
        for nanos in [0, 1, 86_399_999_999_999, 1_795_334_400_123_456_789] {
            let mut out = Vec::new();
            head(&mut out, Timestamp::from_nanos(nanos), &[]);
            let text = String::from_utf8(out).unwrap();
            let line = text.lines().find(|line| line.starts_with(";$STARTTIME=")).unwrap();
            let days = line.trim_start_matches(";$STARTTIME=").as_bytes();
            assert_eq!(start_time(days), Some(Timestamp::from_nanos(nanos)), "{line}");
        }
    }
}

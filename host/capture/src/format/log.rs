//! `.log`: `(1234567890.123456) can0 42B#0A8E00100000`, as `candump -L` writes it.

use codewheel_station::can::{Frame, Identifier};

use crate::hex::{parse_hex, parse_octet, parse_scaled, push_decimal, push_hex, push_octets};
use crate::lines::words;
use crate::reader::{Buses, Damage, Found, Head, HeadContent};
use crate::{Bus, Condition, Content, Direction, Medium, Record, Timestamp};

/// The bits of an eight-digit identifier that say it is none of a frame: error frames.
const ERROR_FRAME: u32 = 0x2000_0000;
const EXTENDED: u32 = 0x1FFF_FFFF;

pub(crate) fn record(out: &mut Vec<u8>, buses: &[Bus], record: &Record<'_>) {
    let Some(bus) = buses.get(usize::from(record.bus)) else { return };
    let micros = record.at.as_nanos() / 1_000;
    out.push(b'(');
    push_decimal(out, micros / 1_000_000, 10);
    out.push(b'.');
    push_decimal(out, micros % 1_000_000, 6);
    out.extend_from_slice(b") ");
    out.extend_from_slice(bus.name.as_bytes());
    out.push(b' ');
    match record.content {
        Content::Frame(frame) => push_frame(out, &frame),
        Content::Telegram { octets, .. } => push_octets(out, octets, b" "),
    }
    if record.direction == Direction::Sent {
        out.extend_from_slice(b" T");
    }
    if let Content::Telegram { condition: Condition::Broken, .. } = record.content {
        out.extend_from_slice(b" !");
    }
    out.push(b'\n');
}

/// Appends a frame as candump writes it: `42B#0A8E`, `7FF#R4`.
pub(crate) fn push_frame(out: &mut Vec<u8>, frame: &Frame) {
    match frame.identifier() {
        Identifier::Standard(bits) => push_hex(out, bits.into(), 3),
        Identifier::Extended(bits) => push_hex(out, bits, 8),
    }
    out.push(b'#');
    if frame.is_remote() {
        out.push(b'R');
        push_decimal(out, frame.length() as u64, 1);
    } else {
        push_octets(out, frame.data(), b"");
    }
}

/// Reads one line.
pub(crate) fn read(line: &[u8], octets: &mut Vec<u8>, buses: &mut Buses) -> Result<Found, Damage> {
    let mut words = words(line);
    let Some(time) = words.next() else { return Ok(Found::Nothing) };
    let time = time
        .strip_prefix(b"(")
        .and_then(|time| time.strip_suffix(b")"))
        .and_then(|time| parse_scaled(time, 9))
        .ok_or(Damage::Time)?;
    let at = Timestamp::from_nanos(time);
    let name = words.next().ok_or(Damage::Short)?;
    let first = words.next().ok_or(Damage::Short)?;
    if first.contains(&b'#') {
        let Some(frame) = frame(first)? else { return Ok(Found::Skipped) };
        let direction = match words.next() {
            None | Some(b"R" | b"r") => Direction::Received,
            Some(b"T" | b"t") => Direction::Sent,
            Some(_) => return Err(Damage::Direction),
        };
        let bus = buses.named(name, Medium::DeviceNet)?;
        return Ok(Found::Record(Head { at, bus, direction, content: HeadContent::Frame(frame) }));
    }
    octets.clear();
    let mut direction = Direction::Received;
    let mut condition = Condition::Intact;
    for word in std::iter::once(first).chain(words) {
        match word {
            b"T" => direction = Direction::Sent,
            b"!" => condition = Condition::Broken,
            _ => octets.push(parse_octet(word).ok_or(Damage::Octet)?),
        }
    }
    if octets.is_empty() || octets.len() > 255 {
        return Err(Damage::Length);
    }
    let bus = buses.named(name, Medium::Profibus)?;
    let content = HeadContent::Telegram(condition);
    Ok(Found::Record(Head { at, bus, direction, content }))
}

/// The frame that candump wrote; `None` for an error frame, which is no traffic.
fn frame(word: &[u8]) -> Result<Option<Frame>, Damage> {
    let hash = word.iter().position(|octet| *octet == b'#').ok_or(Damage::Identifier)?;
    let (identifier, data) = word.split_at(hash);
    let data = data.get(1..).unwrap_or_default();
    let bits = parse_hex(identifier).ok_or(Damage::Identifier)?;
    let identifier = match identifier.len() {
        3 => Identifier::Standard(bits as u16),
        8 if bits & ERROR_FRAME != 0 && bits > EXTENDED => return Ok(None),
        8 => Identifier::Extended(bits),
        _ => return Err(Damage::Identifier),
    };
    if data.first() == Some(&b'#') {
        return Err(Damage::CanFd);
    }
    if let [b'R' | b'r', length @ ..] = data {
        let length = if length.is_empty() { Some(0) } else { parse_hex(length) };
        let length = length.ok_or(Damage::Length)? as usize;
        return Frame::remote(identifier, length).map(Some).map_err(Damage::from);
    }
    let mut octets = [0; 8];
    let mut length = 0;
    let mut rest = data;
    while let [high, low, behind @ ..] = rest {
        let octet = parse_octet(&[*high, *low]).ok_or(Damage::Octet)?;
        *octets.get_mut(length).ok_or(Damage::Length)? = octet;
        length += 1;
        // Candump can write dots between the octets.
        rest = behind.strip_prefix(b".").unwrap_or(behind);
    }
    if !rest.is_empty() {
        return Err(Damage::Octet);
    }
    let octets = octets.get(..length).unwrap_or_default();
    Frame::new(identifier, octets).map(Some).map_err(Damage::from)
}

//! `.pcapng` of Wireshark (IETF draft-ietf-opsawg-pcapng): one interface a bus.
//!
//! The few blocks are read and written here: where a file is damaged, its reader must say at which
//! octet, and give what stood before.

use std::io::{self, BufRead, Read};

use codewheel_station::can::{Frame, Identifier};

use super::Counts;
use crate::reader::{Buses, Damage, Found, Head, HeadContent};
use crate::{Bus, Condition, Content, Direction, Medium, Record, Timestamp};

const SECTION: u32 = 0x0A0D_0D0A;
const INTERFACE: u32 = 1;
const OLD_PACKET: u32 = 2;
const SIMPLE_PACKET: u32 = 3;
const STATISTICS: u32 = 5;
const PACKET: u32 = 6;
const BYTE_ORDER: u32 = 0x1A2B_3C4D;

/// LINKTYPE_CAN_SOCKETCAN.
const CAN: u16 = 227;
/// LINKTYPE_USER0, ours for telegrams.
const USER0: u16 = 147;

const OPTION_NAME: u16 = 2;
const OPTION_DESCRIPTION: u16 = 3;
const OPTION_SPEED: u16 = 8;
const OPTION_RESOLUTION: u16 = 9;
const OPTION_TIME_OFFSET: u16 = 14;
const OPTION_APPLICATION: u16 = 4;
const OPTION_PACKET_FLAGS: u16 = 2;
const OPTION_RECEIVED: u16 = 4;
const OPTION_DROPPED: u16 = 5;

/// Packet flags: bits 0 and 1.
const INBOUND: u32 = 1;
const OUTBOUND: u32 = 2;
/// Packet flags: "symbol error", which is what a broken character is.
const SYMBOL_ERROR: u32 = 1 << 31;

const EXTENDED: u32 = 0x8000_0000;
const REMOTE: u32 = 0x4000_0000;
const ERROR: u32 = 0x2000_0000;
/// The frame flags of link type 227: CAN FD.
const FD: u8 = 0x04;

/// The longest block that is looked at.
const LONGEST: u32 = 1 << 20;

pub(crate) fn head(out: &mut Vec<u8>, buses: &[Bus]) {
    block(out, SECTION, |body| {
        body.extend_from_slice(&BYTE_ORDER.to_le_bytes());
        body.extend_from_slice(&[1, 0, 0, 0]);
        // The length of the section is not known.
        body.extend_from_slice(&u64::MAX.to_le_bytes());
        let program = concat!("codewheel ", env!("CARGO_PKG_VERSION"));
        option(body, OPTION_APPLICATION, program.as_bytes());
        option(body, 0, &[]);
    });
    for bus in buses {
        block(out, INTERFACE, |body| {
            let link = match bus.medium {
                Medium::DeviceNet => CAN,
                Medium::Profibus => USER0,
            };
            body.extend_from_slice(&link.to_le_bytes());
            body.extend_from_slice(&[0; 6]);
            option(body, OPTION_NAME, bus.name.as_bytes());
            option(body, OPTION_DESCRIPTION, bus.medium.to_string().as_bytes());
            if let Some(rate) = bus.bits_per_second {
                option(body, OPTION_SPEED, &u64::from(rate).to_le_bytes());
            }
            option(body, OPTION_RESOLUTION, &[9]);
            option(body, 0, &[]);
        });
    }
}

pub(crate) fn record(out: &mut Vec<u8>, record: &Record<'_>) {
    let mut can = [0; 16];
    let (octets, broken) = match &record.content {
        Content::Frame(frame) => (can_packet(frame, &mut can), false),
        Content::Telegram { octets, condition } => (*octets, *condition == Condition::Broken),
    };
    let direction = match record.direction {
        Direction::Received => INBOUND,
        Direction::Sent => OUTBOUND,
    };
    block(out, PACKET, |body| {
        let nanos = record.at.as_nanos();
        body.extend_from_slice(&u32::from(record.bus).to_le_bytes());
        body.extend_from_slice(&((nanos >> 32) as u32).to_le_bytes());
        body.extend_from_slice(&(nanos as u32).to_le_bytes());
        body.extend_from_slice(&(octets.len() as u32).to_le_bytes());
        body.extend_from_slice(&(octets.len() as u32).to_le_bytes());
        body.extend_from_slice(octets);
        pad(body, octets.len());
        let flags = direction | if broken { SYMBOL_ERROR } else { 0 };
        option(body, OPTION_PACKET_FLAGS, &flags.to_le_bytes());
        option(body, 0, &[]);
    });
}

pub(crate) fn tail(out: &mut Vec<u8>, at: Timestamp, counts: &[Counts]) {
    for (counts, bus) in counts.iter().zip(0_u32..) {
        block(out, STATISTICS, |body| {
            body.extend_from_slice(&bus.to_le_bytes());
            body.extend_from_slice(&((at.as_nanos() >> 32) as u32).to_le_bytes());
            body.extend_from_slice(&(at.as_nanos() as u32).to_le_bytes());
            option(body, OPTION_RECEIVED, &(counts.written + counts.lost).to_le_bytes());
            option(body, OPTION_DROPPED, &counts.lost.to_le_bytes());
            option(body, 0, &[]);
        });
    }
}

fn can_packet<'a>(frame: &Frame, octets: &'a mut [u8; 16]) -> &'a [u8] {
    let bits = match frame.identifier() {
        Identifier::Standard(bits) => bits.into(),
        Identifier::Extended(bits) => bits | EXTENDED,
    };
    let bits: u32 = if frame.is_remote() { bits | REMOTE } else { bits };
    let head = bits.to_be_bytes().into_iter().chain([frame.length() as u8, 0, 0, 0]);
    let mut used = 0;
    for (to, from) in octets.iter_mut().zip(head.chain(frame.data().iter().copied())) {
        *to = from;
        used += 1;
    }
    octets.get(..used).unwrap_or_default()
}

fn block(out: &mut Vec<u8>, kind: u32, body: impl FnOnce(&mut Vec<u8>)) {
    let begin = out.len();
    out.extend_from_slice(&kind.to_le_bytes());
    out.extend_from_slice(&[0; 4]);
    body(out);
    let length = (out.len() - begin + 4) as u32;
    out.extend_from_slice(&length.to_le_bytes());
    if let Some(place) = out.get_mut(begin + 4..begin + 8) {
        place.copy_from_slice(&length.to_le_bytes());
    }
}

fn option(out: &mut Vec<u8>, code: u16, value: &[u8]) {
    out.extend_from_slice(&code.to_le_bytes());
    out.extend_from_slice(&(value.len() as u16).to_le_bytes());
    out.extend_from_slice(value);
    pad(out, value.len());
}

fn pad(out: &mut Vec<u8>, length: usize) {
    out.resize(out.len() + length.wrapping_neg() % 4, 0);
}

/// What a section says of itself and its interfaces.
#[derive(Debug)]
pub(crate) struct Parser {
    big_endian: bool,
    interfaces: Vec<Interface>,
    buffer: Vec<u8>,
    /// Where the block begins that was read last.
    offset: u64,
    next: u64,
}

#[derive(Clone, Copy, Debug)]
struct Interface {
    /// `None` for a link type that is none of ours.
    bus: Option<(u16, Medium)>,
    /// Option if_tsresol.
    resolution: u8,
    /// Option if_tsoffset, in seconds.
    offset: i64,
}

impl Parser {
    pub(crate) const fn new() -> Self {
        Self { big_endian: false, interfaces: Vec::new(), buffer: Vec::new(), offset: 0, next: 0 }
    }

    /// Where the block begins that was read last, in octets from the beginning of the file.
    pub(crate) const fn offset(&self) -> u64 {
        self.offset
    }

    /// Reads the next block; `None` at the end of the file. After a damage, what follows has no
    /// meaning.
    pub(crate) fn read(
        &mut self,
        source: &mut impl BufRead,
        octets: &mut Vec<u8>,
        buses: &mut Buses,
    ) -> io::Result<Result<Option<Found>, Damage>> {
        self.offset = self.next;
        let mut head = [0; 12];
        match fill(source, &mut head)? {
            0 => return Ok(Ok(None)),
            12 => {}
            _ => return Ok(Err(Damage::Truncated)),
        }
        let [a, b, c, d, length @ .., e, f, g, h] = head;
        let (kind, third) = ([a, b, c, d], [e, f, g, h]);
        // The type of a section block reads the same in both orders; the word behind tells which.
        if u32::from_le_bytes(kind) == SECTION {
            self.big_endian = match (u32::from_le_bytes(third), u32::from_be_bytes(third)) {
                (BYTE_ORDER, _) => false,
                (_, BYTE_ORDER) => true,
                _ => return Ok(Err(Damage::NoPcapng)),
            };
            self.interfaces.clear();
        } else if self.offset == 0 {
            return Ok(Err(Damage::NoPcapng));
        }
        let length = self.u32(length);
        if !(12..=LONGEST).contains(&length) || !length.is_multiple_of(4) {
            return Ok(Err(Damage::Block));
        }
        self.buffer.clear();
        // The first word of the body has been read with the head; a block of 12 octets has none.
        let rest = u64::from(length) - 12;
        if rest > 0 {
            self.buffer.extend_from_slice(&third);
        }
        if source.by_ref().take(rest).read_to_end(&mut self.buffer)? as u64 != rest {
            return Ok(Err(Damage::Truncated));
        }
        self.next = self.offset + u64::from(length);
        let end = match self.buffer.split_last_chunk::<4>() {
            Some((_, end)) => *end,
            None => third,
        };
        if self.u32(end) != length {
            return Ok(Err(Damage::Block));
        }
        let body = self.buffer.len().saturating_sub(4);
        Ok(match self.u32(kind) {
            INTERFACE => self.interface(body, buses).map(|()| Some(Found::Nothing)),
            PACKET => self.packet(body, octets).map(Some),
            // Packets without a time, or of an older draft: traffic, which nobody writes any more.
            SIMPLE_PACKET | OLD_PACKET => Ok(Some(Found::Skipped)),
            _ => Ok(Some(Found::Nothing)),
        })
    }

    fn interface(&mut self, end: usize, buses: &mut Buses) -> Result<(), Damage> {
        let body = self.buffer.get(..end).unwrap_or_default();
        let link = self.u16_at(body, 0)?;
        let mut interface = Interface { bus: None, resolution: 6, offset: 0 };
        let (mut name, mut rate) = (None, None);
        for (code, value) in self.options(body.get(8..).ok_or(Damage::Short)?) {
            match (code, value) {
                (OPTION_NAME, name_octets) => name = Some(name_octets),
                (OPTION_SPEED, &[a, b, c, d, e, f, g, h]) => {
                    let speed = self.u64([a, b, c, d, e, f, g, h]);
                    rate = u32::try_from(speed).ok().filter(|rate| *rate > 0);
                }
                (OPTION_RESOLUTION, &[resolution]) => interface.resolution = resolution,
                (OPTION_TIME_OFFSET, &[a, b, c, d, e, f, g, h]) => {
                    interface.offset = self.u64([a, b, c, d, e, f, g, h]).cast_signed();
                }
                _ => {}
            }
        }
        let medium = match link {
            CAN => Some(Medium::DeviceNet),
            USER0 => Some(Medium::Profibus),
            _ => None,
        };
        if let Some(medium) = medium {
            interface.bus = Some((buses.add(name, medium, rate)?, medium));
        }
        self.interfaces.push(interface);
        Ok(())
    }

    fn packet(&self, end: usize, telegram: &mut Vec<u8>) -> Result<Found, Damage> {
        let body = self.buffer.get(..end).unwrap_or_default();
        let interface = self.u32_at(body, 0)? as usize;
        let interface = self.interfaces.get(interface).ok_or(Damage::Bus)?;
        let ticks = u64::from(self.u32_at(body, 4)?) << 32 | u64::from(self.u32_at(body, 8)?);
        let captured = self.u32_at(body, 12)? as usize;
        let octets = body.get(20..).and_then(|rest| rest.get(..captured)).ok_or(Damage::Short)?;
        let padded = captured.next_multiple_of(4);
        let mut flags = 0;
        for (code, value) in self.options(body.get(20 + padded..).unwrap_or_default()) {
            if let (OPTION_PACKET_FLAGS, &[a, b, c, d]) = (code, value) {
                flags = self.u32([a, b, c, d]);
            }
        }
        let Some((bus, medium)) = interface.bus else { return Ok(Found::Skipped) };
        let at = interface.moment(ticks).ok_or(Damage::Time)?;
        let direction = if flags & 3 == OUTBOUND { Direction::Sent } else { Direction::Received };
        let content = match medium {
            Medium::DeviceNet => match frame(octets)? {
                Some(frame) => HeadContent::Frame(frame),
                None => return Ok(Found::Skipped),
            },
            Medium::Profibus => {
                if octets.is_empty() || octets.len() > 255 {
                    return Err(Damage::Length);
                }
                let broken = flags & SYMBOL_ERROR != 0;
                let condition = if broken { Condition::Broken } else { Condition::Intact };
                telegram.clear();
                telegram.extend_from_slice(octets);
                HeadContent::Telegram(condition)
            }
        };
        Ok(Found::Record(Head { at, bus, direction, content }))
    }

    /// The options of a block; what is cut short ends them.
    fn options<'a>(&self, octets: &'a [u8]) -> impl Iterator<Item = (u16, &'a [u8])> {
        let big_endian = self.big_endian;
        let word = move |octets: [u8; 2]| match big_endian {
            true => u16::from_be_bytes(octets),
            false => u16::from_le_bytes(octets),
        };
        let mut rest = octets;
        std::iter::from_fn(move || {
            let &[a, b, c, d, ref behind @ ..] = rest else { return None };
            let (code, length) = (word([a, b]), usize::from(word([c, d])));
            if code == 0 {
                return None;
            }
            let value = behind.get(..length)?;
            rest = behind.get(length.next_multiple_of(4)..).unwrap_or_default();
            Some((code, value))
        })
    }

    fn u16_at(&self, octets: &[u8], at: usize) -> Result<u16, Damage> {
        let octets = octets.get(at..).and_then(<[u8]>::first_chunk).ok_or(Damage::Short)?;
        Ok(if self.big_endian { u16::from_be_bytes(*octets) } else { u16::from_le_bytes(*octets) })
    }

    fn u32_at(&self, octets: &[u8], at: usize) -> Result<u32, Damage> {
        let octets = octets.get(at..).and_then(<[u8]>::first_chunk).ok_or(Damage::Short)?;
        Ok(self.u32(*octets))
    }

    const fn u32(&self, octets: [u8; 4]) -> u32 {
        if self.big_endian { u32::from_be_bytes(octets) } else { u32::from_le_bytes(octets) }
    }

    const fn u64(&self, octets: [u8; 8]) -> u64 {
        if self.big_endian { u64::from_be_bytes(octets) } else { u64::from_le_bytes(octets) }
    }
}

impl Interface {
    fn moment(&self, ticks: u64) -> Option<Timestamp> {
        let second = 1_000_000_000_u128;
        let exponent = u32::from(self.resolution & 0x7F);
        let nanos = if self.resolution & 0x80 == 0 {
            u128::from(ticks) * second / 10_u128.checked_pow(exponent)?
        } else {
            (u128::from(ticks) * second).checked_shr(exponent)?
        };
        let offset = i128::from(self.offset) * second.cast_signed();
        let nanos = i128::try_from(nanos).ok()?.checked_add(offset)?;
        Some(Timestamp::from_nanos(u64::try_from(nanos).ok()?))
    }
}

/// The frame of a packet of link type 227; `None` for an error frame.
fn frame(octets: &[u8]) -> Result<Option<Frame>, Damage> {
    let &[a, b, c, d, length, flags, _, _, ref data @ ..] = octets else {
        return Err(Damage::Short);
    };
    let bits = u32::from_be_bytes([a, b, c, d]);
    if bits & ERROR != 0 {
        return Ok(None);
    }
    if flags & FD != 0 {
        return Err(Damage::CanFd);
    }
    let identifier = if bits & EXTENDED == 0 {
        Identifier::Standard(u16::try_from(bits & 0x1FFF_FFFF).map_err(|_| Damage::Identifier)?)
    } else {
        Identifier::Extended(bits & 0x1FFF_FFFF)
    };
    let length = usize::from(length);
    if bits & REMOTE != 0 {
        return Ok(Some(Frame::remote(identifier, length)?));
    }
    let data = data.get(..length).ok_or(Damage::Short)?;
    Ok(Some(Frame::new(identifier, data)?))
}

/// Reads until `octets` are full or the file ends, and says how many were read.
fn fill(source: &mut impl BufRead, octets: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while let Some(rest) = octets.get_mut(filled..).filter(|rest| !rest.is_empty()) {
        match source.read(rest) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

//! The kept record: what a device knows again after a power cut, as octets.
//!
//! Numbers are little endian. Every version begins and ends alike, so that an older program can
//! tell a newer record from a damaged one.
//!
//! | octet | length | content |
//! |---|---|---|
//! | 0 | 4 | magic, `CWKR` |
//! | 4 | 2 | version, 1 |
//! | 6 | 2 | length of the record in octets, CRC included: 92 |
//! | 8 | 4 | sequence; of two records the higher one is newer, wrapping |
//! | 12 | 2 | fingerprint of the product |
//! | 14 | 1 | direction: 0 CW, 1 CCW |
//! | 15 | 1 | bit 0 scaling on, bit 1 a reference follows; others 0 |
//! | 16 | 4 | n, steps per turn |
//! | 20 | 4 | T, total resolution |
//! | 24 | 4 | preset |
//! | 28 | 4 | offset, signed |
//! | 32 | 8 | k₀, crossings at the last change of the settings, signed |
//! | 40 | 4 | COS delta |
//! | 44 | 8 | k of the reference, signed; 0 without one |
//! | 52 | 4 | r of the reference; 0 without one |
//! | 56 | 4 | serial number |
//! | 60 | 4 | write count |
//! | 64 | 24 | of the bus |
//! | 88 | 4 | CRC-32 (IEEE 802.3) of everything before it |

use core::fmt;

use codewheel_station::{Full, Reader, Short, Writer};
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use crate::{Block, Direction, Reference, Settings};

/// The length of a record in octets.
pub const RECORD_OCTETS: usize = 92;

const MAGIC: [u8; 4] = *b"CWKR";
const VERSION: u16 = 1;
const CRC_OCTETS: usize = 4;

const SCALING: u8 = 0b01;
const REFERENCE: u8 = 0b10;

/// Without a table: a record is rare and 92 octets short, a kilobyte of flash is neither.
const CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// What a device keeps over a power cut.
///
/// Address, baud rate and termination are switches and not in here. Automatic writes carry the
/// saved block, never an unsaved setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Which product the record belongs to; chosen and compared by the floor above.
    pub fingerprint: u16,
    /// The saved settings block, not the one in force.
    pub saved: Block,
    /// Where the shaft stood, where the saved block [needs it](Block::needs_reference).
    pub reference: Option<Reference>,
    /// The serial number of the device.
    pub serial: u32,
    /// How often a record has been written: the memory is good for 1 million (PROFIBUS manual
    /// §7.4).
    pub writes: u32,
    /// What the bus keeps (connection paths, intervals …); opaque to the encoder.
    pub bus: [u8; 24],
}

/// Why octets are no record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// The octets end before the record does.
    Short,
    /// They do not begin with the magic of a record.
    Magic,
    /// The CRC-32 does not match: a write was interrupted, or the memory is worn.
    Checksum,
    /// The record is whole, but of this version, which this program does not know.
    Version(u16),
    /// The record is whole, but a field holds what no version 1 program writes.
    Content,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Short => f.write_str("the octets end before the record does"),
            Self::Magic => f.write_str("the octets do not begin like a record"),
            Self::Checksum => f.write_str("the checksum of the record does not match"),
            Self::Version(version) => {
                write!(f, "the record has version {version}, this program knows {VERSION}")
            }
            Self::Content => f.write_str("a field of the record holds an impossible value"),
        }
    }
}

impl core::error::Error for Damage {}

impl From<Short> for Damage {
    fn from(_: Short) -> Self {
        Self::Short
    }
}

/// The record of `kept`, ready to be written to a slot; `sequence` as [`Start::next`] says, then
/// one more with every write.
///
/// [`Start::next`]: crate::Start::next
#[must_use]
pub fn encode(kept: &Kept, sequence: u32) -> [u8; RECORD_OCTETS] {
    let mut octets = [0; RECORD_OCTETS];
    // The layout is as long as the array, which the tests hold; a field never fails to fit.
    let _ = write(&mut Writer::new(&mut octets), kept, sequence);
    octets
}

fn write(record: &mut Writer<'_>, kept: &Kept, sequence: u32) -> Result<(), Full> {
    let Block { settings, preset, offset, crossings_at_change, cos_delta } = kept.saved;
    let reference = kept.reference.unwrap_or(Reference { crossings: 0, code: 0 });
    let mut flags = 0;
    if settings.scaling {
        flags |= SCALING;
    }
    if kept.reference.is_some() {
        flags |= REFERENCE;
    }
    record.octets(&MAGIC)?;
    record.u16_le(VERSION)?;
    record.u16_le(RECORD_OCTETS as u16)?;
    record.u32_le(sequence)?;
    record.u16_le(kept.fingerprint)?;
    record.u8(match settings.direction {
        Direction::Cw => 0,
        Direction::Ccw => 1,
    })?;
    record.u8(flags)?;
    record.u32_le(settings.steps_per_turn)?;
    record.u32_le(settings.total_resolution)?;
    record.u32_le(preset)?;
    record.octets(&offset.to_le_bytes())?;
    record.octets(&crossings_at_change.to_le_bytes())?;
    record.u32_le(cos_delta)?;
    record.octets(&reference.crossings.to_le_bytes())?;
    record.u32_le(reference.code)?;
    record.u32_le(kept.serial)?;
    record.u32_le(kept.writes)?;
    record.octets(&kept.bus)?;
    record.u32_le(CHECKSUM.checksum(record.written()))
}

/// The record at the front of `octets` and its sequence; what follows it in the slot does not
/// matter.
///
/// Judges the structure only. Whether a product can measure with the block is for
/// [`Block::check`].
///
/// # Errors
/// [`Damage`]; no octets whatever do more harm.
pub fn decode(octets: &[u8]) -> Result<(Kept, u32), Damage> {
    let mut reader = Reader::new(octets);
    if reader.array()? != MAGIC {
        return Err(Damage::Magic);
    }
    let version = reader.u16_le()?;
    let length = usize::from(reader.u16_le()?);
    let record = octets.get(..length).ok_or(Damage::Short)?;
    let (covered, checksum) = record.split_last_chunk::<CRC_OCTETS>().ok_or(Damage::Short)?;
    if CHECKSUM.checksum(covered) != u32::from_le_bytes(*checksum) {
        return Err(Damage::Checksum);
    }
    if version != VERSION {
        return Err(Damage::Version(version));
    }
    if length != RECORD_OCTETS {
        return Err(Damage::Content);
    }
    let sequence = reader.u32_le()?;
    let kept = read(&mut reader)?;
    Ok((kept, sequence))
}

fn read(record: &mut Reader<'_>) -> Result<Kept, Damage> {
    let fingerprint = record.u16_le()?;
    let direction = match record.u8()? {
        0 => Direction::Cw,
        1 => Direction::Ccw,
        _ => return Err(Damage::Content),
    };
    let flags = record.u8()?;
    if flags & !(SCALING | REFERENCE) != 0 {
        return Err(Damage::Content);
    }
    // Fields of a struct are evaluated in the order they are written down: that of the record.
    let settings = Settings {
        direction,
        steps_per_turn: record.u32_le()?,
        total_resolution: record.u32_le()?,
        scaling: flags & SCALING != 0,
    };
    let saved = Block {
        settings,
        preset: record.u32_le()?,
        offset: i32::from_le_bytes(record.array()?),
        crossings_at_change: i64::from_le_bytes(record.array()?),
        cos_delta: record.u32_le()?,
    };
    let reference =
        Reference { crossings: i64::from_le_bytes(record.array()?), code: record.u32_le()? };
    Ok(Kept {
        fingerprint,
        saved,
        reference: (flags & REFERENCE != 0).then_some(reference),
        serial: record.u32_le()?,
        writes: record.u32_le()?,
        bus: record.array()?,
    })
}

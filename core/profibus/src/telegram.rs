//! Telegrams: octets as they stand on the line (EN 50170-2, FDL).
//!
//! | format | octets |
//! |---|---|
//! | SD1 | `10 DA SA FC FCS 16` |
//! | SD2 | `68 LE LE 68 DA SA FC DU… FCS 16`, LE = DA … DU = 4 … 249 |
//! | SD3 | `A2 DA SA FC DU×8 FCS 16` |
//! | SD4 | `DC DA SA`, the token |
//! | SC  | `E5`, the short acknowledge |
//!
//! FCS is the sum of DA … DU modulo 256. Bit 7 of DA and of SA announces an address extension, the
//! first octets of DU: DSAP and SSAP.
//!
//! [`Telegram::decode`] takes any telegram of any direction and copies nothing.
//!
//! # Panics
//! Nothing here panics on any octets.

use codewheel_station::rs485::{TRANSMISSION_OCTETS, Transmission};
use codewheel_station::{Full, Writer};

use crate::function_code::FunctionCode;

/// Start delimiter: fixed length, no data unit.
pub const SD1: u8 = 0x10;
/// Start delimiter: variable length.
pub const SD2: u8 = 0x68;
/// Start delimiter: a data unit of eight octets.
pub const SD3: u8 = 0xA2;
/// Start delimiter: token.
pub const SD4: u8 = 0xDC;
/// The short acknowledge, a telegram of its own.
pub const SC: u8 = 0xE5;
/// End delimiter of SD1, SD2 and SD3.
pub const ED: u8 = 0x16;

/// The address of all stations.
pub const BROADCAST: u8 = 127;
/// The most octets of a data unit, address extensions and all.
pub const UNIT_OCTETS: usize = 246;
/// Bit 7 of DA and SA: an address extension follows.
pub const EXTENSION: u8 = 0x80;

/// What is wrong with octets that are no telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// They begin with none of the start delimiters, or SD2 is not repeated.
    StartDelimiter,
    /// The two lengths of SD2 differ, or are not 4 … 249.
    Length,
    /// FCS is not the sum.
    Checksum,
    /// The last octet is not ED.
    EndDelimiter,
}

/// Bit 7 of only one of DA and SA is set, or the octets it announces are missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HalfExtended;

/// The two service access points of a telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Saps {
    /// DSAP, the receiver's.
    pub destination: u8,
    /// SSAP, the sender's.
    pub source: u8,
}

impl Saps {
    /// Those of the answer.
    #[must_use]
    pub const fn swapped(self) -> Self {
        Self { destination: self.source, source: self.destination }
    }
}

/// The format of a telegram that carries a function code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// SD1: no data unit.
    Short,
    /// SD2: a data unit of 1 … 246 octets.
    Variable,
    /// SD3: a data unit of eight octets.
    Eight,
}

/// A telegram of any station.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Telegram<'a> {
    /// SD1, SD2 or SD3: a request or an answer.
    Data(Data<'a>),
    /// SD4: a master hands the token on.
    Token {
        /// DA, the next master.
        destination: u8,
        /// SA, the last one.
        source: u8,
    },
    /// SC: acknowledged, without data.
    ShortAcknowledge,
}

/// A request or an answer: SD1, SD2 or SD3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Data<'a> {
    format: Format,
    destination: u8,
    source: u8,
    function_code: FunctionCode,
    unit: &'a [u8],
}

/// How many octets a telegram has that begins with these; `None` where they do not tell yet.
///
/// # Errors
/// [`Damage`]: no telegram begins like this.
#[inline]
pub fn length_of(octets: &[u8]) -> Result<Option<usize>, Damage> {
    let Some(start) = octets.first() else { return Ok(None) };
    match *start {
        SD2 => {
            let length = match *octets {
                [_, length, repeated, SD2, ..] if length == repeated => length,
                [_, length, repeated, _, ..] if length == repeated => {
                    return Err(Damage::StartDelimiter);
                }
                [_, length, repeated, ..] if length != repeated => return Err(Damage::Length),
                [_, length, ..] => length,
                _ => return Ok(None),
            };
            match length {
                4..=249 if octets.len() >= 4 => Ok(Some(usize::from(length) + 6)),
                4..=249 => Ok(None),
                _ => Err(Damage::Length),
            }
        }
        SD1 => Ok(Some(6)),
        SD3 => Ok(Some(14)),
        SD4 => Ok(Some(3)),
        SC => Ok(Some(1)),
        _ => Err(Damage::StartDelimiter),
    }
}

impl<'a> Telegram<'a> {
    /// The telegram that `octets` begin with; `None` while it is not complete. What follows it is
    /// not looked at: [`length`](Self::length) says where that begins.
    ///
    /// # Errors
    /// [`Damage`]: they are no telegram, however many octets follow.
    #[inline]
    pub fn decode(octets: &'a [u8]) -> Result<Option<Self>, Damage> {
        // Data_Exchange first: what a slave gets most.
        if let [SD2, length @ 4..=249, repeated, SD2, rest @ ..] = octets
            && length == repeated
        {
            let Some((body, [sum, end, ..])) = rest.split_at_checked(usize::from(*length)) else {
                return Ok(None);
            };
            return Data::decode(Format::Variable, body, *sum, *end);
        }
        Self::decode_other(octets)
    }

    /// Anything but an SD2 of which the first four octets are there and good.
    #[inline(never)]
    fn decode_other(octets: &'a [u8]) -> Result<Option<Self>, Damage> {
        let Some(length) = length_of(octets)? else { return Ok(None) };
        let Some(octets) = octets.get(..length) else { return Ok(None) };
        match *octets {
            [SD1, ref body @ .., sum, end] => Data::decode(Format::Short, body, sum, end),
            [SD3, ref body @ .., sum, end] => Data::decode(Format::Eight, body, sum, end),
            [SD4, destination, source] => Ok(Some(Self::Token { destination, source })),
            _ => Ok(Some(Self::ShortAcknowledge)),
        }
    }

    /// How many octets it has on the line, 1 … 255.
    #[must_use]
    pub const fn length(&self) -> usize {
        match self {
            Self::Data(data) => data.length(),
            Self::Token { .. } => 3,
            Self::ShortAcknowledge => 1,
        }
    }

    /// Appends the octets.
    ///
    /// # Errors
    /// [`Full`] where they do not fit.
    pub fn encode(&self, out: &mut Writer<'_>) -> Result<(), Full> {
        match self {
            Self::Data(data) => data.encode(out),
            Self::Token { destination, source } => out.octets(&[SD4, *destination, *source]),
            Self::ShortAcknowledge => out.u8(SC),
        }
    }

    /// The octets, ready to be sent.
    #[must_use]
    pub fn transmission(&self) -> Option<Transmission> {
        let mut buffer = [0; TRANSMISSION_OCTETS];
        let mut out = Writer::new(&mut buffer);
        self.encode(&mut out).ok()?;
        Transmission::new(out.written())
    }
}

impl<'a> Data<'a> {
    /// A telegram of SD1, or of SD2 where there is a data unit; `None` where that has more than
    /// [`UNIT_OCTETS`]. `destination` and `source` are DA and SA with their bit 7, and `unit` holds
    /// the extensions they announce.
    #[must_use]
    pub const fn new(
        destination: u8,
        source: u8,
        function_code: FunctionCode,
        unit: &'a [u8],
    ) -> Option<Self> {
        let format = match unit.len() {
            0 => Format::Short,
            1..=UNIT_OCTETS => Format::Variable,
            _ => return None,
        };
        Some(Self { format, destination, source, function_code, unit })
    }

    /// The same as SD3; `None` where the data unit has not eight octets.
    #[must_use]
    pub const fn as_eight(self) -> Option<Self> {
        match self.unit.len() {
            8 => Some(Self { format: Format::Eight, ..self }),
            _ => None,
        }
    }

    #[inline]
    fn decode(
        format: Format,
        body: &'a [u8],
        checksum: u8,
        end: u8,
    ) -> Result<Option<Telegram<'a>>, Damage> {
        let [destination, source, function_code, unit @ ..] = body else {
            return Err(Damage::Length);
        };
        let head = destination.wrapping_add(*source).wrapping_add(*function_code);
        if sum(head, unit) != checksum {
            return Err(Damage::Checksum);
        }
        if end != ED {
            return Err(Damage::EndDelimiter);
        }
        Ok(Some(Telegram::Data(Self {
            format,
            destination: *destination,
            source: *source,
            function_code: FunctionCode(*function_code),
            unit,
        })))
    }

    /// Its format.
    #[must_use]
    pub const fn format(&self) -> Format {
        self.format
    }

    /// The station it is for, 0 … 127.
    #[inline]
    #[must_use]
    pub const fn destination(&self) -> u8 {
        self.destination & !EXTENSION
    }

    /// The station it is from, 0 … 127.
    #[inline]
    #[must_use]
    pub const fn source(&self) -> u8 {
        self.source & !EXTENSION
    }

    /// FC.
    #[inline]
    #[must_use]
    pub const fn function_code(&self) -> FunctionCode {
        self.function_code
    }

    /// The service access points; `None` where neither address is extended.
    ///
    /// # Errors
    /// [`HalfExtended`].
    #[inline]
    pub const fn saps(&self) -> Result<Option<Saps>, HalfExtended> {
        match ((self.destination | self.source) & EXTENSION, self.unit) {
            (0, _) => Ok(None),
            (_, &[destination, source, ..]) if self.destination & self.source & EXTENSION != 0 => {
                Ok(Some(Saps { destination, source }))
            }
            _ => Err(HalfExtended),
        }
    }

    /// The whole data unit, DU, with the address extensions it begins with.
    #[inline]
    #[must_use]
    pub const fn unit(&self) -> &'a [u8] {
        self.unit
    }

    /// The data unit behind the service access points.
    #[inline]
    #[must_use]
    pub fn data(&self) -> &'a [u8] {
        match self.saps() {
            Ok(Some(_)) => self.unit.get(2..).unwrap_or_default(),
            _ => self.unit,
        }
    }

    /// How many octets it has on the line, 6 … 255.
    #[inline]
    pub(crate) const fn length(&self) -> usize {
        match self.format {
            Format::Short => 6,
            Format::Variable => self.unit.len() + 9,
            Format::Eight => 14,
        }
    }

    fn encode(&self, out: &mut Writer<'_>) -> Result<(), Full> {
        let before = out.len();
        let written = self.encode_parts(out);
        if written.is_err() {
            out.truncate(before);
        }
        written
    }

    fn encode_parts(&self, out: &mut Writer<'_>) -> Result<(), Full> {
        let Self { format, destination, source, function_code: FunctionCode(code), unit } = *self;
        match format {
            Format::Short => out.u8(SD1)?,
            Format::Variable => {
                let length = u8::try_from(unit.len() + 3).map_err(|_| Full)?;
                out.octets(&[SD2, length, length, SD2])?;
            }
            Format::Eight => out.u8(SD3)?,
        }
        out.octets(&[destination, source, code])?;
        out.octets(unit)?;
        let head = destination.wrapping_add(source).wrapping_add(code);
        out.octets(&[sum(head, unit), ED])
    }
}

/// The head of a request or an answer, where its data stand elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Head {
    /// DA, 0 … 127.
    pub destination: u8,
    /// SA, 0 … 127.
    pub source: u8,
    /// FC.
    pub function_code: FunctionCode,
    /// DSAP and SSAP.
    pub saps: Option<Saps>,
}

/// Where the data of an SD2 telegram begin that has no service access points.
const DATA_AT: usize = 7;

impl Head {
    /// The telegram of this head and these data: SD1 where neither service access points nor data
    /// are to be carried, otherwise SD2. `None` for more than 246 octets, or 244 with service
    /// access points.
    #[must_use]
    pub fn transmission(&self, data: &[u8]) -> Option<Transmission> {
        let mut buffer = [0; TRANSMISSION_OCTETS];
        let mut out = Writer::new(&mut buffer);
        self.encode(data, &mut out).ok()?;
        Transmission::new(out.written())
    }

    /// Appends the telegram of this head and these data, as
    /// [`transmission`](Self::transmission) makes it.
    ///
    /// # Errors
    /// [`Full`] where it does not fit, or the data are more than a telegram carries; nothing is
    /// written.
    #[inline]
    pub fn encode(&self, data: &[u8], out: &mut Writer<'_>) -> Result<(), Full> {
        let begin = out.len();
        let written = self.encode_parts(data, out);
        if written.is_err() {
            out.truncate(begin);
        }
        written
    }

    #[inline]
    fn encode_parts(&self, data: &[u8], out: &mut Writer<'_>) -> Result<(), Full> {
        let extension = if self.saps.is_some() { EXTENSION } else { 0 };
        let (destination, source) = (self.destination | extension, self.source | extension);
        let FunctionCode(code) = self.function_code;
        let mut checksum = destination.wrapping_add(source).wrapping_add(code);
        let unit = data.len() + if self.saps.is_some() { 2 } else { 0 };
        if unit == 0 {
            return out.octets(&[SD1, destination, source, code, checksum, ED]);
        }
        let length = u8::try_from(unit + 3).ok().filter(|_| unit <= UNIT_OCTETS).ok_or(Full)?;
        out.octets(&[SD2, length, length, SD2, destination, source, code])?;
        if let Some(Saps { destination, source }) = self.saps {
            out.octets(&[destination, source])?;
            checksum = checksum.wrapping_add(destination).wrapping_add(source);
        }
        out.octets(data)?;
        out.octets(&[sum(checksum, data), ED])
    }

    /// Where the data belong that [`close`](Self::close) then puts head and tail around.
    #[inline]
    pub(crate) fn room<'a>(&self, buffer: &'a mut [u8; TRANSMISSION_OCTETS]) -> &'a mut [u8] {
        let begin = DATA_AT + if self.saps.is_some() { 2 } else { 0 };
        buffer.get_mut(begin..DATA_AT + UNIT_OCTETS).unwrap_or_default()
    }

    /// Puts head and tail around `data` octets of data that stand in their [`room`](Self::room),
    /// and says how many octets the telegram has.
    #[inline]
    pub(crate) fn close(&self, buffer: &mut [u8; TRANSMISSION_OCTETS], data: usize) -> Option<u8> {
        let unit = data + if self.saps.is_some() { 2 } else { 0 };
        let extension = if self.saps.is_some() { EXTENSION } else { 0 };
        let (destination, source) = (self.destination | extension, self.source | extension);
        let FunctionCode(code) = self.function_code;
        let head = destination.wrapping_add(source).wrapping_add(code);
        if unit == 0 {
            let short = [SD1, destination, source, code, head, ED];
            *buffer.first_chunk_mut()? = short;
            return Some(6);
        }
        let length = u8::try_from(unit + 3).ok().filter(|_| unit <= UNIT_OCTETS)?;
        *buffer.first_chunk_mut()? = [SD2, length, length, SD2, destination, source, code];
        if let Some(Saps { destination, source }) = self.saps {
            *buffer.get_mut(DATA_AT..)?.first_chunk_mut()? = [destination, source];
        }
        let tail = buffer.get_mut(DATA_AT..)?;
        let checksum = sum(head, tail.get(..unit)?);
        *tail.get_mut(unit..)?.first_chunk_mut()? = [checksum, ED];
        Some(length + 6)
    }
}

/// The sum of all octets modulo 256. Most data are four octets.
#[inline]
fn sum(begin: u8, octets: &[u8]) -> u8 {
    match *octets {
        [first, second, third, fourth] => {
            let sum = begin.wrapping_add(first).wrapping_add(second);
            sum.wrapping_add(third).wrapping_add(fourth)
        }
        _ => sum_of_any(begin, octets),
    }
}

/// By eights: a loop that the compiler widens costs more than short telegrams do.
#[inline(never)]
fn sum_of_any(begin: u8, octets: &[u8]) -> u8 {
    let (mut sum, mut rest) = (begin, octets);
    while let Some((eight, behind)) = rest.split_first_chunk() {
        sum = sum.wrapping_add(sum_of_eight(*eight));
        rest = behind;
    }
    rest.iter().fold(sum, |sum, octet| sum.wrapping_add(*octet))
}

/// All eight in one register: sums of two in 16 bits each, and their sum by a multiplication.
#[inline]
fn sum_of_eight(octets: [u8; 8]) -> u8 {
    const LOW: u64 = 0x00FF_00FF_00FF_00FF;
    let octets = u64::from_le_bytes(octets);
    let pairs = (octets & LOW) + ((octets >> 8) & LOW);
    let [.., high, _] = pairs.wrapping_mul(0x0001_0001_0001_0001).to_le_bytes();
    high
}

#[cfg(test)]
mod tests;

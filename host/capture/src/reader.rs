//! Reading a capture back, record by record.

use std::fmt;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;

use codewheel_station::can::{Frame, Invalid};
use thiserror::Error;

use crate::bus::word;
use crate::format::{MOST_BUSES, asc, log, pcapng, trc};
use crate::lines::Lines;
use crate::{Bus, Condition, Content, Direction, Format, FormatError, Medium, Record, Timestamp};

/// What is wrong at one place of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Damage {
    /// No time, or one beyond the year 2554.
    #[error("no time where one should stand")]
    Time,
    /// A date that cannot be read.
    #[error("no date that can be read")]
    Date,
    /// A line or block that ends too early.
    #[error("it ends too early")]
    Short,
    /// An identifier that is none.
    #[error("no identifier of 11 or 29 bits")]
    Identifier,
    /// An octet that is none.
    #[error("no octet of two digits where one should stand")]
    Octet,
    /// More octets than there can be, or a length that is none.
    #[error("a length that no frame or telegram has")]
    Length,
    /// Neither received nor sent.
    #[error("neither received nor sent")]
    Direction,
    /// CAN FD.
    #[error("a frame of CAN FD, which DeviceNet does not know")]
    CanFd,
    /// A bus that does not exist, or more buses than there can be.
    #[error("a bus that the file does not name, or one of more than 256")]
    Bus,
    /// A version of the format that is not known.
    #[error("a version of the format that is not known")]
    Version,
    /// The head does not say what is needed. Nothing behind it can be read.
    #[error("the head of the file does not say how to read it; a .trc has a version, 1.1 or later")]
    Head,
    /// Another format than the suffix says.
    #[error("this is no pcapng")]
    NoPcapng,
    /// A block whose lengths cannot be right. Nothing behind it can be read.
    #[error("a block whose lengths contradict each other")]
    Block,
    /// The file ends inside a block.
    #[error("the file ends inside a block")]
    Truncated,
    /// A line that is too long to be one.
    #[error("a line of more than 16384 octets")]
    Line,
    /// The last line has no end: nothing tells whether the frame has.
    #[error("the last line has no end, so it may have been cut off")]
    Cut,
}

impl Damage {
    /// Whether nothing behind it can be read: in a pcapng nothing tells where the next block begins,
    /// and without its head no line of a `.trc` has a meaning.
    const fn ends_the_file(self) -> bool {
        matches!(self, Self::Block | Self::Truncated | Self::NoPcapng | Self::Head)
    }
}

impl From<Invalid> for Damage {
    fn from(invalid: Invalid) -> Self {
        match invalid {
            Invalid::Identifier => Self::Identifier,
            Invalid::Length => Self::Length,
        }
    }
}

/// Where in a file something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The line, from 1 on.
    Line(u64),
    /// The block that begins so many octets from the beginning.
    Offset(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Offset(offset) => write!(f, "octet {offset}"),
        }
    }
}

/// Why a capture cannot be read, or not further.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The suffix says no format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The system does not give the file.
    #[error("the file cannot be read: {0}")]
    Io(#[from] io::Error),
    /// Something is wrong in the file.
    #[error("{place}: {damage}")]
    Damage {
        /// Where.
        place: Place,
        /// What.
        damage: Damage,
    },
}

impl ReadError {
    /// Whether reading on after it gives what follows.
    #[must_use]
    pub const fn is_local(&self) -> bool {
        match self {
            Self::Damage { damage, .. } => !damage.ends_the_file(),
            Self::Format(_) | Self::Io(_) => false,
        }
    }
}

/// What a line or a block turned out to be.
#[derive(Debug)]
pub(crate) enum Found {
    Record(Head),
    /// Something that is not traffic: a comment, a head, a statistic.
    Nothing,
    /// An error frame, or traffic of another kind.
    Skipped,
}

/// A record whose octets, where it is a telegram, stand in the reader's buffer.
#[derive(Debug)]
pub(crate) struct Head {
    pub(crate) at: Timestamp,
    pub(crate) bus: u16,
    pub(crate) direction: Direction,
    pub(crate) content: HeadContent,
}

#[derive(Debug)]
pub(crate) enum HeadContent {
    Frame(Frame),
    Telegram(Condition),
}

/// Reads a capture from any of the four [formats](crate#formats).
#[derive(Debug)]
pub struct Reader<R> {
    source: Source<R>,
    buses: Buses,
    octets: Vec<u8>,
    skipped: u64,
    over: bool,
}

#[derive(Debug)]
enum Source<R> {
    Text(Lines<R>, Parser),
    Pcapng(R, pcapng::Parser),
}

#[derive(Debug)]
enum Parser {
    Log,
    Asc(asc::Parser),
    Trc(trc::Parser),
}

impl Reader<BufReader<File>> {
    /// Opens a file in the format that its suffix says.
    ///
    /// # Errors
    /// [`ReadError::Format`], [`ReadError::Io`].
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let format = Format::of(path)?;
        Ok(Self::new(BufReader::with_capacity(1 << 16, File::open(path)?), format))
    }
}

impl<R: BufRead> Reader<R> {
    /// Reads `source`, which is in `format`.
    #[must_use]
    pub const fn new(source: R, format: Format) -> Self {
        let source = match format {
            Format::Log => Source::Text(Lines::new(source), Parser::Log),
            Format::Asc => Source::Text(Lines::new(source), Parser::Asc(asc::Parser::new())),
            Format::Trc => Source::Text(Lines::new(source), Parser::Trc(trc::Parser::new())),
            Format::Pcapng => Source::Pcapng(source, pcapng::Parser::new()),
        };
        let buses = Buses(Vec::new());
        Self { source, buses, octets: Vec::new(), skipped: 0, over: false }
    }

    /// The buses that have appeared so far; a record names one of them by its place.
    #[must_use]
    pub fn buses(&self) -> &[Bus] {
        &self.buses.0
    }

    /// Records passed over so far since they are no traffic of ours: error frames, other links.
    #[must_use]
    pub const fn skipped(&self) -> u64 {
        self.skipped
    }

    /// The next record with its bus; `None` at the end of the file.
    ///
    /// # Errors
    /// [`ReadError`] says what is wrong and where. What was read before is good, and so is what
    /// follows where the error [is local](ReadError::is_local); otherwise the file is over.
    pub fn read(&mut self) -> Result<Option<(&Bus, Record<'_>)>, ReadError> {
        let Head { at, bus, direction, content } = loop {
            if self.over {
                return Ok(None);
            }
            match self.next()? {
                None => self.over = true,
                Some(Found::Nothing) => {}
                Some(Found::Skipped) => self.skipped += 1,
                Some(Found::Record(head)) => break head,
            }
        };
        let content = match content {
            HeadContent::Frame(frame) => Content::Frame(frame),
            HeadContent::Telegram(condition) => {
                Content::Telegram { octets: &self.octets, condition }
            }
        };
        // A place is given out together with its bus.
        let its_bus = &self.buses.0[usize::from(bus)];
        Ok(Some((its_bus, Record { at, bus, direction, content })))
    }

    /// The next line or block; `None` at the end of the file.
    fn next(&mut self) -> Result<Option<Found>, ReadError> {
        let Self { source, buses, octets, over, .. } = self;
        let result = match source {
            Source::Text(lines, parser) => {
                let found = match lines.advance() {
                    Err(error) => Err(error),
                    Ok(Err(_)) => Ok(Err(Damage::Line)),
                    Ok(Ok(false)) => return Ok(None),
                    Ok(Ok(true)) => {
                        let found = match parser {
                            Parser::Log => log::read(lines.line(), octets, buses),
                            Parser::Asc(parser) => parser.read(lines.line(), buses),
                            Parser::Trc(parser) => parser.read(lines.line(), buses),
                        };
                        Ok(match found {
                            // Shorter by a digit it may still look like a frame.
                            Ok(Found::Record(_)) | Err(_) if !lines.is_complete() => {
                                Err(Damage::Cut)
                            }
                            found => found.map(Some),
                        })
                    }
                };
                found.map(|found| (found, Place::Line(lines.number())))
            }
            Source::Pcapng(source, parser) => {
                let found = parser.read(source, octets, buses);
                found.map(|found| (found, Place::Offset(parser.offset())))
            }
        };
        match result {
            Ok((Ok(found), _)) => Ok(found),
            Ok((Err(damage), place)) => {
                *over = damage.ends_the_file();
                Err(ReadError::Damage { place, damage })
            }
            Err(error) => {
                *over = true;
                Err(error.into())
            }
        }
    }
}

/// The buses that have appeared in a file.
#[derive(Debug)]
pub(crate) struct Buses(Vec<Bus>);

impl Buses {
    /// The place of the bus that a line calls `name`.
    pub(crate) fn named(&mut self, name: &[u8], medium: Medium) -> Result<u16, Damage> {
        if let Some(place) = self.place(name, medium) {
            return Ok(place);
        }
        // What is no text, or would move a terminal's cursor, is called otherwise here.
        let name = word(&String::from_utf8_lossy(name));
        match self.place(name.as_bytes(), medium) {
            Some(place) => Ok(place),
            None => self.add(Some(name.as_bytes()), medium, None),
        }
    }

    fn place(&self, name: &[u8], medium: Medium) -> Option<u16> {
        let is = |bus: &Bus| bus.medium == medium && bus.name.as_bytes() == name;
        self.0.iter().position(is).map(|place| place as u16)
    }

    /// The place of the bus that a line gives `number`, from 1 on, of a format that carries CAN
    /// frames alone.
    pub(crate) fn numbered(&mut self, number: u64) -> Result<u16, Damage> {
        if number == 0 || number > MOST_BUSES as u64 {
            return Err(Damage::Bus);
        }
        while (self.0.len() as u64) < number {
            self.add(None, Medium::DeviceNet, None)?;
        }
        Ok((number - 1) as u16)
    }

    /// The place of a new bus; where it has no name, it gets one of its number.
    pub(crate) fn add(
        &mut self,
        name: Option<&[u8]>,
        medium: Medium,
        bits_per_second: Option<u32>,
    ) -> Result<u16, Damage> {
        let place = self.0.len();
        if place >= MOST_BUSES {
            return Err(Damage::Bus);
        }
        let name = match name {
            Some(name) => word(&String::from_utf8_lossy(name)),
            None => format!("bus{}", place + 1),
        };
        self.0.push(Bus { name, medium, bits_per_second });
        Ok(place as u16)
    }
}

//! Writing, reading and telling in memory.

use codewheel_capture::{
    Assume, Bus, Condition, Content, Decoder, Direction, Format, Output, ReadError, Reader, Record,
    Timestamp, Writer,
};
use codewheel_sim::can::parse_frame;
use codewheel_sim::rs485::parse_telegram;
use codewheel_station::can::{BitRate, Frame};
use codewheel_station::rs485::BaudRate;

/// 2026-11-22 08:00 UTC.
pub(crate) const BEGIN: Timestamp = Timestamp::from_nanos(1_795_334_400_000_000_000);

/// A record that owns its octets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Kept {
    pub(crate) at: Timestamp,
    pub(crate) bus: u16,
    pub(crate) direction: Direction,
    pub(crate) content: Said,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Said {
    Frame(Frame),
    Telegram(Vec<u8>, Condition),
}

impl Kept {
    pub(crate) fn of(record: &Record<'_>) -> Self {
        let content = match record.content {
            Content::Frame(frame) => Said::Frame(frame),
            Content::Telegram { octets, condition } => Said::Telegram(octets.to_vec(), condition),
        };
        Self { at: record.at, bus: record.bus, direction: record.direction, content }
    }

    pub(crate) fn record(&self) -> Record<'_> {
        let content = match &self.content {
            Said::Frame(frame) => Content::Frame(*frame),
            Said::Telegram(octets, condition) => {
                Content::Telegram { octets, condition: *condition }
            }
        };
        Record { at: self.at, bus: self.bus, direction: self.direction, content }
    }
}

pub(crate) fn can0() -> Bus {
    Bus::devicenet("can0", BitRate::Kbit500)
}

pub(crate) fn pb0() -> Bus {
    Bus::profibus("pb0", BaudRate::Mbit1_5)
}

pub(crate) fn file(format: Format, buses: Vec<Bus>, records: &[Kept]) -> Vec<u8> {
    let mut writer = Writer::new(Vec::new(), format, buses, BEGIN).expect("it carries them");
    for record in records {
        writer.write(&record.record()).expect("memory takes everything");
    }
    writer.finish().expect("memory takes everything")
}

/// What a file gives: records and errors in their order.
pub(crate) fn read(format: Format, file: &[u8]) -> (Vec<Kept>, Vec<ReadError>, Vec<Bus>) {
    let mut reader = Reader::new(file, format);
    let (mut records, mut errors) = (Vec::new(), Vec::new());
    loop {
        match reader.read() {
            Ok(Some((_, record))) => records.push(Kept::of(&record)),
            Ok(None) => return (records, errors, reader.buses().to_vec()),
            Err(error) => errors.push(error),
        }
    }
}

/// A reader that fails where anything is wrong.
#[track_caller]
pub(crate) fn read_whole(format: Format, file: &[u8]) -> Vec<Kept> {
    let (records, errors, _) = read(format, file);
    assert!(errors.is_empty(), "{errors:?}");
    records
}

/// A decoder and what it is told, a word of the field a line.
#[derive(Debug)]
pub(crate) struct Telling {
    decoder: Decoder,
    bus: Bus,
    output: Output,
}

impl Telling {
    pub(crate) fn devicenet() -> Self {
        Self::new(can0(), Output::Text, Assume::Encoders)
    }

    pub(crate) fn profibus() -> Self {
        Self::new(pb0(), Output::Text, Assume::Encoders)
    }

    pub(crate) fn new(bus: Bus, output: Output, assume: Assume) -> Self {
        Self { decoder: Decoder::new(output, assume), bus, output }
    }

    /// What is told of a frame as candump writes it, without time, bus and frame.
    #[track_caller]
    pub(crate) fn frame(&mut self, text: &str) -> String {
        let line = self.tell(Content::Frame(parse_frame(text).expect("a frame")));
        match self.output {
            Output::Text => line.split_at(29 + line.find("can0").expect("its bus")).1.trim().into(),
            Output::Json => line,
        }
    }

    /// What is told of a telegram as the books print it, without time, bus and octets.
    #[track_caller]
    pub(crate) fn telegram(&mut self, text: &str) -> String {
        self.octets(parse_telegram(text).expect("octets").octets(), Condition::Intact)
    }

    #[track_caller]
    pub(crate) fn octets(&mut self, octets: &[u8], condition: Condition) -> String {
        let line = self.tell(Content::Telegram { octets, condition });
        match self.output {
            Output::Text => {
                let begin = line.find("pb0").expect("its bus") + 3;
                let end = line.find("  | ").expect("its octets");
                line[begin..end].trim().to_owned()
            }
            Output::Json => line,
        }
    }

    fn tell(&mut self, content: Content<'_>) -> String {
        let record = Record { at: BEGIN, bus: 0, direction: Direction::Received, content };
        let mut out = Vec::new();
        self.decoder.decode(&self.bus, &record, &mut out);
        String::from_utf8(out).expect("text")
    }
}

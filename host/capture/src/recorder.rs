//! Recording while a bus runs.
//!
//! A bus thread copies what it has seen into memory and goes on; a thread of its own writes. Between
//! them stands one buffer behind a lock that is held for a copy on the one side, for an exchange of
//! two pointers on the other, so no bus ever waits for a disk.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use codewheel_station::Instant;
use codewheel_station::can::{Frame, Identifier};

use crate::{Bus, Condition, Content, Direction, Record, Timestamp, WriteError, Writer};

/// How many octets wait for the disk at most: about five seconds of a full CAN segment at 500k, one of
/// a PROFIBUS at 12M.
const WAITING: usize = 4 << 20;
/// How long records are gathered before the file gets them.
const GATHERING: Duration = Duration::from_millis(100);

/// Records what running buses carry into one file.
///
/// It has a handle for each bus, [`BusRecorder`]. When the disk is too slow, records are lost and
/// counted. Dropping it writes what has been recorded; [`finish`](Self::finish) also says how that went.
#[derive(Debug)]
pub struct Recorder {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<Result<(), WriteError>>>,
    path: PathBuf,
}

/// What became of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// Records that were taken.
    pub records: u64,
    /// Records that were lost, since the disk was too slow or did not take any more.
    pub lost: u64,
}

#[derive(Debug)]
struct Shared {
    waiting: Mutex<Waiting>,
    /// Something waits, or no more will come.
    news: Condvar,
}

#[derive(Debug, Default)]
struct Waiting {
    octets: Vec<u8>,
    recorded: Recorded,
    /// Lost records of each bus that the file has not been told of.
    lost: Vec<u64>,
    over: bool,
    /// The file takes nothing any more.
    broken: bool,
}

impl Shared {
    /// Nothing that is done under the lock panics, so what a poisoned one holds is good.
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Recorder {
    /// Makes the file anew, in the format that its suffix says, and begins to record these buses.
    ///
    /// # Errors
    /// [`WriteError`]: the suffix is none of a capture, the format cannot hold what these buses carry,
    /// or the file cannot be made.
    pub fn create(path: &Path, buses: Vec<Bus>) -> Result<Self, WriteError> {
        let begin = Timestamp::from(std::time::SystemTime::now());
        let lost = vec![0; buses.len()];
        let writer = Writer::create(path, buses, begin)?;
        let octets = Vec::with_capacity(WAITING);
        let waiting = Waiting { octets, lost, ..Waiting::default() };
        let shared = Arc::new(Shared { waiting: Mutex::new(waiting), news: Condvar::new() });
        let other = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("capture".to_owned())
            .spawn(move || write(&other, writer))?;
        Ok(Self { shared, thread: Some(thread), path: path.to_owned() })
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The handle for the bus that stood at `place` when the recorder was made. `origin` is the moment
    /// at which the time of that bus was [`Instant::ZERO`]:
    /// [`Timestamp::origin_of`] makes it from the bus time of now.
    #[must_use]
    pub fn bus(&self, place: u16, origin: Timestamp) -> BusRecorder {
        BusRecorder { shared: Arc::clone(&self.shared), place, origin }
    }

    /// What has been recorded so far.
    #[must_use]
    pub fn recorded(&self) -> Recorded {
        self.shared.lock().recorded
    }

    /// Writes what has been recorded, and ends. What handles record from now on is dropped.
    ///
    /// # Errors
    /// [`WriteError::Io`] where the file did not take everything; then all records that were lost have
    /// been counted by [`recorded`](Self::recorded).
    pub fn finish(mut self) -> Result<Recorded, WriteError> {
        self.end()?;
        Ok(self.recorded())
    }

    fn end(&mut self) -> Result<(), WriteError> {
        self.shared.lock().over = true;
        self.shared.news.notify_one();
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(written)) => written,
            Some(Err(_)) => Err(std::io::Error::other("the writing thread has died").into()),
            None => Ok(()),
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // Nobody is there any more who could be told.
        let _ = self.end();
    }
}

/// Records one bus; cheap to clone and to give away.
#[derive(Clone, Debug)]
pub struct BusRecorder {
    shared: Arc<Shared>,
    place: u16,
    origin: Timestamp,
}

impl BusRecorder {
    /// Records a frame, `at` in the time of the bus. Never waits for the disk.
    pub fn frame(&self, at: Instant, frame: &Frame, direction: Direction) {
        self.put(&Record {
            at: self.origin.at(at),
            bus: self.place,
            direction,
            content: Content::Frame(*frame),
        });
    }

    /// Records a telegram, or octets that should have been one, of which the first 255 count; `at` in
    /// the time of the bus. Never waits for the disk.
    pub fn telegram(&self, at: Instant, octets: &[u8], condition: Condition, direction: Direction) {
        if octets.is_empty() {
            return;
        }
        let octets = octets.get(..255).unwrap_or(octets);
        self.put(&Record {
            at: self.origin.at(at),
            bus: self.place,
            direction,
            content: Content::Telegram { octets, condition },
        });
    }

    fn put(&self, record: &Record<'_>) {
        let mut waiting = self.shared.lock();
        if waiting.over {
            return;
        }
        if waiting.broken || waiting.octets.len() + LONGEST > WAITING {
            waiting.recorded.lost += 1;
            if let Some(lost) = waiting.lost.get_mut(usize::from(record.bus)) {
                *lost += 1;
            }
            return;
        }
        waiting.recorded.records += 1;
        let was_empty = waiting.octets.is_empty();
        pack(&mut waiting.octets, record);
        drop(waiting);
        if was_empty {
            self.shared.news.notify_one();
        }
    }
}

/// The most octets that a packed record has.
const LONGEST: usize = HEAD + 255;
/// Time, bus, marks, length.
const HEAD: usize = 8 + 2 + 1 + 1;
const SENT: u8 = 1;
const BROKEN: u8 = 1 << 1;
const TELEGRAM: u8 = 1 << 2;
const EXTENDED: u8 = 1 << 3;
const REMOTE: u8 = 1 << 4;

/// Appends a record as it waits for the writing thread.
fn pack(out: &mut Vec<u8>, record: &Record<'_>) {
    let mut marks = if record.direction == Direction::Sent { SENT } else { 0 };
    let mut head = |marks: u8, length: usize| {
        let [a, b, c, d, e, f, g, h] = record.at.as_nanos().to_le_bytes();
        let [low, high] = record.bus.to_le_bytes();
        out.extend_from_slice(&[a, b, c, d, e, f, g, h, low, high, marks, length as u8]);
    };
    match record.content {
        Content::Frame(frame) => {
            let identifier = match frame.identifier() {
                Identifier::Standard(bits) => bits.into(),
                Identifier::Extended(bits) => {
                    marks |= EXTENDED;
                    bits
                }
            };
            if frame.is_remote() {
                marks |= REMOTE;
            }
            head(marks, frame.length());
            out.extend_from_slice(&identifier.to_le_bytes());
            out.extend_from_slice(frame.data());
        }
        Content::Telegram { octets, condition } => {
            if condition == Condition::Broken {
                marks |= BROKEN;
            }
            head(marks | TELEGRAM, octets.len());
            out.extend_from_slice(octets);
        }
    }
}

/// Takes the first packed record off `octets`.
fn unpack<'a>(octets: &mut &'a [u8]) -> Option<Record<'a>> {
    let &[a, b, c, d, e, f, g, h, low, high, marks, length, ref rest @ ..] = *octets else {
        return None;
    };
    let at = Timestamp::from_nanos(u64::from_le_bytes([a, b, c, d, e, f, g, h]));
    let bus = u16::from_le_bytes([low, high]);
    let direction = if marks & SENT == 0 { Direction::Received } else { Direction::Sent };
    let length = usize::from(length);
    let content = if marks & TELEGRAM == 0 {
        let (identifier, rest) = rest.split_first_chunk()?;
        let bits = u32::from_le_bytes(*identifier);
        let identifier = match marks & EXTENDED {
            0 => Identifier::Standard(bits as u16),
            _ => Identifier::Extended(bits),
        };
        if marks & REMOTE == 0 {
            let (data, behind) = rest.split_at_checked(length)?;
            *octets = behind;
            Content::Frame(Frame::new(identifier, data).ok()?)
        } else {
            *octets = rest;
            Content::Frame(Frame::remote(identifier, length).ok()?)
        }
    } else {
        let (telegram, behind) = rest.split_at_checked(length)?;
        *octets = behind;
        let condition = if marks & BROKEN == 0 { Condition::Intact } else { Condition::Broken };
        Content::Telegram { octets: telegram, condition }
    };
    Some(Record { at, bus, direction, content })
}

/// Writes what waits until no more will come.
fn write<W: std::io::Write>(shared: &Shared, mut writer: Writer<W>) -> Result<(), WriteError> {
    let mut taken = Vec::with_capacity(WAITING);
    loop {
        let (over, lost) = take(shared, &mut taken);
        let written = write_all(&mut writer, &taken, &lost);
        if let Err(error) = written {
            shared.lock().broken = true;
            return Err(error);
        }
        taken.clear();
        if over {
            return writer.finish().map(drop);
        }
        // What comes meanwhile goes to the file in one piece.
        let waiting = shared.lock();
        if !waiting.over && waiting.octets.len() < WAITING / 4 {
            let end = |waiting: &mut Waiting| !waiting.over;
            let waited = shared.news.wait_timeout_while(waiting, GATHERING, end);
            drop(waited);
        }
    }
}

/// Waits for something and exchanges it for the empty buffer. Whether no more will come, and what was
/// lost of each bus.
fn take(shared: &Shared, taken: &mut Vec<u8>) -> (bool, Vec<u64>) {
    let waiting = shared.lock();
    let idle = |waiting: &mut Waiting| waiting.octets.is_empty() && !waiting.over;
    let mut waiting = shared.news.wait_while(waiting, idle).unwrap_or_else(PoisonError::into_inner);
    std::mem::swap(&mut waiting.octets, taken);
    let buses = waiting.lost.len();
    (waiting.over, std::mem::replace(&mut waiting.lost, vec![0; buses]))
}

fn write_all<W: std::io::Write>(
    writer: &mut Writer<W>,
    taken: &[u8],
    lost: &[u64],
) -> Result<(), WriteError> {
    for (bus, lost) in (0..).zip(lost) {
        writer.lose(bus, *lost);
    }
    let mut rest = taken;
    while let Some(record) = unpack(&mut rest) {
        writer.write(&record)?;
    }
    writer.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk that takes nothing until it is told to.
    #[derive(Debug)]
    struct Slow(std::sync::mpsc::Receiver<()>);

    impl std::io::Write for Slow {
        fn write(&mut self, octets: &[u8]) -> std::io::Result<usize> {
            // Its other end is dropped where the test lets everything through.
            let _ = self.0.recv();
            Ok(octets.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_packed_record_is_unpacked_as_it_was() {
        let frame = |identifier, data: &[u8]| Content::Frame(Frame::new(identifier, data).unwrap());
        let remote = Frame::remote(Identifier::Standard(0x7FF), 4).unwrap();
        let contents = [
            frame(Identifier::Standard(0x42B), &[1, 2, 3]),
            frame(Identifier::Extended(0x1FFF_FFFF), &[0; 8]),
            Content::Frame(remote),
            Content::Telegram { octets: &[0xE5], condition: Condition::Intact },
            Content::Telegram { octets: &[7; 255], condition: Condition::Broken },
        ];
        let mut packed = Vec::new();
        let record = |(place, content)| Record {
            at: Timestamp::from_nanos(u64::MAX - place),
            bus: 300,
            direction: if place % 2 == 0 { Direction::Sent } else { Direction::Received },
            content,
        };
        for record in (0..).zip(contents).map(record) {
            pack(&mut packed, &record);
        }
        let mut rest = packed.as_slice();
        for expected in (0..).zip(contents).map(record) {
            assert_eq!(unpack(&mut rest), Some(expected));
        }
        assert!(rest.is_empty());
    }

    #[test]
    fn a_disk_that_is_too_slow_costs_records_which_are_counted_and_never_the_bus_its_time() {
        let (open, closed) = std::sync::mpsc::channel();
        let bus = Bus::devicenet("can0", codewheel_station::can::BitRate::Kbit500);
        let begin = Timestamp::from_nanos(0);
        let writer = Writer::new(Slow(closed), crate::Format::Log, vec![bus], begin).unwrap();
        let waiting = Waiting { lost: vec![0], ..Waiting::default() };
        let shared = Arc::new(Shared { waiting: Mutex::new(waiting), news: Condvar::new() });
        let other = Arc::clone(&shared);
        let thread = Some(std::thread::spawn(move || write(&other, writer)));
        let recorder = Recorder { shared, thread, path: PathBuf::new() };
        let handle = recorder.bus(0, begin);
        let frame = Frame::standard(0x42B, &[0; 8]);
        let all = 1_000_000;
        let start = std::time::Instant::now();
        for count in 0..all {
            handle.frame(Instant::from_nanos(count), &frame, Direction::Received);
        }
        assert!(start.elapsed() < Duration::from_secs(20), "the bus has waited");
        drop(open);
        let Recorded { records, lost } = recorder.finish().unwrap();
        assert_eq!(records + lost, all);
        assert!(lost > 0 && records > 100_000, "{records} {lost}");
    }
}

//! Who writes the records of a device, and what the device finds after a power cut.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::JoinHandle;

use codewheel_device::Product;
use codewheel_encoder::{Kept, RECORD_OCTETS, Slot, Start, choose, encode};
use codewheel_link::Waker;
use codewheel_sim::memory::TornMemory;
use codewheel_station::{Duration, Instant};
use fastrand::Rng;

use crate::{MemoryError, MemoryFile};

/// How long a record is on its way into RAM, or into a file in virtual time: what an EEPROM takes.
const WRITE_TIME: Duration = Duration::from_millis(10);

/// What a device finds that has never kept anything.
const FRESH: Start = Start::Fresh { interrupted: false };

/// The memory of one device, over its power cuts.
#[derive(Debug)]
pub(crate) struct Keeper {
    store: Store,
    /// What the device will find when it is switched on.
    start: Start,
    writing: Option<Writing>,
}

#[derive(Debug)]
enum Store {
    /// Torn by a power cut.
    Ram(TornMemory),
    /// Written within one moment of virtual time.
    File(MemoryFile),
    /// Written while polls go on.
    Thread(Writer),
}

#[derive(Debug)]
struct Writing {
    kept: Kept,
    /// `None`: the thread says when.
    done_at: Option<Instant>,
}

impl Keeper {
    /// The memory in the file at `path`, or in RAM; where a damaged file was put.
    pub(crate) fn open(
        path: Option<&Path>,
        product: &Product,
    ) -> Result<(Self, Option<PathBuf>), MemoryError> {
        let (store, start, set_aside) = match path {
            None => (Store::Ram(TornMemory::new()), FRESH, None),
            Some(path) => {
                let (file, found) = MemoryFile::open(path, product)?;
                (Store::File(file), found.start, found.set_aside)
            }
        };
        Ok((Self { store, start, writing: None }, set_aside))
    }

    /// Writes a file in a thread of its own from now on, which uses `waker` after each record.
    pub(crate) fn write_in_thread(&mut self, waker: &Waker) {
        let store = std::mem::replace(&mut self.store, Store::Ram(TornMemory::new()));
        self.store = match store {
            Store::File(file) => Store::Thread(Writer::begin(file, waker.clone())),
            store => store,
        };
    }

    pub(crate) const fn start(&self) -> &Start {
        &self.start
    }

    /// Begins to write a record.
    pub(crate) fn begin(&mut self, now: Instant, kept: Kept) {
        let done_at = match &self.store {
            Store::Ram(_) | Store::File(_) => Some(now + WRITE_TIME),
            Store::Thread(writer) => {
                writer.write(kept);
                None
            }
        };
        self.writing = Some(Writing { kept, done_at });
    }

    /// When a record will be written; `None` where there is none, or a thread wakes the port.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.writing.as_ref()?.done_at
    }

    /// What became of the record, where it has ended.
    pub(crate) fn done(&mut self, now: Instant) -> Option<Result<(), MemoryError>> {
        let Writing { kept, done_at } = self.writing.as_ref()?;
        let kept = *kept;
        let result = match &mut self.store {
            Store::Thread(writer) => writer.results.try_recv().ok()?,
            _ if done_at.is_some_and(|done_at| now < done_at) => return None,
            Store::File(file) => file.write(&kept),
            Store::Ram(memory) => {
                let (slot, sequence) = self.start.next();
                memory.write(slot, &encode(&kept, sequence), None);
                self.start = Start::Kept { kept, sequence, slot, other_damaged: false };
                self.writing = None;
                return Some(Ok(()));
            }
        };
        self.ended(kept, result.is_ok());
        Some(result)
    }

    /// Waits for the end of the record under way.
    pub(crate) fn finish(&mut self) -> Option<Result<(), MemoryError>> {
        let kept = self.writing.as_ref()?.kept;
        let Store::Thread(writer) = &mut self.store else {
            return self.done(Instant::from_nanos(u64::MAX));
        };
        let result = writer.results.recv().ok();
        self.ended(kept, matches!(result, Some(Ok(()))));
        result
    }

    /// The power fails: in RAM the record under way is torn behind any of its octets. A file takes
    /// its record whole or not at all; what became of one that a thread was writing.
    pub(crate) fn cut(&mut self, random: &mut Rng) -> Option<Result<(), MemoryError>> {
        let result = match &mut self.store {
            Store::Thread(_) => self.finish(),
            Store::File(_) => None,
            Store::Ram(memory) => {
                if let Some(Writing { kept, .. }) = &self.writing {
                    let (slot, sequence) = self.start.next();
                    let cut = random.usize(0..=RECORD_OCTETS);
                    memory.write(slot, &encode(kept, sequence), Some(cut));
                    self.start = choose(memory.read(Slot::A), memory.read(Slot::B));
                }
                None
            }
        };
        self.writing = None;
        result
    }

    /// A record went into the file, or not. Which place of the file it has is the file's business.
    fn ended(&mut self, kept: Kept, good: bool) {
        self.writing = None;
        if good {
            self.start = Start::Kept { kept, sequence: 0, slot: Slot::A, other_damaged: false };
        }
    }
}

/// A thread that writes records. A disk may take its time.
#[derive(Debug)]
struct Writer {
    records: Option<Sender<Kept>>,
    results: Receiver<Result<(), MemoryError>>,
    thread: Option<JoinHandle<()>>,
}

impl Writer {
    fn begin(mut file: MemoryFile, waker: Waker) -> Self {
        let (records, to_write) = mpsc::channel::<Kept>();
        let (done, results) = mpsc::channel();
        let thread = std::thread::spawn(move || {
            for kept in to_write {
                if done.send(file.write(&kept)).is_err() {
                    return;
                }
                waker.wake();
            }
        });
        Self { records: Some(records), results, thread: Some(thread) }
    }

    fn write(&self, kept: Kept) {
        if let Some(records) = &self.records {
            // The thread lives as long as this sender.
            let _ = records.send(kept);
        }
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.records.take();
        if let Some(thread) = self.thread.take() {
            // Its last write ends before the lock on the file goes.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_encoder::Block;

    fn kept(writes: u32) -> (&'static Product, Kept) {
        let product = Product::find("amg11-d29").expect("in the catalogue");
        let kept = Kept {
            fingerprint: product.fingerprint,
            saved: Block::default_for(product.encoder),
            reference: None,
            serial: 7,
            writes,
            bus: [0; 24],
        };
        (product, kept)
    }

    fn written(start: &Start) -> Option<u32> {
        match start {
            Start::Kept { kept, .. } => Some(kept.writes),
            _ => None,
        }
    }

    #[test]
    fn a_record_in_ram_takes_its_time_and_is_found_after_a_power_cut() {
        let (product, first) = kept(1);
        let (mut keeper, _) = Keeper::open(None, product).unwrap();
        keeper.begin(Instant::ZERO, first);
        let done = keeper.deadline().expect("a deadline");
        assert!(keeper.done(Instant::ZERO).is_none());
        assert!(keeper.done(done).is_some_and(|result| result.is_ok()));
        keeper.cut(&mut Rng::with_seed(1));
        assert_eq!(written(keeper.start()), Some(1));
    }

    #[test]
    fn a_power_cut_in_a_write_leaves_the_old_or_the_new_record_whatever_the_octet() {
        let mut seen = [0; 3];
        for seed in 0..500 {
            let (product, first) = kept(1);
            let (mut keeper, _) = Keeper::open(None, product).unwrap();
            keeper.begin(Instant::ZERO, first);
            keeper.finish().expect("written").expect("well");
            keeper.begin(Instant::ZERO, kept(2).1);
            keeper.cut(&mut Rng::with_seed(seed));
            assert_eq!(keeper.deadline(), None);
            seen[written(keeper.start()).expect("never nothing") as usize] += 1;
        }
        assert!(seen[1] > 400 && seen[2] > 0, "{seen:?}");
    }

    #[test]
    fn a_file_takes_its_record_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("memory");
        let (product, first) = kept(1);
        let (mut keeper, _) = Keeper::open(Some(&path), product).unwrap();
        keeper.begin(Instant::ZERO, first);
        keeper.cut(&mut Rng::with_seed(1));
        assert_eq!(*keeper.start(), FRESH);
        keeper.begin(Instant::ZERO, first);
        keeper.finish().expect("written").expect("well");
        assert_eq!(written(keeper.start()), Some(1));
        drop(keeper);
        let (keeper, _) = Keeper::open(Some(&path), product).unwrap();
        assert_eq!(written(keeper.start()), Some(1));
    }
}

//! One encoder on a real port: it plays until it is told to stop.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::JoinHandle;

use codewheel_device::{DeviceNetEncoder, Event, Factory, Product, Snapshot, Switches};
use codewheel_encoder::{Kept, Start};
use codewheel_link::{BusUri, CanPort, Clock, LinkError, Loop, Notice, Waker};
use codewheel_sim::shaft::{Faulty, Shaft};
use codewheel_station::Instant;
use codewheel_station::can::BitRate;
use thiserror::Error;

use crate::{MemoryError, MemoryFile};

/// What an encoder needs to be played.
#[derive(Debug)]
pub struct PlayerSettings {
    /// The product.
    pub product: &'static Product,
    /// Where it is plugged in.
    pub bus: BusUri,
    /// The address switches.
    pub address: u8,
    /// The bit rate switches.
    pub bit_rate: BitRate,
    /// The shaft.
    pub shaft: Shaft,
    /// The file that holds its non-volatile memory; without one it forgets with the process.
    pub memory: Option<PathBuf>,
    /// Its serial number; by default what the memory holds, else the address.
    pub serial: Option<u32>,
}

/// Why an encoder cannot be played, or not any longer.
#[derive(Debug, Error)]
pub enum PlayError {
    /// The memory file.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The bus.
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// Something the player tells people.
#[derive(Debug)]
pub enum Report {
    /// Of the device.
    Device(Instant, Event),
    /// Of the port.
    Port(Notice),
    /// A damaged memory file was set aside under this name.
    SetAside(PathBuf),
    /// The memory file did not take a record.
    NotKept(MemoryError),
}

/// An encoder on a port.
#[derive(Debug)]
pub struct Player {
    device: DeviceNetEncoder<Faulty<Shaft>>,
    port: Box<dyn CanPort>,
    turns: Loop,
    memory: Memory,
    set_aside: Option<PathBuf>,
    bus: String,
}

impl Player {
    /// Opens memory and port and switches the encoder on.
    ///
    /// # Errors
    /// [`PlayError`]; nothing is left half started.
    pub fn power_up(settings: PlayerSettings) -> Result<Self, PlayError> {
        let PlayerSettings { product, bus, address, bit_rate, shaft, memory, serial } = settings;
        let opened = memory.map(|path| MemoryFile::open(&path, product)).transpose()?;
        let port = codewheel_link::open(&bus, bit_rate)?;
        let (file, start, set_aside) = match opened {
            Some((file, found)) => (Some(file), found.start, found.set_aside),
            None => (None, Start::Fresh { interrupted: false }, None),
        };
        let kept = match &start {
            Start::Kept { kept, .. } => Some(kept.serial),
            _ => None,
        };
        let clock = Clock::new();
        let now = clock.now();
        let codes = product.encoder.geometry.range();
        let device = DeviceNetEncoder::power_up(
            now,
            product,
            Factory::with_serial(serial.or(kept).unwrap_or(u32::from(address))),
            Switches::set_to(address, bit_rate),
            &start,
            Faulty::new(shaft.beginning(now), codes),
        );
        let memory = match file {
            Some(file) => Memory::file(file, port.waker()),
            None => Memory::Volatile,
        };
        let bus = port.describe();
        Ok(Self { device, port, turns: Loop::new(clock), memory, set_aside, bus })
    }

    /// Where the encoder is plugged in, with the port it really got.
    #[must_use]
    pub fn bus(&self) -> &str {
        &self.bus
    }

    /// What the encoder shows of itself now.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        self.device.snapshot(self.turns.clock().now())
    }

    /// Ends a wait of [`run`](Self::run), so that it looks at `stop`.
    #[must_use]
    pub fn waker(&self) -> Waker {
        self.port.waker()
    }

    /// Plays until `stop` is set and [`waker`](Self::waker) has been used, then finishes what the
    /// memory is still to take. `tell` hears of everything people may want to know.
    ///
    /// # Errors
    /// [`LinkError`] when the bus is lost.
    pub fn run(
        &mut self,
        stop: &AtomicBool,
        tell: &mut dyn FnMut(Report),
    ) -> Result<(), LinkError> {
        if let Some(path) = self.set_aside.take() {
            tell(Report::SetAside(path));
        }
        let result = loop {
            self.serve_memory(tell);
            while let Some((at, event)) = self.device.take_event() {
                tell(Report::Device(at, event));
            }
            if stop.load(Ordering::Relaxed) {
                break Ok(());
            }
            match self.turns.turn(&mut self.device, &mut *self.port, None) {
                Ok(outcome) => {
                    for notice in outcome.notices {
                        tell(Report::Port(notice));
                    }
                }
                Err(error) => break Err(error),
            }
        };
        self.finish_memory(tell);
        result
    }

    /// Hands the memory what is due and takes in what it has done.
    fn serve_memory(&mut self, tell: &mut dyn FnMut(Report)) {
        loop {
            while let Some(result) = self.memory.done() {
                self.kept(result, tell);
            }
            let Some(kept) = self.device.keep(self.turns.clock().now()) else { return };
            if let Some(result) = self.memory.write(kept) {
                self.kept(result, tell);
            }
        }
    }

    /// Waits until the memory has taken everything.
    fn finish_memory(&mut self, tell: &mut dyn FnMut(Report)) {
        self.serve_memory(tell);
        while let Some(result) = self.memory.finish() {
            self.kept(result, tell);
            self.serve_memory(tell);
        }
    }

    fn kept(&mut self, result: Result<(), MemoryError>, tell: &mut dyn FnMut(Report)) {
        self.device.kept(self.turns.clock().now(), result.as_ref().copied());
        if let Err(error) = result {
            tell(Report::NotKept(error));
        }
    }
}

/// The memory of a played encoder. A disk may take its time, so it has a thread of its own: polls
/// go on meanwhile.
#[derive(Debug)]
enum Memory {
    Volatile,
    File {
        records: Option<Sender<Kept>>,
        results: Receiver<Result<(), MemoryError>>,
        under_way: u32,
        thread: Option<JoinHandle<()>>,
    },
}

impl Memory {
    fn file(mut file: MemoryFile, waker: Waker) -> Self {
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
        Self::File { records: Some(records), results, under_way: 0, thread: Some(thread) }
    }

    /// Begins to write a record; the result where it is known at once.
    fn write(&mut self, kept: Kept) -> Option<Result<(), MemoryError>> {
        match self {
            Self::Volatile => Some(Ok(())),
            Self::File { records, under_way, .. } => {
                if records.as_ref().is_some_and(|records| records.send(kept).is_ok()) {
                    *under_way += 1;
                }
                None
            }
        }
    }

    /// The result of a write that has ended.
    fn done(&mut self) -> Option<Result<(), MemoryError>> {
        match self {
            Self::Volatile => None,
            Self::File { results, under_way, .. } => {
                let result = results.try_recv().ok()?;
                *under_way -= 1;
                Some(result)
            }
        }
    }

    /// The result of the write under way, waited for.
    fn finish(&mut self) -> Option<Result<(), MemoryError>> {
        match self {
            Self::File { results, under_way, .. } if *under_way > 0 => {
                let result = results.recv().ok()?;
                *under_way -= 1;
                Some(result)
            }
            _ => None,
        }
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        if let Self::File { records, thread, .. } = self {
            records.take();
            if let Some(thread) = thread.take() {
                // Its last write ends before the lock on the file goes.
                let _ = thread.join();
            }
        }
    }
}

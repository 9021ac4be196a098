//! What a bus carries, decoded while it runs, for whoever listens.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use codewheel_capture::{
    Assume, Bus, Condition, Content, Decoder, Direction, Medium, Output, Record, Timestamp,
};
use codewheel_device::product;
use codewheel_station::Instant;
use codewheel_station::can::Frame;

use crate::BusDescription;
use crate::ears::Ears;

/// So many frames or telegrams wait to be fetched at most: a second of a busy bus.
const WAITING: usize = 4_096;

/// A bus that is listened to. As long as nobody has one, tracing costs nothing.
///
/// The bus only copies what it carries; it is decoded by whoever fetches it. What is not fetched
/// waits, up to some thousand frames or telegrams, and then the oldest give way and are counted.
#[derive(Debug)]
pub struct Trace {
    ears: Arc<Ears>,
    ring: Arc<Ring>,
    bus: Bus,
    decoder: Mutex<Decoder>,
}

/// What came since lines were fetched last.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Traced {
    /// The newest lines, in order.
    pub lines: Vec<TraceLine>,
    /// How many came before them and are lost, because nobody fetched them in time.
    pub lost: u64,
}

/// A frame or telegram, and what it says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TraceLine {
    /// When it ended, from the start of the plant.
    pub at: Instant,
    /// The address of who sent it, where that is known.
    pub from: Option<u8>,
    /// The address of whom it is for, where that is known.
    pub to: Option<u8>,
    /// What kind of message it is: `poll response`.
    pub name: String,
    /// What it says: `position 4096 step, alarm OK`; empty where its name is all.
    pub text: String,
    /// The identifier of a frame as candump writes it: `3C5`; empty for a telegram.
    pub identifier: String,
    /// Its octets: `00 10 00 00`.
    pub octets: String,
}

/// What waits for one listener.
#[derive(Debug, Default)]
pub(crate) struct Ring {
    waiting: Mutex<Waiting>,
    news: Condvar,
}

#[derive(Debug, Default)]
struct Waiting {
    heard: VecDeque<Heard>,
    lost: u64,
}

/// A record of its own.
#[derive(Debug)]
struct Heard {
    at: Instant,
    direction: Direction,
    what: What,
}

#[derive(Debug)]
enum What {
    Frame(Frame),
    Telegram(Box<[u8]>, Condition),
}

impl Ring {
    pub(crate) fn put(&self, at: Instant, direction: Direction, content: Content<'_>) {
        let what = match content {
            Content::Frame(frame) => What::Frame(frame),
            Content::Telegram { octets, condition } => What::Telegram(octets.into(), condition),
        };
        let mut waiting = self.lock();
        if waiting.heard.len() == WAITING {
            waiting.heard.pop_front();
            waiting.lost += 1;
        }
        waiting.heard.push_back(Heard { at, direction, what });
        let was_empty = waiting.heard.len() == 1;
        drop(waiting);
        if was_empty {
            self.news.notify_all();
        }
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        // Nothing that is done under the lock panics, so what a poisoned one holds is good.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Trace {
    /// Begins to listen to the bus of `description`.
    pub(crate) fn begin(description: &BusDescription, ears: &Arc<Ears>) -> Self {
        let ring = Arc::new(Ring::default());
        ears.begin(Arc::clone(&ring));
        let medium = match description.bus {
            product::Bus::DeviceNet => Medium::DeviceNet,
            product::Bus::Profibus => Medium::Profibus,
        };
        Self {
            ears: Arc::clone(ears),
            ring,
            bus: Bus { name: String::new(), medium, bits_per_second: None },
            decoder: Mutex::new(Decoder::new(Output::Text, Assume::Encoders)),
        }
    }

    /// Waits for lines that have not been fetched, at most for `patience`.
    #[must_use]
    pub fn lines(&self, patience: Duration) -> Traced {
        let waiting = self.ring.lock();
        let nothing = |waiting: &mut Waiting| waiting.heard.is_empty();
        let (mut waiting, _) = self
            .ring
            .news
            .wait_timeout_while(waiting, patience, nothing)
            .unwrap_or_else(PoisonError::into_inner);
        let heard = std::mem::take(&mut waiting.heard);
        let lost = std::mem::take(&mut waiting.lost);
        drop(waiting);
        let mut decoder = self.decoder.lock().unwrap_or_else(PoisonError::into_inner);
        let lines = heard.iter().map(|heard| heard.line(&mut decoder, &self.bus)).collect();
        Traced { lines, lost }
    }
}

impl Drop for Trace {
    fn drop(&mut self) {
        self.ears.end(&self.ring);
    }
}

impl Heard {
    fn line(&self, decoder: &mut Decoder, bus: &Bus) -> TraceLine {
        let (content, octets, identifier) = match &self.what {
            What::Frame(frame) => {
                let text = frame.to_string();
                let identifier = text.split('#').next().unwrap_or_default().to_owned();
                (Content::Frame(*frame), frame.data(), identifier)
            }
            What::Telegram(octets, condition) => {
                let content = Content::Telegram { octets, condition: *condition };
                (content, &**octets, String::new())
            }
        };
        // Times of a bus count from its start, and so do those of a line.
        let at = Timestamp::from_nanos(self.at.as_nanos());
        let record = Record { at, bus: 0, direction: self.direction, content };
        let caption = decoder.caption(bus, &record);
        TraceLine {
            at: self.at,
            from: caption.from,
            to: caption.to,
            name: caption.message,
            text: caption.text,
            identifier,
            octets: hex(octets),
        }
    }
}

/// `00 10 00 00`.
fn hex(octets: &[u8]) -> String {
    let octets: Vec<String> = octets.iter().map(|octet| format!("{octet:02X}")).collect();
    octets.join(" ")
}

//! Encoders on DeviceNet: found, read, written and watched.
//!
//! | subject | |
//! |---|---|
//! | [`Console`] | the station: ears first, a scanner once it is to speak |
//! | [`Overheard`] | what the bus says by itself, all along |
//! | [`listen`], [`scan`] | who is on the bus |
//! | [`Encoder`] | one device as a [`Session`](crate::Session), ours or not |
//! | [`Eavesdropper`] | the positions of a device that belongs to another master |
//!
//! Nothing is sent before the bus was listened to, and a slave of another master is never
//! allocated, nor asked anything but for its vendor on the unconnected port, which it refuses.
//!
//! # Names
//! Of a device of ours: the keys of the rows of class 2Fh. Of every device: those of the Identity and
//! DeviceNet objects such as `serial-number` and `bus-off-interrupt`, `parameter/3` for an instance
//! of the Parameter object, and `05/1/9` for any attribute at all, as octets where nobody knows
//! more. `poll-assembly` and `change-assembly` are the produced paths of ours.
//!
//! A parameter that its device scales is told with what it means in its unit; written is the number
//! that lies on the bus, so that what is undone or carried over comes out even.
//!
//! # The order of writing
//! One setting takes others with it (AMG manual §8):
//!
//! 1. `direction` clears preset and offset;
//! 2. `steps-per-turn` sets the total resolution to steps × turns, and clears preset and offset;
//! 3. `total-resolution` clears preset and offset;
//! 4. `cos-delta` and the settings of the bus touch nothing else;
//! 5. `preset` last: writing it is an act, at the position of that moment, so no passport carries
//!    it as a setting.
//!
//! [`Encoder::values`](crate::Session::values) gives them in this order. Heartbeat interval, bus-off
//! interrupt and produced paths are kept as soon as they are written; all else lasts until power-off
//! unless it is saved.

mod console;
mod dialogue;
mod eavesdropper;
mod encoder;
mod identity;
mod objects;
mod overheard;
mod survey;
mod target;
mod troubles;
mod values;
mod watch;

use codewheel_devicenet::MacId;
use codewheel_station::Duration;

pub use console::Console;
pub use eavesdropper::Eavesdropper;
pub use encoder::{Encoder, OpenSettings};
pub use overheard::{Heard, Heartbeat, Intervals, Overheard, Production};
pub use survey::{ScanSettings, listen, scan};

/// Our own MAC ID where nobody chose one: 63 is what new nodes have, 0 what masters have.
pub const OWN_MAC: MacId = MacId::from_low_bits(62);

/// How long the bus is listened to at least before anything is sent.
pub const LISTEN_TIME: Duration = Duration::from_millis(1_100);

//! Bus traffic on file: recording it while a bus runs, reading it back, and naming what it says.
//!
//! | subject | |
//! |---|---|
//! | [`Recorder`] | takes what a running bus carries, at the cost of a copy, and writes it in a thread of its own |
//! | [`Writer`] | writes a file in place, for whoever has the time |
//! | [`Framer`] | makes telegrams of the octets that an RS-485 port brings |
//! | [`Reader`] | reads a file record by record |
//! | [`Decoder`] | names what a record says, as text or as JSON, live or from a file; tells programs what was [`Said`] |
//!
//! # Formats
//! The suffix of a file says its [`Format`]:
//!
//! | suffix | format | DeviceNet | PROFIBUS | times |
//! |---|---|---|---|---|
//! | `.log` | `candump -L` of can-utils; telegrams in the same way, see below | yes | yes | 1 µs |
//! | `.asc` | Vector; the date is UTC | yes | – | 1 µs |
//! | `.trc` | PEAK, written as 2.1, read from 1.1 on | yes | – | 1 µs |
//! | `.pcapng` | CAN as link type 227, telegrams as 147 (USER0), one a packet | yes | yes | 1 ns |
//!
//! A telegram stands in a `.log` file as a frame does, with its octets in the place of the frame:
//!
//! ```text
//! (1234567890.123456) can0 42B#0A8E00100000
//! (1234567890.123456) pb0 10 07 02 49 52 16 T
//! (1234567890.123459) pb0 68 05 05 !
//! ```
//! `T` says that the recording side sent it, `!` that it was not intact on the line. In `.pcapng`
//! these are the direction and the bit "symbol error" of the packet's flags.

mod bus;
mod decoder;
mod format;
mod framer;
mod hex;
mod lines;
mod reader;
mod record;
mod recorder;
mod said;
mod writer;

pub use bus::{Bus, Medium};
pub use decoder::{Assume, Caption, Decoder, Output, Replayed, replay};
pub use format::{Format, FormatError};
pub use framer::Framer;
pub use reader::{Damage, Place, ReadError, Reader};
pub use record::{Condition, Content, Direction, Record, Timestamp};
pub use recorder::{BusRecorder, Recorded, Recorder};
pub use said::{DeviceNetSaid, ProfibusSaid, Said};
pub use writer::{WriteError, Writer};

//! socketcand: CAN over TCP as words between `<` and `>`, which python-can, Kayak and SavvyCAN speak.
//!
//! We play the server, in raw mode: whoever opens the bus and asks for it sees every frame and sends
//! its own. The words ([`Word`]), the reader of a client's commands ([`CommandDecoder`]) and our side
//! of one client ([`Session`]) do no I/O: octets go in, in pieces of any size, and words and frames
//! come out.
//!
//! Source: socketcand, `doc/protocol.md`; where that text and the program part, what the program
//! writes and python-can reads: data octets of a received frame stand without blanks between them.

mod command;
mod session;
mod word;

pub use command::{Command, CommandDecoder, Malformed};
pub use session::{Effect, Session};
pub use word::Word;

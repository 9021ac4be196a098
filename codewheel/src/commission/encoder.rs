//! The encoder that a verb is about, from the moment its bus is opened until it is released.

use codewheel_commission::{Kind, Name, Session, Trouble, Value};
use codewheel_device::product::Bus;

use super::stoppable::Stop;
use crate::arguments::Chatter;
use crate::arguments::commission::{Consent, EncoderAddress};
use crate::failure::Failure;

/// An encoder that is served.
pub(super) struct Encoder<'a> {
    pub(super) session: Box<dyn Session>,
    /// What was typed.
    pub(super) at: &'a EncoderAddress,
    /// The rate of its bus in bit/s.
    pub(super) bit_rate: u32,
    /// A value that can be read over and over, to keep a connection in use.
    pub(super) pulse: Name,
    pub(super) chatter: Chatter,
    stop: Stop,
}

impl<'a> Encoder<'a> {
    pub(super) fn new(
        session: Box<dyn Session>,
        at: &'a EncoderAddress,
        bit_rate: u32,
        chatter: Chatter,
        stop: Stop,
    ) -> Self {
        // Of DeviceNet every device has the first attribute of its identity.
        let pulse = match session.bus() {
            Bus::DeviceNet => Name::Path { class: 1, instance: 1, attribute: 1 },
            Bus::Profibus => Name::Octet(1),
        };
        Self { session, at, bit_rate, pulse, chatter, stop }
    }

    /// Says something to a person, unless it is not wanted.
    pub(super) fn say(&self, text: &str) {
        if self.chatter > Chatter::Quiet {
            eprintln!("codewheel: {text}");
        }
    }

    /// Says what is about to be done: always to a person who is asked.
    pub(super) fn propose(&self, text: &str, consent: Consent) {
        if self.chatter > Chatter::Quiet || !consent.yes {
            text.lines().for_each(|line| eprintln!("codewheel: {line}"));
        }
    }

    /// Whether a person wants an end.
    pub(super) fn is_stopped(&self) -> bool {
        self.stop.was_asked()
    }

    /// The value with this key; `None` where the device has no such thing.
    pub(super) fn find(&mut self, key: &str) -> Result<Option<Value>, Trouble> {
        match self.session.value(&Name::Key(key.to_owned())) {
            Ok(value) => Ok(Some(value)),
            Err(trouble) if trouble.kind == Kind::Usage => Ok(None),
            Err(trouble) => Err(trouble),
        }
    }

    /// Ends the session, whatever became of `result`.
    pub(super) fn end<T>(mut self, result: Result<T, Failure>) -> Result<T, Failure> {
        let interrupted = self.stop.was_asked();
        self.stop.take();
        let released = self.session.release();
        for notice in self.session.take_notices() {
            self.say(&notice);
        }
        match (&result, released) {
            (Err(_), Ok(())) if interrupted => self.say("the encoder was released"),
            // What was asked for is done, and the watchdog of the device does the rest.
            (Ok(_), Err(trouble)) => self.say(&trouble.to_string()),
            _ => {}
        }
        if interrupted && result.is_err() { Err(Failure::Interrupted) } else { result }
    }
}

//! What is owed to the master: one answer, and the memory that tells a retry from a new request.
//!
//! A master that got no answer repeats its request with the same frame count bit, and the slave
//! repeats its answer without executing anything. The bit alone does not prove a retry: a master
//! that lost several answers falls back to Slave_Diag without toggling it, and a slave that went by
//! the bit would answer with the same stale data for ever. So only a request that is the last one
//! octet for octet is a retry (decision).

use codewheel_station::rs485::{BaudRate, Transmission};
use codewheel_station::{Deadline, Duration, Instant};

use crate::function_code::{FunctionCode, Reply};
use crate::telegram::Saps;

/// The shortest station delay of a responder, in bits, and the one before the first Set_Prm.
pub(crate) const SHORTEST_STATION_DELAY: u8 = 11;

/// The kind of answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// SC.
    ShortAcknowledge,
    /// SD1 with nothing but this.
    Bare(Reply),
    /// Slave_Diag.
    Diagnosis,
    /// Get_Cfg.
    Configuration,
    /// Data_Exchange.
    DataExchange,
    /// RD_Inp.
    Inputs,
    /// RD_Outp.
    Outputs,
}

/// An answer that is owed, and to whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Owed {
    pub(crate) answer: Answer,
    pub(crate) master: u8,
    /// As the answer carries them: swapped.
    pub(crate) saps: Option<Saps>,
}

/// Remembers one request and its answer, and when that is to be sent.
#[derive(Clone, Debug)]
pub(crate) struct Responder {
    /// Min T_SDR in bits, 11 … 255.
    station_delay: u8,
    /// The same as a span of time at the rate in force.
    delay: Duration,
    /// From when on the answer is to be sent; never where none is owed.
    due: Deadline,
    owed: Owed,
    /// FC of the request remembered: most new requests differ in it.
    code: FunctionCode,
    /// The request remembered; empty for none.
    request: Transmission,
    /// The answer; empty where it was not yet fetched.
    pub(crate) answer: Transmission,
}

impl Responder {
    pub(crate) fn new(rate: BaudRate) -> Self {
        Self {
            station_delay: SHORTEST_STATION_DELAY,
            delay: rate.bits(u32::from(SHORTEST_STATION_DELAY)),
            due: Deadline::NEVER,
            owed: Owed { answer: Answer::ShortAcknowledge, master: 0, saps: None },
            code: FunctionCode(0),
            request: Transmission::EMPTY,
            answer: Transmission::EMPTY,
        }
    }

    /// The rate is another from now on.
    pub(crate) fn set_rate(&mut self, rate: BaudRate) {
        self.delay = rate.bits(u32::from(self.station_delay));
    }

    /// Min T_SDR from the next answer on; the one that is owed keeps its time.
    pub(crate) fn set_station_delay(&mut self, bits: u8, rate: BaudRate) {
        self.station_delay = bits.max(SHORTEST_STATION_DELAY);
        self.set_rate(rate);
    }

    /// When an answer to a request that ended at `now` is to be sent.
    #[inline]
    pub(crate) fn answer_time(&self, now: Instant) -> Deadline {
        Deadline::at(now + self.delay)
    }

    /// Whether the request is the one remembered, octet for octet.
    #[inline]
    pub(crate) fn is_retry(&self, code: FunctionCode, octets: &[u8]) -> bool {
        code == self.code && self.request.octets() == octets
    }

    /// Remembers a request that was executed.
    #[inline]
    pub(crate) fn remember(&mut self, code: FunctionCode, octets: &[u8]) {
        self.code = code;
        self.request.set(octets);
    }

    /// No request that comes is a retry.
    #[inline]
    pub(crate) fn forget(&mut self) {
        self.request.set_length(0);
    }

    /// The slave has no master any more. What is owed is said all the same, as it is from now on:
    /// process data is for masters, so RS stands in its place.
    pub(crate) fn lose_master(&mut self) {
        if matches!(self.owed.answer, Answer::DataExchange | Answer::Inputs | Answer::Outputs) {
            self.owed.answer = Answer::Bare(Reply::NotActivated);
        }
        self.answer.set_length(0);
        self.forget();
    }

    /// Nothing is owed any more. What the answer would have said is built anew for a retry, where
    /// it was not fetched.
    #[inline]
    pub(crate) fn cancel(&mut self) {
        self.due = Deadline::NEVER;
    }

    /// An answer is owed to a new request.
    #[inline]
    pub(crate) fn owe(&mut self, owed: Owed, due: Deadline) {
        self.owed = owed;
        self.due = due;
        self.answer.set_length(0);
    }

    /// The same answer is owed again, as it was built, where it was.
    #[inline]
    pub(crate) fn owe_again(&mut self, due: Deadline) {
        self.due = due;
    }

    pub(crate) const fn due(&self) -> Deadline {
        self.due
    }

    /// What is to be sent at `now`; it counts as sent.
    #[inline]
    pub(crate) fn take_due(&mut self, now: Instant) -> Option<Owed> {
        self.due.take_due(now).then_some(self.owed)
    }
}

//! profirust's end of the line.

use codewheel_station::rs485::{CHARACTER_BITS, TRANSMISSION_OCTETS};
use profirust::phy::ProfibusPhy;
use profirust::time::Instant;

use super::clock::Tick;

/// What profirust reads from and writes to: telegrams that were found fit go in, a telegram to be
/// sent comes out.
///
/// It also notes what profirust takes for the last activity of the bus, from which all its waiting
/// counts; that makes deadlines of what would otherwise have to be asked every microsecond.
#[derive(Debug)]
pub(super) struct Line {
    /// Telegrams for profirust, whole ones, back to back.
    inbox: Vec<u8>,
    outgoing: Vec<u8>,
    speaks_until: Option<Tick>,
    /// profirust's `last_bus_activity`.
    activity: Option<Tick>,
    /// What profirust believes to wait for it. It notices activity where this number grows.
    pending: usize,
    heard: bool,
}

impl Line {
    pub(super) fn new() -> Self {
        Self {
            inbox: Vec::with_capacity(2 * TRANSMISSION_OCTETS),
            outgoing: Vec::with_capacity(TRANSMISSION_OCTETS),
            speaks_until: None,
            activity: None,
            pending: 0,
            heard: false,
        }
    }

    /// Octets came, good ones or bad.
    pub(super) const fn hear(&mut self) {
        self.heard = true;
    }

    /// A telegram for profirust.
    pub(super) fn deliver(&mut self, telegram: &[u8]) {
        self.inbox.extend_from_slice(telegram);
    }

    /// Octets of telegrams that profirust has not taken.
    pub(super) const fn waiting(&self) -> usize {
        self.inbox.len()
    }

    /// The telegram that profirust wants to send; empty without one.
    pub(super) const fn outgoing(&mut self) -> &mut Vec<u8> {
        &mut self.outgoing
    }

    /// Since when the bus is quiet to profirust, which may lie ahead; `None` before its first poll.
    pub(super) const fn quiet_since(&self) -> Option<Tick> {
        self.activity
    }

    /// profirust was begun anew.
    pub(super) fn reset(&mut self) {
        self.inbox.clear();
        self.activity = None;
    }

    /// profirust was polled: at the latest now it has taken the bus for active once.
    pub(super) const fn polled(&mut self, now: Tick) {
        if self.activity.is_none() {
            self.activity = Some(now);
        }
    }

    fn note_activity(&mut self, now: Tick) {
        self.activity = self.activity.max(Some(now));
    }
}

impl ProfibusPhy for Line {
    fn poll_transmission(&mut self, now: Instant) -> bool {
        self.speaks_until.is_some_and(|end| Tick::from_time(now) < end)
    }

    fn transmit_data<F, R>(&mut self, now: Instant, write: F) -> R
    where
        F: FnOnce(&mut [u8]) -> (usize, R),
    {
        let mut buffer = [0; TRANSMISSION_OCTETS + 1];
        let (length, result) = write(&mut buffer);
        let octets = buffer.get(..length).unwrap_or_default();
        if !octets.is_empty() {
            self.outgoing.clear();
            self.outgoing.extend_from_slice(octets);
            let bits = u32::try_from(length).unwrap_or(u32::MAX).saturating_mul(CHARACTER_BITS);
            let end = Tick::from_time(now).after_bits(bits);
            self.speaks_until = Some(end);
            self.activity = Some(end);
            // Whatever came before is no answer to this.
            self.inbox.clear();
        }
        result
    }

    fn receive_data<F, R>(&mut self, now: Instant, read: F) -> R
    where
        F: FnOnce(&[u8]) -> (usize, R),
    {
        let (taken, result) = read(&self.inbox);
        if taken > 0 {
            self.inbox.drain(..taken.min(self.inbox.len()));
            self.pending = 0;
            self.note_activity(Tick::from_time(now));
        }
        result
    }

    fn poll_pending_received_bytes(&mut self, now: Instant) -> usize {
        if self.heard {
            self.heard = false;
            self.pending += 1;
            self.note_activity(Tick::from_time(now));
        }
        self.pending
    }
}

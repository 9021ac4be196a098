//! The station of whoever commissions: ears first, and a scanner once it is to speak.

use codewheel_devicenet::scanner::{Scanner, ScannerIdentity};
use codewheel_devicenet::{Fault, MacId};
use codewheel_station::can::{Frame, Input};
use codewheel_station::{Duration, Instant, Station};

use super::overheard::Overheard;
use crate::Owner;

/// Who the console says it is when it checks its own MAC ID. No vendor has this code (decision).
const IDENTITY: ScannerIdentity = ScannerIdentity { vendor: 0xFFFF, serial: 0xC0DE_5CA9 };
/// How often a slave is polled that is watched. With TCP and a pty in between, less is a queue.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// A node that listens from the beginning, and sends nothing at all until it is told to
/// [speak](Self::speak).
///
/// What it hears is in [`overheard`](Self::overheard), also while it speaks.
#[derive(Clone, Debug, Default)]
pub struct Console {
    overheard: Overheard,
    scanner: Option<Box<Scanner>>,
    out: Option<Fault>,
    outages: u32,
}

impl Console {
    /// A console that listens.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// What the bus said by itself.
    #[must_use]
    pub const fn overheard(&self) -> &Overheard {
        &self.overheard
    }

    /// To whom the slave at `mac` belongs, besides ourselves, by what was heard so far; `None` where
    /// nothing was.
    #[must_use]
    pub fn owner(&self, now: Instant, mac: MacId) -> Option<Owner> {
        self.overheard.node(mac).owner(now)
    }

    /// Goes on line at `mac`: checks for two seconds whether the address is free, then does what the
    /// [scanner](Self::scanner_mut) is told. Ask `transmit` afterwards.
    ///
    /// Listen for a while before, and see that nobody was heard at `mac`.
    pub fn speak(&mut self, now: Instant, mac: MacId) {
        let mut scanner = Box::new(Scanner::new(mac, IDENTITY, POLL_INTERVAL));
        match self.out {
            Some(Fault::Detached) => scanner.handle(now, Input::Detached),
            Some(_) => scanner.handle(now, Input::BusOff),
            None => {}
        }
        self.scanner = Some(scanner);
    }

    /// Sends nothing from now on. What was allocated is left to its watchdog: remove it before.
    pub fn fall_silent(&mut self) {
        self.scanner = None;
    }

    /// The scanner, while the console speaks.
    #[must_use]
    pub fn scanner(&self) -> Option<&Scanner> {
        self.scanner.as_deref()
    }

    /// The scanner, to be told something.
    pub fn scanner_mut(&mut self) -> Option<&mut Scanner> {
        self.scanner.as_deref_mut()
    }

    /// Its own address, while it speaks.
    #[must_use]
    pub fn mac(&self) -> Option<MacId> {
        self.scanner().map(Scanner::mac)
    }

    /// Why it cannot be heard now: bus-off, no way to the bus, or another node at its address.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.out.or_else(|| self.scanner().and_then(Scanner::faulted))
    }

    /// How often it has left the bus, so that one that ended at once is not missed.
    #[must_use]
    pub const fn outages(&self) -> u32 {
        self.outages
    }

    fn leaves(&mut self, fault: Fault) {
        self.out = Some(fault);
        self.outages = self.outages.wrapping_add(1);
        self.overheard.was_deaf();
    }
}

impl Station for Console {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        match input {
            Input::BusOff => self.leaves(Fault::BusOff),
            Input::Detached => self.leaves(Fault::Detached),
            Input::Recovered | Input::Attached => self.out = None,
            Input::Frame(_) | Input::Sent(_) => {}
        }
        if self.out.is_none() {
            self.overheard.listens(now);
        }
        if let Input::Frame(frame) = input {
            let scanner = self.scanner.as_deref();
            let ours = |mac| scanner.is_some_and(|scanner| scanner.slave(mac).is_some());
            self.overheard.hear(now, frame, ours);
        }
        if let Some(scanner) = &mut self.scanner {
            scanner.handle(now, input);
        }
    }

    fn advance(&mut self, now: Instant) {
        if self.out.is_none() {
            self.overheard.listens(now);
        }
        if let Some(scanner) = &mut self.scanner {
            scanner.advance(now);
        }
    }

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        self.scanner.as_mut()?.transmit(now)
    }

    fn deadline(&self) -> Option<Instant> {
        self.scanner.as_ref()?.deadline()
    }
}

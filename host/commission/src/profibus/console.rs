//! The station from which people look at a bus: ears first, and a master when it is told to speak.

use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Instant, Station};

use super::{Master, MasterSettings, Overheard, SettingsError, Timeless};

/// SD4, the start delimiter of a token.
const TOKEN: u8 = 0xDC;

/// Ears on a bus, which become a master when they are told to [`speak`](Self::speak).
///
/// It begins without a voice: it sends nothing at all, and notes what it [hears](Self::overheard).
#[derive(Debug)]
pub struct Console {
    baud_rate: BaudRate,
    overheard: Overheard,
    master: Option<Timeless<Master>>,
    /// It falls silent with the next token that it hands on.
    leaves: bool,
}

impl Console {
    /// Ears at a rate.
    #[must_use]
    pub fn new(baud_rate: BaudRate) -> Self {
        Self { baud_rate, overheard: Overheard::new(baud_rate), master: None, leaves: false }
    }

    /// What was heard of others so far. Nothing of what the own master asks is in it.
    #[must_use]
    pub const fn overheard(&self) -> &Overheard {
        &self.overheard
    }

    /// Brings in a master without slaves, at the rate of the console: it takes the token where
    /// nobody has it, and waits to be admitted where somebody does.
    ///
    /// # Errors
    /// What is wrong with the settings; the console stays as it is.
    pub fn speak(&mut self, settings: MasterSettings) -> Result<(), SettingsError> {
        let settings = MasterSettings { baud_rate: self.baud_rate, ..settings };
        self.master = Some(Timeless::new(Master::new(settings, Vec::new())?));
        self.leaves = false;
        Ok(())
    }

    /// The master, while there is one.
    #[must_use]
    pub fn master(&self) -> Option<&Master> {
        self.master.as_ref().map(Timeless::station)
    }

    /// The master, to be told and asked.
    pub fn master_mut(&mut self) -> Option<&mut Master> {
        self.master.as_mut().map(Timeless::station_mut)
    }

    /// Falls silent in an orderly way: the master serves nobody any more, hands the token on, and is
    /// gone. The ring notices that it does not take the next one.
    pub fn leave(&mut self) {
        self.leaves = true;
        if let Some(master) = self.master_mut() {
            master.stop();
            master.ask_no_more();
        }
        if !self.master().is_some_and(Master::is_in_ring) {
            self.master = None;
        }
    }
}

impl Station for Console {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        self.overheard.hear(now, input);
        if let Some(master) = &mut self.master {
            master.handle(now, input);
        }
    }

    fn advance(&mut self, now: Instant) {
        if let Some(master) = &mut self.master {
            master.advance(now);
        }
    }

    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        let telegram = self.master.as_mut()?.transmit(now)?;
        self.overheard.interrupt();
        if self.leaves && telegram.octets().first() == Some(&TOKEN) {
            self.master = None;
        }
        Some(telegram)
    }

    fn deadline(&self) -> Option<Instant> {
        self.master.as_ref()?.deadline()
    }
}

impl Node for Console {
    fn baud_rate(&self) -> BaudRate {
        self.baud_rate
    }
}

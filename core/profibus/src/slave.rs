//! The DP-V0 slave.

use codewheel_station::rs485::{BaudRate, Input, Transmission};
use codewheel_station::{Duration, Instant};

use crate::Application;

/// How the slave comes to its rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Baud {
    /// It searches the line.
    Search,
    /// It is given.
    Fixed(BaudRate),
}

/// What the link knows of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timing {
    /// Bit times (a UART in firmware, the simulated wire): a gap inside a telegram breaks it, and
    /// 33 idle bits are demanded before a request.
    Exact,
    /// A PC's port (tty, pty, TCP): a telegram is abandoned after 50 ms without an octet, or 33 bits
    /// where that is longer, and no idle bits are demanded.
    Coarse,
}

/// What a slave is told at power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Its station address, TS, 0 … 125.
    pub address: u8,
    /// Its ident number.
    pub ident_number: u16,
    /// How it comes to its rate.
    pub baud: Baud,
    /// What the link knows of time.
    pub timing: Timing,
}

/// The states of a DP slave (EN 50170-2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum State {
    /// Waits for parameters.
    WaitPrm,
    /// Waits for the configuration.
    WaitCfg,
    /// Exchanges data.
    DataExchange,
}

/// The fault bits of station status 1; they stay until the next Set_Prm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// Prm_Fault.
    pub parameters: bool,
    /// Cfg_Fault.
    pub configuration: bool,
    /// Not_Supported.
    pub not_supported: bool,
}

/// What has been counted since power-up; each counter stops at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Error-free telegrams of any station.
    pub telegrams: u32,
    /// Requests to this station that were executed.
    pub requests: u32,
    /// Requests answered with the stored answer.
    pub retries: u32,
    /// Broken telegrams and characters.
    pub broken: u32,
}

/// A DP-V0 slave with at most `N` octets of inputs and as many of outputs.
#[derive(Clone, Debug)]
pub struct Slave<const N: usize> {
    settings: Settings,
}

impl<const N: usize> Slave<N> {
    /// A slave at power-up: WAIT_PRM, no master.
    #[must_use]
    pub const fn new(settings: Settings) -> Self {
        Self { settings }
    }

    /// Takes in what arrived at `now`.
    pub fn handle<A: Application>(&mut self, _now: Instant, _input: Input<'_>, _app: &mut A) {}

    /// Runs whatever fell due up to `now`.
    pub fn advance<A: Application>(&mut self, _now: Instant, _app: &mut A) {}

    /// The answer that is owed, from its time on.
    pub fn transmit<A: Application>(
        &mut self,
        _now: Instant,
        _app: &mut A,
    ) -> Option<Transmission> {
        None
    }

    /// When [`advance`](Self::advance) or [`transmit`](Self::transmit) must be called at the latest.
    #[must_use]
    pub const fn deadline(&self) -> Option<Instant> {
        None
    }

    /// What it was told at power-up.
    #[must_use]
    pub const fn settings(&self) -> Settings {
        self.settings
    }

    /// The rate it listens at, found or only tried.
    #[must_use]
    pub const fn baud_rate(&self) -> BaudRate {
        match self.settings.baud {
            Baud::Fixed(rate) => rate,
            Baud::Search => BaudRate::Mbit12,
        }
    }

    /// Whether the rate is given or has been found.
    #[must_use]
    pub const fn has_baud_rate(&self) -> bool {
        matches!(self.settings.baud, Baud::Fixed(_))
    }

    /// Its state.
    #[must_use]
    pub const fn state(&self) -> State {
        State::WaitPrm
    }

    /// The master it is locked by.
    #[must_use]
    pub const fn master(&self) -> Option<u8> {
        None
    }

    /// The watchdog time, while the watchdog is on.
    #[must_use]
    pub const fn watchdog(&self) -> Option<Duration> {
        None
    }

    /// The fault bits.
    #[must_use]
    pub const fn faults(&self) -> Faults {
        Faults { parameters: false, configuration: false, not_supported: false }
    }

    /// Whether it is in Sync mode: outputs wait for the next Sync.
    #[must_use]
    pub const fn is_in_sync_mode(&self) -> bool {
        false
    }

    /// Whether it is in Freeze mode: inputs stay as they were at the last Freeze.
    #[must_use]
    pub const fn is_in_freeze_mode(&self) -> bool {
        false
    }

    /// What has been counted.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        Counters { telegrams: 0, requests: 0, retries: 0, broken: 0 }
    }
}

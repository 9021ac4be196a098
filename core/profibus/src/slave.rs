//! The DP-V0 slave.

use codewheel_station::rs485::{BaudRate, Input, Transmission};
use codewheel_station::{Duration, Instant};

use crate::baud_search::{BaudSearch, Change};
use crate::function_code::{Function, Reply};
use crate::machine::Machine;
use crate::receiver::{Received, Receiver};
use crate::responder::{Answer, Owed, Responder};
use crate::telegram::{BROADCAST, Data, Telegram};
use crate::{Application, Event, sap};

/// The highest address that a station can have.
const LAST_STATION: u8 = 125;

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

/// A DP-V0 slave with at most `N` octets of inputs and as many of outputs. A configuration that
/// needs more is refused.
#[derive(Clone, Debug)]
pub struct Slave<const N: usize> {
    settings: Settings,
    counters: Counters,
    baud: BaudSearch,
    machine: Machine<N>,
    receiver: Receiver,
    responder: Responder,
}

impl<const N: usize> Slave<N> {
    /// A slave at power-up: WAIT_PRM, no master.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let baud = BaudSearch::new(settings.baud);
        Self {
            settings,
            counters: Counters { telegrams: 0, requests: 0, retries: 0, broken: 0 },
            responder: Responder::new(baud.rate()),
            baud,
            machine: Machine::new(settings.ident_number),
            receiver: Receiver::new(settings.timing),
        }
    }

    /// Takes in what arrived at `now`. Call [`transmit`](Self::transmit) and read
    /// [`deadline`](Self::deadline) next.
    pub fn handle<A: Application>(&mut self, now: Instant, input: Input<'_>, app: &mut A) {
        self.watch_master(now, app);
        // The rate changes after the octets that were received at it.
        match input {
            Input::Octets(octets) => self.octets(now, octets, app),
            Input::BrokenCharacter => {
                self.responder.cancel();
                self.receiver.drop_until_idle(now);
                self.count_broken();
            }
        }
        self.search_rate(now, app);
    }

    /// Runs whatever fell due up to `now`: the watchdog, and the search for the rate of the line.
    pub fn advance<A: Application>(&mut self, now: Instant, app: &mut A) {
        self.watch_master(now, app);
        self.search_rate(now, app);
    }

    #[inline]
    fn watch_master<A: Application>(&mut self, now: Instant, app: &mut A) {
        if self.machine.advance(now, app) {
            self.responder.lose_master();
        }
    }

    #[inline]
    fn search_rate<A: Application>(&mut self, now: Instant, app: &mut A) {
        let Some(change) = self.baud.advance(now) else { return };
        self.responder.cancel();
        self.responder.set_rate(self.baud.rate());
        self.receiver.drop_until_idle(now);
        if change == Change::Lost {
            app.notice(now, Event::BaudRateLost);
        }
    }

    #[inline]
    fn octets<A: Application>(&mut self, now: Instant, octets: &[u8], app: &mut A) {
        if octets.is_empty() {
            return;
        }
        if self.receiver.arrive(now, octets.len(), self.baud.rate()) {
            self.count_broken();
        }
        let mut rest = octets;
        while !rest.is_empty() {
            // Whoever sends now has not waited for the answer.
            self.responder.cancel();
            let copy;
            let (data, octets) = match self.receiver.whole(rest) {
                Some(Telegram::Data(data)) => {
                    let octets;
                    (octets, rest) = rest.split_at_checked(data.length()).unwrap_or_default();
                    (data, octets)
                }
                Some(telegram) => {
                    rest = rest.get(telegram.length()..).unwrap_or_default();
                    self.without_data(&telegram);
                    continue;
                }
                None => {
                    (rest, copy) = self.piece(rest);
                    match Telegram::decode(copy.octets()) {
                        Ok(Some(Telegram::Data(data))) => (data, copy.octets()),
                        Ok(Some(telegram)) => {
                            self.without_data(&telegram);
                            continue;
                        }
                        _ => continue,
                    }
                }
            };
            self.data(now, &data, octets, app);
        }
    }

    /// Takes what is no whole telegram: what is left of it, and the telegram that it completes.
    // Apart, so that its buffer costs a whole telegram nothing.
    #[inline(never)]
    fn piece<'a>(&mut self, octets: &'a [u8]) -> (&'a [u8], Transmission) {
        let (used, received) = self.receiver.take(octets);
        if received == Received::Broken {
            self.count_broken();
        }
        // The receiver goes on with its buffer while the telegram is executed.
        let mut copy = Transmission::EMPTY;
        if received == Received::Telegram {
            copy.set(self.receiver.pieced());
        }
        (octets.get(used..).unwrap_or_default(), copy)
    }

    /// SD4 or SC.
    fn without_data(&mut self, telegram: &Telegram<'_>) {
        count(&mut self.counters.telegrams);
        self.receiver.end_telegram();
        if matches!(telegram, Telegram::Token { .. }) {
            self.responder.forget();
        }
    }

    /// SD1, SD2 or SD3 that ended at `now`; `octets` are all of it.
    #[inline]
    fn data<A: Application>(&mut self, now: Instant, data: &Data<'_>, octets: &[u8], app: &mut A) {
        count(&mut self.counters.telegrams);
        let after_idle = self.receiver.end_telegram();
        if self.baud.heard(now) {
            app.notice(now, Event::BaudRateFound(self.baud.rate()));
        }
        if let Some(function) = data.function_code().function() {
            if after_idle {
                self.request(now, function, data, octets, app);
            } else {
                count(&mut self.counters.broken);
            }
        }
    }

    #[inline]
    fn request<A: Application>(
        &mut self,
        now: Instant,
        function: Function,
        data: &Data<'_>,
        octets: &[u8],
        app: &mut A,
    ) {
        let (destination, master) = (data.destination(), data.source());
        if master > LAST_STATION || master == self.settings.address {
            return;
        }
        let unacknowledged = matches!(function, Function::SdnLow | Function::SdnHigh);
        if destination == self.settings.address && !unacknowledged {
            self.answer(now, function, data, octets, app);
        } else if destination == self.settings.address || destination == BROADCAST {
            let saps = data.saps().ok().flatten();
            if unacknowledged && saps.is_some_and(|saps| saps.destination == sap::GLOBAL_CONTROL) {
                self.machine.global_control(now, master, data.data(), app);
            }
        } else {
            self.responder.forget();
        }
    }

    /// A request to this station that demands an answer.
    #[inline]
    fn answer<A: Application>(
        &mut self,
        now: Instant,
        function: Function,
        data: &Data<'_>,
        octets: &[u8],
        app: &mut A,
    ) {
        let code = data.function_code();
        let master = data.source();
        let due = self.responder.answer_time(now);
        let for_data = matches!(function, Function::SrdLow | Function::SrdHigh);
        if for_data && self.machine.master == Some(master) {
            self.machine.watchdog.retrigger(now);
        }
        if code.frame_count_valid() && self.responder.is_retry(code, octets) {
            count(&mut self.counters.retries);
            self.responder.owe_again(due);
            return;
        }
        count(&mut self.counters.requests);
        let counted = code.frame_count() || code.frame_count_valid();
        if counted && function != Function::FdlStatus {
            self.responder.remember(code, octets);
        } else {
            self.responder.forget();
        }
        let (answer, saps) = match (data.saps(), for_data) {
            (Ok(None), true) => (self.machine.exchange(now, master, data.unit(), app), None),
            (Ok(Some(saps)), true) => {
                let service = saps.destination;
                let answer = self.machine.serve(now, master, service, data.data(), app);
                // Set_Prm may have changed it, from the next answer on.
                self.responder.set_station_delay(self.machine.station_delay, self.baud.rate());
                (answer, Some(saps.swapped()))
            }
            (Ok(_), _) if function == Function::FdlStatus => (Answer::Bare(Reply::Ok), None),
            _ => (Answer::Bare(Reply::NotActivated), None),
        };
        self.responder.owe(Owed { answer, master, saps }, due);
    }

    /// At a rate that is only tried nothing is known to be broken.
    fn count_broken(&mut self) {
        if self.baud.is_settled() {
            self.counters.broken = self.counters.broken.saturating_add(1);
        }
    }

    /// The answer that is owed, from its time on. Inputs and diagnosis are those of this call.
    pub fn transmit<A: Application>(&mut self, now: Instant, app: &mut A) -> Option<Transmission> {
        let owed = self.responder.take_due(now)?;
        let Self { machine, responder, settings, .. } = self;
        if responder.answer.is_empty() {
            let room = responder.answer.room();
            let length = machine.build(now, settings.address, owed, room, app)?;
            responder.answer.set_length(length);
        }
        Some(responder.answer)
    }

    /// When [`advance`](Self::advance) or [`transmit`](Self::transmit) must be called at the
    /// latest. A search for the rate wants its first call at once: the origin of time.
    #[must_use]
    pub fn deadline(&self) -> Option<Instant> {
        let due = self.responder.due().or_earlier(self.machine.watchdog.expires());
        due.or_earlier(self.baud.deadline()).instant()
    }

    /// What it was told at power-up.
    #[must_use]
    pub const fn settings(&self) -> Settings {
        self.settings
    }

    /// The rate it listens at, found or only tried.
    #[must_use]
    pub const fn baud_rate(&self) -> BaudRate {
        self.baud.rate()
    }

    /// Whether the rate is given or has been found.
    #[must_use]
    pub const fn has_baud_rate(&self) -> bool {
        self.baud.is_settled()
    }

    /// Its state.
    #[must_use]
    pub const fn state(&self) -> State {
        self.machine.state
    }

    /// The master it is locked by.
    #[must_use]
    pub const fn master(&self) -> Option<u8> {
        self.machine.master
    }

    /// The watchdog time, while the watchdog is on.
    #[must_use]
    pub const fn watchdog(&self) -> Option<Duration> {
        self.machine.watchdog.period()
    }

    /// Min T_SDR, 11 … 255 bits: how long an answer waits after its request.
    #[must_use]
    pub const fn station_delay(&self) -> u8 {
        self.machine.station_delay
    }

    /// The fault bits.
    #[must_use]
    pub const fn faults(&self) -> Faults {
        self.machine.faults
    }

    /// Whether it is in Sync mode: outputs wait for the next Sync.
    #[must_use]
    pub const fn is_in_sync_mode(&self) -> bool {
        self.machine.data.sync
    }

    /// Whether it is in Freeze mode: inputs stay as they were at the last Freeze.
    #[must_use]
    pub const fn is_in_freeze_mode(&self) -> bool {
        self.machine.data.freeze
    }

    /// What has been counted.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.counters
    }
}

#[inline]
fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}

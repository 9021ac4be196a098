//! The state machine of a DP slave: which service does what in which state (EN 50170-2).

use codewheel_station::rs485::TRANSMISSION_OCTETS;
use codewheel_station::{Instant, Writer};

use crate::function_code::Reply;
use crate::parameters::{Parameters, SetParameters, asks_for_more};
use crate::process_data::ProcessData;
use crate::responder::{Answer, SHORTEST_STATION_DELAY};
use crate::sap;
use crate::watchdog::Watchdog;
use crate::{Application, Event, Faults, Loss, State};

const REFUSED: Answer = Answer::Bare(Reply::NotActivated);

/// The DP side of a slave.
#[derive(Clone, Debug)]
pub(crate) struct Machine<const N: usize> {
    pub(crate) ident_number: u16,
    pub(crate) state: State,
    /// The master that locked the slave; in WAIT_CFG and DATA_EXCH there is one.
    pub(crate) master: Option<u8>,
    pub(crate) faults: Faults,
    /// The master whose Set_Prm was refused last.
    refused: Option<u8>,
    /// Min T_SDR in bits, 11 … 255. It outlasts its master.
    pub(crate) station_delay: u8,
    groups: u8,
    /// Sync_Req and Freeze_Req.
    may: (bool, bool),
    pub(crate) watchdog: Watchdog,
    pub(crate) data: ProcessData<N>,
    /// The version of the diagnosis that the owner has read; `None` where it must read the first.
    pub(crate) diagnosis_read: Option<u16>,
    /// The owner that read it.
    diagnosis_reader: u8,
}

impl<const N: usize> Machine<N> {
    pub(crate) const fn new(ident_number: u16) -> Self {
        Self {
            ident_number,
            state: State::WaitPrm,
            master: None,
            faults: Faults { parameters: false, configuration: false, not_supported: false },
            refused: None,
            station_delay: SHORTEST_STATION_DELAY,
            groups: 0,
            may: (false, false),
            watchdog: Watchdog::OFF,
            data: ProcessData::new(),
            diagnosis_read: None,
            diagnosis_reader: 0,
        }
    }

    /// Executes a request to a service access point and says what is to be answered.
    // Apart, as all that is rare: Data_Exchange is not to save registers for it.
    #[inline(never)]
    pub(crate) fn serve<A: Application>(
        &mut self,
        now: Instant,
        master: u8,
        service: u8,
        data: &[u8],
        app: &mut A,
    ) -> Answer {
        let exchanging = self.state == State::DataExchange;
        match service {
            sap::SLAVE_DIAGNOSIS => Answer::Diagnosis,
            sap::GET_CONFIGURATION => Answer::Configuration,
            sap::SET_PARAMETERS => self.set_parameters(now, master, data, app),
            sap::CHECK_CONFIGURATION => self.check_configuration(now, master, data, app),
            sap::READ_INPUTS if exchanging => match self.data.lengths().inputs {
                0 => Answer::Bare(Reply::NotReady),
                _ => Answer::Inputs,
            },
            sap::READ_OUTPUTS if exchanging => match self.data.lengths().outputs {
                0 => Answer::Bare(Reply::NotReady),
                _ => Answer::Outputs,
            },
            _ => REFUSED,
        }
    }

    /// Data_Exchange.
    #[inline]
    pub(crate) fn exchange<A: Application>(
        &mut self,
        now: Instant,
        master: u8,
        outputs: &[u8],
        app: &mut A,
    ) -> Answer {
        if self.state != State::DataExchange || self.master != Some(master) {
            return REFUSED;
        }
        let expected = self.data.lengths().outputs;
        if outputs.len() == usize::from(expected) {
            self.data.receive(now, outputs, app);
        } else if outputs.is_empty() {
            self.data.clear(now, app);
        } else {
            let given = u8::try_from(outputs.len()).unwrap_or(u8::MAX);
            self.leave(now, Loss::OutputLength { given, expected }, app);
            return REFUSED;
        }
        Answer::DataExchange
    }

    fn set_parameters<A: Application>(
        &mut self,
        now: Instant,
        master: u8,
        octets: &[u8],
        app: &mut A,
    ) -> Answer {
        if self.is_strange(now, master, app) {
            return REFUSED;
        }
        match SetParameters::read(octets, self.ident_number) {
            Ok(SetParameters::StationDelay(bits)) => self.set_station_delay(bits),
            Ok(SetParameters::Unlock) => {
                self.faults = Faults::default();
                self.refused = None;
                if self.state != State::WaitPrm {
                    self.leave(now, Loss::Unlocked, app);
                }
            }
            Ok(SetParameters::Lock(parameters)) => self.lock(now, master, parameters, app),
            Err(fault) => {
                app.notice(now, Event::ParametersRefused(fault));
                app.parameters_refused(now);
                self.refuse_parameters(now, master, asks_for_more(octets), app);
            }
        }
        Answer::ShortAcknowledge
    }

    fn lock<A: Application>(
        &mut self,
        now: Instant,
        master: u8,
        parameters: Parameters<'_>,
        app: &mut A,
    ) {
        if app.parameterize(now, parameters.user).is_err() {
            self.refuse_parameters(now, master, false, app);
            return;
        }
        self.state = State::WaitCfg;
        self.master = Some(master);
        self.faults = Faults::default();
        self.refused = None;
        self.set_station_delay(parameters.station_delay);
        self.groups = parameters.groups;
        self.may = (parameters.sync, parameters.freeze);
        self.watchdog = Watchdog::start(now, parameters.watchdog);
        self.data.reset();
        if !app.has_diagnosis() {
            if self.diagnosis_read.is_none() {
                self.diagnosis_read = Some(app.diagnosis_version());
            }
        } else if self.diagnosis_reader != master {
            // What another master has read, this one has not.
            self.diagnosis_read = None;
        }
        app.notice(now, Event::Parameterized { master });
        if parameters.reserved != 0 {
            app.notice(now, Event::ReservedStationStatus { bits: parameters.reserved });
        }
        if parameters.reserved_operating != 0 {
            app.notice(now, Event::ReservedOperating { bits: parameters.reserved_operating });
        }
    }

    /// The owner has read the diagnosis as it is now.
    pub(crate) fn note_diagnosis_read<A: Application>(&mut self, master: u8, app: &A) {
        self.diagnosis_read = Some(app.diagnosis_version());
        self.diagnosis_reader = master;
    }

    fn refuse_parameters<A: Application>(
        &mut self,
        now: Instant,
        master: u8,
        not_supported: bool,
        app: &mut A,
    ) {
        self.faults = Faults { parameters: true, configuration: false, not_supported };
        self.refused = Some(master);
        if self.state != State::WaitPrm {
            self.leave(now, Loss::Parameters, app);
        }
    }

    fn set_station_delay(&mut self, bits: Option<u8>) {
        if let Some(bits) = bits {
            self.station_delay = bits.max(SHORTEST_STATION_DELAY);
        }
    }

    fn check_configuration<A: Application>(
        &mut self,
        now: Instant,
        master: u8,
        identifiers: &[u8],
        app: &mut A,
    ) -> Answer {
        if self.state == State::WaitPrm {
            // Manual §6.1: the slave does not tell the result of Set_Prm until the diagnosis that
            // follows the configuration. Masters hang where Chk_Cfg is refused before.
            let awaited = self.refused == Some(master);
            return if awaited { Answer::ShortAcknowledge } else { REFUSED };
        }
        if self.is_strange(now, master, app) {
            return REFUSED;
        }
        if self.state == State::DataExchange && is_configuration(identifiers, app) {
            return Answer::ShortAcknowledge;
        }
        match app.configure(now, identifiers) {
            Ok(lengths) if ProcessData::<N>::fits(lengths) => {
                self.data.begin(lengths);
                self.state = State::DataExchange;
                app.data_exchange_begins(now);
                app.notice(now, Event::DataExchange { master });
            }
            _ => {
                self.faults.configuration = true;
                self.leave(now, Loss::Configuration, app);
            }
        }
        Answer::ShortAcknowledge
    }

    /// Global_Control: `octets` are the commands and the groups they are for; with no group they
    /// are for all.
    #[inline(never)]
    pub(crate) fn global_control<A: Application>(
        &mut self,
        now: Instant,
        master: u8,
        octets: &[u8],
        app: &mut A,
    ) {
        let &[commands, groups] = octets else { return };
        let called = groups == 0 || groups & self.groups != 0;
        if self.state == State::DataExchange && self.master == Some(master) && called {
            self.data.control(now, commands, self.may, app);
        }
    }

    /// Whether the slave belongs to a master that is not this one; it is noticed.
    fn is_strange<A: Application>(&self, now: Instant, master: u8, app: &mut A) -> bool {
        let strange = self.master.is_some_and(|owner| owner != master);
        if strange {
            app.notice(now, Event::Stranger { master });
        }
        strange
    }

    /// The watchdog, where it has expired. Says whether it has.
    #[inline]
    pub(crate) fn advance<A: Application>(&mut self, now: Instant, app: &mut A) -> bool {
        let expired = self.watchdog.has_expired(now);
        if expired {
            self.leave(now, Loss::Watchdog, app);
        }
        expired
    }

    /// Back to WAIT_PRM: nobody's slave, outputs 0.
    #[inline(never)]
    fn leave<A: Application>(&mut self, now: Instant, loss: Loss, app: &mut A) {
        self.state = State::WaitPrm;
        self.master = None;
        self.watchdog = Watchdog::OFF;
        self.data.reset();
        app.notice(now, Event::Lost(loss));
    }
}

/// Whether these identifiers are in force.
fn is_configuration<A: Application>(identifiers: &[u8], app: &A) -> bool {
    let mut buffer = [0; TRANSMISSION_OCTETS];
    let mut out = Writer::new(&mut buffer);
    app.configuration(&mut out);
    out.written() == identifiers
}

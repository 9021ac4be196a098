//! What the master knows of a slave, and tells.

use std::fmt;

use codewheel_station::{Duration, Instant};
use profirust::dp::{Peripheral, PeripheralHandle, PeripheralOptions};

use super::SlaveSettings;
use super::settings::{DATA_OCTETS, USER_PARAMETER_OCTETS};

/// Stands for the octets that profirust would have to borrow for ever: it sends as many of these,
/// and the master puts the real ones in their place on the way out.
static PLACEHOLDER: [u8; DATA_OCTETS] = [0; DATA_OCTETS];

const _: () = assert!(USER_PARAMETER_OCTETS <= DATA_OCTETS);

/// What a master asks of a slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Service {
    /// Slave_Diag, DSAP 60.
    Diagnosis,
    /// Set_Prm, DSAP 61.
    SetParameters,
    /// Chk_Cfg, DSAP 62.
    CheckConfiguration,
    /// Data_Exchange, without a SAP.
    DataExchange,
}

impl Service {
    /// By its DSAP.
    pub(super) const fn of(dsap: Option<u8>) -> Option<Self> {
        match dsap {
            Some(60) => Some(Self::Diagnosis),
            Some(61) => Some(Self::SetParameters),
            Some(62) => Some(Self::CheckConfiguration),
            None => Some(Self::DataExchange),
            Some(_) => None,
        }
    }
}

impl fmt::Display for Service {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Diagnosis => "Slave_Diag",
            Self::SetParameters => "Set_Prm",
            Self::CheckConfiguration => "Chk_Cfg",
            Self::DataExchange => "Data_Exchange",
        })
    }
}

/// Where a slave stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlaveState {
    /// It does not answer.
    Absent,
    /// It answers and is being brought up.
    Configuring,
    /// It reports a fault in its parameters, and is tried again.
    ParameterError,
    /// It reports a fault in its configuration, and is tried again.
    ConfigurationError,
    /// It exchanges data.
    DataExchange,
}

/// What a slave answered to Slave_Diag last.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnosis {
    /// Octets 1 to 3, the station status.
    pub status: [u8; 3],
    /// Octet 4, the master that owns the slave; `None` for FFh, nobody.
    pub master: Option<u8>,
    /// Octets 5 and 6.
    pub ident_number: u16,
    /// Octets 7 and following as they came, whatever bit Ext_Diag says.
    pub extended: Vec<u8>,
}

impl Diagnosis {
    /// Reads the user data of an answer; `None` for fewer than six octets.
    pub(super) fn read(octets: &[u8]) -> Option<Self> {
        let [status @ .., master, high, low] = octets.get(..6)? else { return None };
        Some(Self {
            status: status.try_into().ok()?,
            master: (*master != 0xFF).then_some(*master),
            ident_number: u16::from_be_bytes([*high, *low]),
            extended: octets.get(6..)?.to_vec(),
        })
    }
}

/// What is known of a slave now.
#[derive(Clone, Copy, Debug)]
pub struct SlaveView<'a> {
    /// Its address.
    pub address: u8,
    /// Where it stands.
    pub state: SlaveState,
    /// Its latest inputs, as long as its settings say; zeros before the first.
    pub inputs: &'a [u8],
    /// When they arrived.
    pub input_at: Option<Instant>,
    /// The outputs that it gets.
    pub outputs: &'a [u8],
    /// The user parameters that it gets, from its next Set_Prm on.
    pub user_parameters: &'a [u8],
    /// Whether it has yet to be made ready anew with them.
    pub parameters_waiting: bool,
    /// Its latest diagnosis.
    pub diagnosis: Option<&'a Diagnosis>,
    /// Data exchanges completed.
    pub answers: u64,
    /// Requests that were repeated because no answer came.
    pub repetitions: u64,
    /// How often it was lost after it had answered.
    pub losses: u32,
}

/// The times of the bus cycle: from the end of one round through all slaves to the end of the next,
/// so token, GAP and Global_Control are in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CycleTimes {
    /// Cycles measured.
    pub count: u64,
    /// The last one.
    pub last: Duration,
    /// The shortest one.
    pub shortest: Duration,
    /// The longest one.
    pub longest: Duration,
    /// All of them together.
    pub total: Duration,
}

impl CycleTimes {
    /// The mean of all cycles; zero before the first.
    #[must_use]
    pub const fn mean(&self) -> Duration {
        match self.total.as_nanos().checked_div(self.count) {
            Some(nanos) => Duration::from_nanos(nanos),
            None => Duration::ZERO,
        }
    }

    pub(super) fn note(&mut self, cycle: Duration) {
        self.shortest = if self.count == 0 { cycle } else { self.shortest.min(cycle) };
        self.longest = self.longest.max(cycle);
        self.last = cycle;
        self.total = self.total + cycle;
        self.count += 1;
    }
}

/// How long a slave may take to get ready once its configuration was confirmed, and how often it may
/// say that it is not: on a slow bus with many slaves a round lasts longer. Where a disturbance was
/// taken for the confirmation, it never gets ready.
const READY_TIME: Duration = Duration::from_secs(2);
const READY_DIAGNOSES: u32 = 3;

/// A slave on its way from Chk_Cfg to data exchange.
#[derive(Clone, Copy, Debug)]
pub(super) struct Validating {
    since: Instant,
    diagnoses: u32,
}

impl Validating {
    pub(super) const fn begin(now: Instant) -> Self {
        Self { since: now, diagnoses: 0 }
    }

    /// It has told where it stands.
    pub(super) const fn note_diagnosis(&mut self) {
        self.diagnoses = self.diagnoses.saturating_add(1);
    }

    /// Whether it had its time and is not ready.
    pub(super) fn is_hopeless(&self, now: Instant) -> bool {
        now.since(self.since) >= READY_TIME && self.diagnoses >= READY_DIAGNOSES
    }
}

/// A slave as the master keeps it.
#[derive(Debug)]
pub(super) struct Slave {
    pub(super) settings: SlaveSettings,
    /// Its place in profirust.
    pub(super) handle: PeripheralHandle,
    pub(super) state: SlaveState,
    pub(super) inputs: Vec<u8>,
    pub(super) input_at: Option<Instant>,
    pub(super) outputs: Vec<u8>,
    pub(super) diagnosis: Option<Diagnosis>,
    pub(super) answers: u64,
    pub(super) repetitions: u64,
    pub(super) losses: u32,
    /// Requests sent since its last answer. Until it answers, what it is sent must not change: the
    /// frame count bit would take it for the same.
    pub(super) unanswered: u32,
    /// Its last answer was RS.
    pub(super) refused: bool,
    /// A refusal, or inputs of a wrong length, were told; told once in a bring-up.
    pub(super) told: bool,
    /// It is to get ready for data exchange.
    pub(super) validating: Option<Validating>,
    /// Outputs or a wish for the diagnosis wait for the next request.
    pub(super) outputs_waiting: bool,
    pub(super) diagnosis_waiting: bool,
    /// Other settings wait for the next request.
    pub(super) renewal: Option<SlaveSettings>,
}

impl Slave {
    pub(super) fn new(settings: SlaveSettings, handle: PeripheralHandle) -> Self {
        Self {
            handle,
            state: SlaveState::Absent,
            inputs: vec![0; settings.inputs],
            input_at: None,
            outputs: vec![0; settings.outputs],
            diagnosis: None,
            answers: 0,
            repetitions: 0,
            losses: 0,
            unanswered: 0,
            refused: false,
            told: false,
            validating: None,
            outputs_waiting: false,
            diagnosis_waiting: false,
            renewal: None,
            settings,
        }
    }

    /// Is begun anew with other settings; what was counted stays, and so do outputs that still fit.
    pub(super) fn renew(&mut self, settings: SlaveSettings) {
        if self.state != SlaveState::Absent {
            self.state = SlaveState::Configuring;
        }
        let outputs = std::mem::take(&mut self.outputs);
        *self = Self {
            state: self.state,
            answers: self.answers,
            repetitions: self.repetitions,
            losses: self.losses,
            diagnosis: self.diagnosis.take(),
            ..Self::new(settings, self.handle)
        };
        if outputs.len() == self.outputs.len() {
            self.outputs = outputs;
            self.outputs_waiting = true;
        }
    }

    /// The peripheral that stands for it in profirust.
    pub(super) fn peripheral(settings: &SlaveSettings) -> Peripheral<'static> {
        let options = PeripheralOptions {
            ident_number: settings.ident_number,
            sync_mode: settings.sync,
            freeze_mode: settings.freeze,
            groups: settings.groups,
            user_parameters: PLACEHOLDER.get(..settings.user_parameters.len()),
            config: PLACEHOLDER.get(..settings.configuration.len()),
            ..PeripheralOptions::default()
        };
        Peripheral::new(
            settings.address,
            options,
            vec![0; settings.inputs],
            vec![0; settings.outputs],
        )
    }

    /// What stands in the place of the placeholder in a request for `service`.
    pub(super) fn octets_of(&self, service: Service) -> &[u8] {
        match service {
            Service::SetParameters => &self.settings.user_parameters,
            Service::CheckConfiguration => &self.settings.configuration,
            Service::Diagnosis | Service::DataExchange => &[],
        }
    }

    pub(super) fn view(&self) -> SlaveView<'_> {
        SlaveView {
            address: self.settings.address,
            state: self.state,
            inputs: &self.inputs,
            input_at: self.input_at,
            outputs: &self.outputs,
            user_parameters: &self.renewal.as_ref().unwrap_or(&self.settings).user_parameters,
            parameters_waiting: self.renewal.is_some(),
            diagnosis: self.diagnosis.as_ref(),
            answers: self.answers,
            repetitions: self.repetitions,
            losses: self.losses,
        }
    }
}

//! The DP master of a plan: it serves its slaves and gives them their presets.

use std::collections::VecDeque;

use codewheel_commission::profibus::{
    self, Diagnosis, Event, Master, SettingsError, SlaveView, Timeless,
};
use codewheel_encoder::Model;
use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Instant, Station};

use super::presets::Presetting;
use super::{DpMasterPlan, Profibus};
use crate::field_bus::{Begun, Change, Seen, Talker, Told};
use crate::repeats::Repeats;
use crate::snapshot::{self, CycleTimes, SlaveState};
use crate::{Cause, Refusal};

/// What waits to be fetched of what the master tells; beyond it the oldest gives way.
const TOLD: usize = 256;

/// A DP master with its agenda of presets.
#[derive(Debug)]
pub struct DpMaster {
    pub(super) master: Timeless<Master>,
    pub(super) planned: Vec<Planned>,
    pub(super) agenda: Vec<Presetting>,
    /// The number of the next preset that somebody asks for.
    pub(super) next_preset: u64,
    repeats: Repeats<Event>,
    told: VecDeque<Told>,
}

/// What the plan says of a slave.
#[derive(Debug)]
pub(super) struct Planned {
    pub(super) address: u8,
    /// The octets of its outputs.
    pub(super) outputs: u8,
    /// The user octets of its Set_Prm.
    pub(super) user_parameters: Vec<u8>,
}

impl DpMaster {
    /// The master of `plan`.
    ///
    /// # Errors
    /// [`SettingsError`] for settings that no master can have.
    pub(super) fn new(plan: &DpMasterPlan) -> Result<Self, SettingsError> {
        let slaves: Vec<_> = plan.slaves.iter().map(super::DpSlavePlan::settings).collect();
        let planned = plan.slaves.iter().zip(&slaves).map(|(slave, settings)| Planned {
            address: slave.address,
            outputs: slave.configuration.outputs,
            user_parameters: settings.user_parameters.clone(),
        });
        let planned = planned.collect();
        let presets = plan.slaves.iter().filter(|slave| !slave.presets.is_empty());
        let agenda = presets.map(|slave| {
            Presetting::new(slave.address, slave.configuration.outputs, &slave.presets)
        });
        Ok(Self {
            planned,
            agenda: agenda.collect(),
            next_preset: 0,
            master: Timeless::new(Master::new(plan.settings.clone(), slaves)?),
            repeats: Repeats::new(),
            told: VecDeque::new(),
        })
    }

    /// The user octets of Set_Prm that the slave at `address` gets.
    pub(super) fn user_parameters(&self, address: u8) -> Option<&[u8]> {
        Some(self.master.station().slave(address)?.user_parameters)
    }

    /// Hears what the master has to tell, and moves the presets on.
    fn tend(&mut self, now: Instant) {
        let master = self.master.station_mut();
        while let Some(event) = master.take_event() {
            let text = match self.repeats.tell(now, event) {
                None => continue,
                Some(1) => event.to_string(),
                Some(count) => format!("{event} ({count} times)"),
            };
            if self.told.len() == TOLD {
                self.told.pop_front();
            }
            self.told.push_back(Told { at: now, text, trouble: event.is_trouble() });
        }
        for presetting in &mut self.agenda {
            presetting.tend(now, master);
        }
        self.agenda.retain(|presetting| !presetting.is_done());
    }
}

impl Station for DpMaster {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        self.master.handle(now, input);
    }

    fn advance(&mut self, now: Instant) {
        self.master.advance(now);
    }

    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        self.tend(now);
        self.master.transmit(now)
    }

    fn deadline(&self) -> Option<Instant> {
        // A master that serves slaves is never silent for long, so presets are given in passing.
        self.master.deadline()
    }
}

impl Node for DpMaster {
    fn baud_rate(&self) -> BaudRate {
        self.master.baud_rate()
    }
}

impl Talker<Profibus> for DpMaster {
    fn slave(&self, address: u8) -> Option<Seen> {
        let slave = self.master.station().slave(address)?;
        Some(Seen {
            state: match slave.state {
                profibus::SlaveState::Absent => SlaveState::Absent,
                profibus::SlaveState::Configuring => SlaveState::Configuring,
                profibus::SlaveState::ParameterError | profibus::SlaveState::ConfigurationError => {
                    SlaveState::Refused
                }
                profibus::SlaveState::DataExchange => SlaveState::Running,
            },
            position: position(&slave),
            answers: slave.answers,
            diagnosis: slave.diagnosis.and_then(diagnosis),
        })
    }

    fn is_on_line(&self) -> bool {
        self.master.station().is_in_ring()
    }

    fn cycle_times(&self) -> CycleTimes {
        let profibus::CycleTimes { count, last, longest, .. } = self.master.station().cycle_times();
        CycleTimes { count, last, longest }
    }

    fn take_event(&mut self) -> Option<Told> {
        self.told.pop_front()
    }

    fn change(
        &mut self,
        now: Instant,
        address: u8,
        model: Model,
        change: Change<'_>,
    ) -> Option<Result<Begun, Refusal>> {
        let place = self.planned.iter().position(|planned| planned.address == address)?;
        Some(self.change_slave(now, place, model, change))
    }

    fn ended(&self, address: u8, begun: &Begun) -> Option<Result<(), Refusal>> {
        let slave = self.master.station().slave(address)?;
        match begun {
            Begun::Presetting(id, _) => {
                let waits = self.agenda.iter().any(|presetting| presetting.waits(*id));
                (!waits).then_some(Ok(()))
            }
            Begun::Parameterizing(_) if slave.parameters_waiting => None,
            Begun::Parameterizing(_) => match slave.state {
                profibus::SlaveState::DataExchange => Some(Ok(())),
                profibus::SlaveState::ParameterError | profibus::SlaveState::ConfigurationError => {
                    let text = "the device refuses what its master sends now: look at its reports";
                    Some(Err(Refusal::new(Cause::Failed, text)))
                }
                profibus::SlaveState::Absent | profibus::SlaveState::Configuring => None,
            },
            Begun::Done(_) | Begun::Saving(_) => Some(Ok(())),
        }
    }

    fn give_up(&mut self, _: u8, begun: &Begun) {
        if let Begun::Presetting(id, _) = begun {
            self.agenda.iter_mut().for_each(|presetting| presetting.forget(*id));
        }
    }
}

/// The position in the inputs, two or four octets, the high one first.
fn position(slave: &SlaveView<'_>) -> Option<u32> {
    slave.input_at?;
    match slave.inputs {
        [high, low] => Some(u16::from_be_bytes([*high, *low]).into()),
        octets => Some(u32::from_be_bytes(octets.try_into().ok()?)),
    }
}

/// The encoder's part of a diagnosis (PROFIBUS manual §7.2), of which class 1 has the first octets.
fn diagnosis(diagnosis: &Diagnosis) -> Option<snapshot::Diagnosis> {
    /// The number that the manual gives to the first octet behind those of the standard.
    const FIRST: usize = 7;
    let octet = |number: usize| diagnosis.extended.get(number - FIRST).copied();
    let offset = diagnosis.extended.get(32 - FIRST..=35 - FIRST);
    Some(snapshot::Diagnosis {
        alarm: octet(8)? & 1 != 0,
        warning: octet(21).is_some_and(|low| low & 0x20 != 0),
        offset: offset.and_then(|octets| octets.try_into().ok()).map(i32::from_be_bytes),
    })
}

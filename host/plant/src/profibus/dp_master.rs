//! The DP master of a plan: it serves its slaves and gives them their presets.

use std::collections::VecDeque;

use codewheel_commission::profibus::{
    self, Diagnosis, Event, Master, SettingsError, SlaveView, Timeless,
};
use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Instant, Station};

use super::{DpMasterPlan, PresetPlan, Profibus};
use crate::field_bus::{Seen, Talker, Told};
use crate::repeats::Repeats;
use crate::snapshot::{self, CycleTimes, SlaveState};

/// Data exchanges in which outputs are surely seen once: the first of them may have been under way
/// already.
const SEEN: u64 = 2;

/// What waits to be fetched of what the master tells; beyond it the oldest gives way.
const TOLD: usize = 256;

/// A DP master with its agenda of presets.
#[derive(Debug)]
pub struct DpMaster {
    master: Timeless<Master>,
    agenda: Vec<Presetting>,
    repeats: Repeats<Event>,
    told: VecDeque<Told>,
}

/// The presets of one slave.
#[derive(Debug)]
struct Presetting {
    address: u8,
    /// The octets of its outputs.
    outputs: u8,
    waiting: VecDeque<PresetPlan>,
    clock: ClockBit,
}

/// Where the top bit of the outputs stands (PROFIBUS manual §7.4), and since which answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ClockBit {
    /// The slave exchanges no data, or did not a moment ago.
    Unknown,
    Low {
        since: u64,
    },
    High {
        since: u64,
    },
}

impl DpMaster {
    /// The master of `plan`.
    ///
    /// # Errors
    /// [`SettingsError`] for settings that no master can have.
    pub(super) fn new(plan: &DpMasterPlan) -> Result<Self, SettingsError> {
        let slaves = plan.slaves.iter().map(super::DpSlavePlan::settings).collect();
        let master = Master::new(plan.settings.clone(), slaves)?;
        let presets = plan.slaves.iter().filter(|slave| !slave.presets.is_empty());
        let agenda = presets.map(|slave| Presetting {
            address: slave.address,
            outputs: slave.configuration.outputs,
            waiting: slave.presets.iter().copied().collect(),
            clock: ClockBit::Unknown,
        });
        Ok(Self {
            agenda: agenda.collect(),
            master: Timeless::new(master),
            repeats: Repeats::new(),
            told: VecDeque::new(),
        })
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

impl Presetting {
    fn is_done(&self) -> bool {
        self.waiting.is_empty() && matches!(self.clock, ClockBit::Low { .. })
    }

    fn tend(&mut self, now: Instant, master: &mut Master) {
        let Some(slave) = master.slave(self.address) else { return };
        let answers = slave.answers;
        if slave.state != profibus::SlaveState::DataExchange {
            if self.clock != ClockBit::Unknown {
                // A preset whose fate is unknown stands at the head still, and is given again.
                self.clock = ClockBit::Unknown;
                self.put(master, 0, false);
            }
            return;
        }
        match self.clock {
            // The slave must see the bit low first (decision: it counts as high at the entry).
            ClockBit::Unknown => self.clock = ClockBit::Low { since: answers },
            ClockBit::Low { since } if answers >= since + SEEN => {
                if let Some(preset) = self.waiting.front().filter(|preset| preset.at <= now) {
                    let value = preset.value;
                    self.put(master, value, true);
                    self.clock = ClockBit::High { since: answers };
                }
            }
            ClockBit::High { since } if answers >= since + SEEN => {
                let value = self.waiting.pop_front().map_or(0, |preset| preset.value);
                self.put(master, value, false);
                self.clock = ClockBit::Low { since: answers };
            }
            ClockBit::Low { .. } | ClockBit::High { .. } => {}
        }
    }

    /// Gives the slave a preset, its top bit set or not.
    fn put(&self, master: &mut Master, value: u32, clock: bool) {
        let wide = value | u32::from(clock) << 31;
        let narrow = value as u16 | u16::from(clock) << 15;
        // A plan gives presets only to configurations that carry them.
        let _ = match self.outputs {
            4 => master.set_outputs(self.address, &wide.to_be_bytes()),
            2 => master.set_outputs(self.address, &narrow.to_be_bytes()),
            _ => Ok(()),
        };
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

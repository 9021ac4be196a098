//! The master: its slaves, and what users ask and are told.

use std::fmt;

use codewheel_station::Instant;
use profirust::dp::{DpMaster, PeripheralEvent, PeripheralHandle};
use profirust::fdl::FdlActiveStation;
use thiserror::Error;

use super::acyclic::{Acyclic, Answered, Requests};
use super::clock::Clock;
use super::event::{Event, Events};
use super::judge::Awaited;
use super::line::Line;
use super::settings::{HIGHEST_ADDRESS, MasterSettings, SettingsError, SlaveSettings};
use super::slave::{CycleTimes, Service, Slave, SlaveState, SlaveView, Validating};
use super::telegram::Receiver;

/// What has been counted since the master was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Telegrams sent, tokens and searches for other masters included.
    pub sent: u64,
    /// Error-free telegrams received, of any station.
    pub received: u64,
    /// Telegrams and characters that were broken or never finished.
    pub broken: u64,
    /// Answers that nobody asked for, or that do not fit what was asked.
    pub unexpected: u64,
    /// Events that gave way to later ones before they were fetched.
    pub events_lost: u64,
}

/// No slave has this address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the master has no slave {0}")]
pub struct UnknownSlave(pub u8);

/// Why outputs are not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum NotSet {
    /// No slave has this address.
    #[error("the master has no slave {0}")]
    UnknownSlave(u8),
    /// The slave has another number of outputs.
    #[error("slave {address} has {expected} octets of outputs, not {given}")]
    Length {
        /// The slave.
        address: u8,
        /// How many were given.
        given: usize,
        /// How many it has.
        expected: usize,
    },
}

/// Why user parameters are not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum NotParameterized {
    /// No slave has this address.
    #[error("the master has no slave {0}")]
    UnknownSlave(u8),
    /// They are too many.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}

/// A PROFIBUS-DP master with up to 125 slaves.
pub struct Master {
    pub(super) settings: MasterSettings,
    pub(super) clock: Clock,
    pub(super) fdl: FdlActiveStation,
    pub(super) dp: DpMaster<'static>,
    pub(super) line: Line,
    pub(super) receiver: Receiver,
    pub(super) slaves: Vec<Slave>,
    /// From whom an answer is due, and to what.
    pub(super) awaited: Awaited,
    /// When the last octet came of those that profirust has not been told of.
    pub(super) heard: Option<Instant>,
    /// When profirust was asked last.
    pub(super) polled: Option<Instant>,
    /// The end of the telegram that the master sent last.
    pub(super) speaks_until: Instant,
    /// From when on the line has been idle for 33 bits.
    pub(super) free_at: Instant,
    /// When to join the bus anew after a collision of addresses.
    pub(super) rejoins: Option<Instant>,
    pub(super) requests: Requests,
    /// Its slaves are served no more.
    pub(super) is_stopped: bool,
    pub(super) events: Events,
    pub(super) counters: Counters,
    cycle_ended: Option<Instant>,
    cycle_times: CycleTimes,
}

impl Master {
    /// A master that listens first, and takes the token when the bus stays silent.
    ///
    /// # Errors
    /// What is wrong with the settings. No slaves are fine: such a master passes the token.
    pub fn new(
        settings: MasterSettings,
        slaves: Vec<SlaveSettings>,
    ) -> Result<Self, SettingsError> {
        settings.check()?;
        for (place, slave) in slaves.iter().enumerate() {
            slave.check(settings.address)?;
            if slaves.iter().take(place).any(|other| other.address == slave.address) {
                return Err(SettingsError::AddressInUse(slave.address));
            }
        }
        let mut dp = DpMaster::new(Vec::new());
        let slaves = slaves
            .into_iter()
            .map(|slave| {
                let handle = dp.add(Slave::peripheral(&slave));
                Slave::new(slave, handle)
            })
            .collect();
        dp.enter_operate();
        let mut fdl = FdlActiveStation::new(settings.parameters());
        fdl.set_online();
        Ok(Self {
            clock: Clock::new(settings.baud_rate),
            receiver: Receiver::new(settings.baud_rate, settings.slot()),
            settings,
            fdl,
            dp,
            line: Line::new(),
            slaves,
            awaited: Awaited::Nothing,
            heard: None,
            polled: None,
            speaks_until: Instant::ZERO,
            free_at: Instant::ZERO,
            rejoins: None,
            requests: Requests::default(),
            is_stopped: false,
            events: Events::default(),
            counters: Counters::default(),
            cycle_ended: None,
            cycle_times: CycleTimes::default(),
        })
    }

    /// What it was told.
    #[must_use]
    pub const fn settings(&self) -> &MasterSettings {
        &self.settings
    }

    /// Whether it takes itself for a member of the token ring.
    #[must_use]
    pub fn is_in_ring(&self) -> bool {
        self.fdl.is_in_ring()
    }

    /// The slave at `address`.
    #[must_use]
    pub fn slave(&self, address: u8) -> Option<SlaveView<'_>> {
        self.slaves().find(|slave| slave.address == address)
    }

    /// All slaves, in the order in which they were given and are served.
    pub fn slaves(&self) -> impl ExactSizeIterator<Item = SlaveView<'_>> {
        self.slaves.iter().map(Slave::view)
    }

    /// Gives the slave at `address` other outputs, from its next Data_Exchange on that is no
    /// repetition.
    ///
    /// # Errors
    /// [`NotSet`]; nothing is changed.
    pub fn set_outputs(&mut self, address: u8, outputs: &[u8]) -> Result<(), NotSet> {
        let slave = self
            .slaves
            .iter_mut()
            .find(|slave| slave.settings.address == address)
            .ok_or(NotSet::UnknownSlave(address))?;
        let (given, expected) = (outputs.len(), slave.outputs.len());
        if given != expected {
            return Err(NotSet::Length { address, given, expected });
        }
        slave.outputs.copy_from_slice(outputs);
        slave.outputs_waiting = true;
        Ok(())
    }

    /// Gives the slave at `address` other user parameters, octets 8 and following of Set_Prm, and
    /// makes it ready anew with them as soon as it owes no answer. Until then
    /// [`SlaveView::parameters_waiting`] is set.
    ///
    /// # Errors
    /// [`NotParameterized`]; nothing is changed.
    pub fn set_user_parameters(
        &mut self,
        address: u8,
        user_parameters: Vec<u8>,
    ) -> Result<(), NotParameterized> {
        let slave = self
            .slaves
            .iter_mut()
            .find(|slave| slave.settings.address == address)
            .ok_or(NotParameterized::UnknownSlave(address))?;
        let wanted = slave.renewal.as_ref().unwrap_or(&slave.settings);
        let wanted = SlaveSettings { user_parameters, ..wanted.clone() };
        wanted.check(self.settings.address)?;
        slave.renewal = Some(wanted);
        Ok(())
    }

    /// Reads the diagnosis of the slave at `address` in place of its next Data_Exchange, which
    /// [`Event::Diagnosis`] reports.
    ///
    /// # Errors
    /// [`UnknownSlave`].
    pub fn request_diagnosis(&mut self, address: u8) -> Result<(), UnknownSlave> {
        let slave = self
            .slaves
            .iter_mut()
            .find(|slave| slave.settings.address == address)
            .ok_or(UnknownSlave(address))?;
        slave.diagnosis_waiting = true;
        Ok(())
    }

    /// Serves a slave besides the others; the one that is served already at this address is begun
    /// anew with these settings, once it owes no answer. [`Event::Configured`] tells that it took
    /// them, [`Event::ParameterError`] and [`Event::ConfigurationError`] that it did not.
    ///
    /// # Errors
    /// What is wrong with the settings; nothing is changed.
    pub fn serve(&mut self, slave: SlaveSettings) -> Result<(), SettingsError> {
        slave.check(self.settings.address)?;
        let known = self.slaves.iter_mut().find(|known| known.settings.address == slave.address);
        match known {
            Some(known) => known.renewal = Some(slave),
            None => {
                let handle = self.dp.add(Slave::peripheral(&slave));
                self.slaves.push(Slave::new(slave, handle));
            }
        }
        Ok(())
    }

    /// Serves its slaves no more, whose watchdogs let go. It keeps its place in the token ring and asks
    /// what it is told to [`ask`](Self::ask).
    pub const fn stop(&mut self) {
        self.is_stopped = true;
    }

    /// Asks a station once, between two cycles; [`take_answer`](Self::take_answer) tells what came of
    /// it. A request without an answer is repeated as often as the settings say.
    ///
    /// # Errors
    /// An address that no station has, or that of this master.
    pub fn ask(&mut self, address: u8, request: Acyclic) -> Result<(), SettingsError> {
        if address > HIGHEST_ADDRESS {
            return Err(SettingsError::SlaveAddress(address));
        }
        if address == self.settings.address {
            return Err(SettingsError::AddressInUse(address));
        }
        self.requests.push(address, request);
        Ok(())
    }

    /// How many requests that it was told to [`ask`](Self::ask) it sends before the next cycle through
    /// its slaves, or before it hands the token on; 1 unless it is told otherwise. Those to which nobody
    /// answers last a slot time each, and other masters wait so long.
    pub const fn ask_in_a_row(&mut self, most: u8) {
        self.requests.set_most_in_a_row(most);
    }

    /// What came of the oldest request that was [asked](Self::ask) and has not been fetched.
    pub fn take_answer(&mut self) -> Option<Answered> {
        self.requests.take()
    }

    /// Whether all is asked that it was told to ask.
    #[must_use]
    pub fn has_asked_all(&self) -> bool {
        self.requests.is_done()
    }

    /// Asks no more of what it was told to ask and has not asked yet.
    pub fn ask_no_more(&mut self) {
        self.requests.clear();
    }

    /// The oldest event that has not been fetched.
    pub fn take_event(&mut self) -> Option<Event> {
        self.events.take()
    }

    /// What has been counted.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        let mut counters = self.counters;
        counters.broken = self.receiver.errors;
        counters.events_lost = self.events.lost;
        counters
    }

    /// The times of the bus cycle.
    #[must_use]
    pub const fn cycle_times(&self) -> CycleTimes {
        self.cycle_times
    }

    /// Hands profirust what users have set, and begins anew with slaves that do not get ready,
    /// where they owe no answer.
    pub(super) fn commit(&mut self, now: Instant) {
        for slave in &mut self.slaves {
            if slave.unanswered > 0 {
                continue;
            }
            if let Some(settings) = slave.renewal.take() {
                *self.dp.get_mut(slave.handle) = Slave::peripheral(&settings);
                slave.renew(settings);
            }
            if slave.validating.take_if(|validating| validating.is_hopeless(now)).is_some() {
                self.dp.get_mut(slave.handle).reset_address(slave.settings.address);
            }
            if slave.outputs_waiting {
                slave.outputs_waiting = false;
                self.dp.get_mut(slave.handle).pi_q_mut().copy_from_slice(&slave.outputs);
            }
            if slave.diagnosis_waiting {
                slave.diagnosis_waiting = false;
                self.dp.get_mut(slave.handle).request_diagnostics();
            }
        }
    }

    /// Takes in what profirust reports after each poll.
    pub(super) fn take_reports(&mut self, now: Instant) {
        let reports = self.dp.take_last_events();
        if let Some((handle, event)) = reports.peripheral {
            self.take_report(now, handle, event);
        }
        if reports.cycle_completed
            && let Some(ended) = self.cycle_ended.replace(now)
        {
            self.cycle_times.note(now.since(ended));
        }
    }

    fn take_report(&mut self, now: Instant, handle: PeripheralHandle, event: PeripheralEvent) {
        let address = handle.address();
        let Some(slave) = self.slaves.iter_mut().find(|slave| slave.settings.address == address)
        else {
            return;
        };
        let fault = match event {
            PeripheralEvent::Online if slave.state == SlaveState::Absent => {
                slave.state = SlaveState::Configuring;
                return self.events.push(Event::Online { address });
            }
            // It is brought up anew, and where it stands is known.
            PeripheralEvent::Online => return,
            PeripheralEvent::Configured => {
                slave.state = SlaveState::Configuring;
                slave.told = false;
                slave.validating = None;
                return self.events.push(Event::Configured { address });
            }
            PeripheralEvent::DataExchanged => {
                slave.state = SlaveState::DataExchange;
                slave.answers += 1;
                slave.input_at = Some(now);
                slave.inputs.copy_from_slice(self.dp.get_mut(handle).pi_i());
                return;
            }
            PeripheralEvent::Diagnostics => return self.events.push(Event::Diagnosis { address }),
            PeripheralEvent::Offline => {
                // One that refuses is there, if of no use.
                if !slave.refused {
                    self.lose(address);
                }
                return;
            }
            PeripheralEvent::ParameterError => SlaveState::ParameterError,
            PeripheralEvent::ConfigError => SlaveState::ConfigurationError,
        };
        slave.validating = None;
        if slave.state != fault {
            slave.state = fault;
            self.events.push(match fault {
                SlaveState::ParameterError => Event::ParameterError { address },
                _ => Event::ConfigurationError { address },
            });
        }
    }

    /// The slave does not answer.
    pub(super) fn lose(&mut self, address: u8) {
        let Some(slave) = self.slaves.iter_mut().find(|slave| slave.settings.address == address)
        else {
            return;
        };
        slave.told = false;
        slave.validating = None;
        if slave.state != SlaveState::Absent {
            slave.state = SlaveState::Absent;
            slave.losses += 1;
            self.events.push(Event::Offline { address });
        }
    }

    /// The slave answers RS to `service`.
    pub(super) fn refuse(&mut self, now: Instant, place: usize, service: Service) {
        let Some(slave) = self.slaves.get_mut(place) else { return };
        let address = slave.settings.address;
        slave.unanswered = 0;
        slave.refused = true;
        if slave.state == SlaveState::DataExchange {
            slave.state = SlaveState::Configuring;
            slave.told = false;
        }
        if service == Service::DataExchange {
            slave.validating = Some(Validating::begin(now));
        }
        if !slave.told {
            slave.told = true;
            self.events.push(Event::Refused { address, service });
        }
    }
}

impl fmt::Debug for Master {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Master")
            .field("settings", &self.settings)
            .field("fdl", &self.fdl)
            .field("slaves", &self.slaves)
            .field("awaited", &self.awaited)
            .field("counters", &self.counters())
            .finish_non_exhaustive()
    }
}

//! Which telegrams profirust may see.

use codewheel_station::Instant;
use profirust::fdl::{
    DataTelegram, FunctionCode, RequestType, ResponseStatus, Telegram, TokenTelegram,
};

use super::master::Master;
use super::settings::HIGHEST_ADDRESS;
use super::slave::{Diagnosis, Service, SlaveState, Validating};

/// From whom an answer is due, and to what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Awaited {
    /// No answer is due.
    Nothing,
    /// A station was asked whether it is there and what it is (FDL status).
    Status {
        /// Its address.
        address: u8,
    },
    /// A station was asked outside of the cycle.
    Acyclic {
        /// Its address.
        address: u8,
    },
    /// A slave was asked.
    Answer {
        /// Its place.
        place: usize,
        /// For what.
        service: Service,
    },
}

/// The slave's DSAP 62 in answers is the master's SAP; 60 is the diagnosis.
const MASTER_SAP: u8 = 62;
const DIAGNOSIS_SAP: u8 = 60;

/// Whether somebody asks, or hands the token on.
const fn is_request(telegram: &Telegram<'_>) -> bool {
    match telegram {
        Telegram::Data(data) => matches!(data.h.fc, FunctionCode::Request { .. }),
        Telegram::Token(_) => true,
        Telegram::ShortConfirmation(_) => false,
    }
}

impl Master {
    /// Notes what is asked by a telegram on its way out, and gives its address and service where it
    /// is a slave that is asked.
    pub(super) fn note_request(&mut self, telegram: &[u8]) -> Option<(usize, Service)> {
        self.awaited = Awaited::Nothing;
        let Some(Ok((Telegram::Data(asked), _))) = Telegram::deserialize(telegram) else {
            return None;
        };
        let FunctionCode::Request { req, .. } = asked.h.fc else { return None };
        if let Some(address) = self.requests.asks().filter(|address| *address == asked.h.da) {
            self.awaited = Awaited::Acyclic { address };
            return None;
        }
        if req == RequestType::FdlStatus {
            self.awaited = Awaited::Status { address: asked.h.da };
        }
        if !matches!(req, RequestType::SrdLow | RequestType::SrdHigh) {
            return None;
        }
        let place = self.slaves.iter().position(|slave| slave.settings.address == asked.h.da)?;
        let service = Service::of(asked.h.dsap)?;
        self.awaited = Awaited::Answer { place, service };
        Some((place, service))
    }

    /// Whether profirust may see this telegram; notes what it tells about slaves.
    pub(super) fn judge(&mut self, now: Instant, octets: &[u8]) -> bool {
        let telegram = Telegram::deserialize(octets);
        if let (Awaited::Acyclic { address }, Some(Ok((telegram, _)))) = (self.awaited, &telegram)
            && !is_request(telegram)
        {
            let fits = self.is_from(address, telegram) && self.requests.fits(telegram);
            if fits {
                self.awaited = Awaited::Nothing;
            } else {
                self.counters.unexpected += 1;
            }
            return fits;
        }
        let fits = match telegram {
            Some(Ok((Telegram::Token(TokenTelegram { da, sa }), _))) => {
                let fits = da <= HIGHEST_ADDRESS && sa <= HIGHEST_ADDRESS;
                if fits {
                    self.awaited = Awaited::Nothing;
                }
                fits
            }
            Some(Ok((Telegram::ShortConfirmation(_), _))) => self.short_confirmation(now),
            Some(Ok((Telegram::Data(data), _))) => match data.h.fc {
                // Somebody else speaks out of turn: profirust leaves the bus to him.
                FunctionCode::Request { .. } => {
                    self.awaited = Awaited::Nothing;
                    true
                }
                FunctionCode::Response { status, .. } => self.response(now, &data, status),
            },
            Some(Err(())) | None => false,
        };
        if !fits {
            self.counters.unexpected += 1;
        }
        fits
    }

    /// Whether `telegram` is an answer from `address` to this master, or may be one: a short
    /// confirmation does not say from whom it is.
    fn is_from(&self, address: u8, telegram: &Telegram<'_>) -> bool {
        match telegram {
            Telegram::Data(data) => data.h.sa == address && data.h.da == self.settings.address,
            Telegram::ShortConfirmation(_) => true,
            Telegram::Token(_) => false,
        }
    }

    fn short_confirmation(&mut self, now: Instant) -> bool {
        let Awaited::Answer { place, service } = self.awaited else { return false };
        let fits = match service {
            Service::SetParameters | Service::CheckConfiguration => true,
            Service::DataExchange => {
                self.slaves.get(place).is_some_and(|slave| slave.settings.inputs == 0)
            }
            Service::Diagnosis => false,
        };
        if fits {
            self.answered(place);
            if let Some(slave) = self.slaves.get_mut(place)
                && service == Service::CheckConfiguration
            {
                slave.validating = Some(Validating::begin(now));
            }
        }
        fits
    }

    fn response(&mut self, now: Instant, data: &DataTelegram<'_>, status: ResponseStatus) -> bool {
        if data.h.da != self.settings.address {
            return false;
        }
        let (place, service) = match self.awaited {
            Awaited::Nothing | Awaited::Acyclic { .. } => return false,
            Awaited::Status { address } => {
                let fits = data.h.sa == address;
                if fits {
                    self.awaited = Awaited::Nothing;
                }
                return fits;
            }
            Awaited::Answer { place, service } => (place, service),
        };
        let Some(slave) = self.slaves.get_mut(place) else { return false };
        if data.h.sa != slave.settings.address {
            return false;
        }
        if status == ResponseStatus::SapNotEnabled {
            self.refuse(now, place, service);
            // In data exchange profirust begins anew; elsewhere it had better not hear of it.
            let fits = service == Service::DataExchange;
            if fits {
                self.awaited = Awaited::Nothing;
            }
            return fits;
        }
        match service {
            // These are confirmed, or refused.
            Service::SetParameters | Service::CheckConfiguration => return false,
            Service::Diagnosis => {
                if data.h.dsap != Some(MASTER_SAP) || data.h.ssap != Some(DIAGNOSIS_SAP) {
                    return false;
                }
                let Some(diagnosis) = Diagnosis::read(data.pdu) else { return false };
                slave.diagnosis = Some(diagnosis);
                if let Some(validating) = &mut slave.validating {
                    validating.note_diagnosis();
                }
            }
            Service::DataExchange => {
                let (given, expected) = (data.pdu.len(), slave.settings.inputs);
                let carries_data = matches!(
                    status,
                    ResponseStatus::Ok | ResponseStatus::DataLow | ResponseStatus::DataHigh
                );
                if carries_data && given != expected && !slave.told {
                    slave.told = true;
                    let address = slave.settings.address;
                    self.events.push(super::Event::InputLength { address, given, expected });
                }
            }
        }
        self.answered(place);
        true
    }

    fn answered(&mut self, place: usize) {
        self.awaited = Awaited::Nothing;
        if let Some(slave) = self.slaves.get_mut(place) {
            slave.unanswered = 0;
            slave.refused = false;
        }
    }

    /// The slave at `place` is asked.
    pub(super) fn asked(&mut self, place: usize) {
        let Some(slave) = self.slaves.get_mut(place) else { return };
        let lost = slave.unanswered > u32::from(self.settings.retries);
        if slave.unanswered > 0 && slave.state != SlaveState::Absent {
            slave.repetitions += 1;
        }
        slave.unanswered = slave.unanswered.saturating_add(1);
        if lost {
            let address = slave.settings.address;
            self.lose(address);
        }
    }
}

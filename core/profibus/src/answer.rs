//! What answers say: inputs and diagnosis as of the moment they are fetched.

use codewheel_station::rs485::TRANSMISSION_OCTETS;
use codewheel_station::{Instant, Writer};

use crate::function_code::{FunctionCode, Reply};
use crate::machine::Machine;
use crate::responder::{Answer, Owed};
use crate::telegram::{Head, SC};
use crate::{Application, State};

/// The address that stands in the diagnosis while no master has locked the slave.
const NO_MASTER: u8 = 0xFF;

/// Bits of octet 1 of Slave_Diag, station status 1.
mod status_1 {
    pub(super) const STATION_NOT_READY: u8 = 0x02;
    pub(super) const CFG_FAULT: u8 = 0x04;
    pub(super) const EXT_DIAG: u8 = 0x08;
    pub(super) const NOT_SUPPORTED: u8 = 0x10;
    pub(super) const PRM_FAULT: u8 = 0x40;
}

/// Bits of octet 2, station status 2.
mod status_2 {
    pub(super) const PRM_REQ: u8 = 0x01;
    pub(super) const ALWAYS: u8 = 0x04;
    pub(super) const WD_ON: u8 = 0x08;
    pub(super) const FREEZE_MODE: u8 = 0x10;
    pub(super) const SYNC_MODE: u8 = 0x20;
}

impl<const N: usize> Machine<N> {
    /// Builds the answer of `station` that is owed and says how many octets it has.
    #[inline]
    pub(crate) fn build<A: Application>(
        &mut self,
        now: Instant,
        station: u8,
        owed: Owed,
        buffer: &mut [u8; TRANSMISSION_OCTETS],
        app: &mut A,
    ) -> Option<u8> {
        if owed.answer != Answer::DataExchange {
            return self.build_other(now, station, owed, buffer, app);
        }
        let head = |reply| bare(station, owed.master, reply);
        let octets = self.data.inputs(now, head(Reply::DataLow).room(buffer), app);
        // Asked after the inputs: to look at them may show a fault.
        let pending = self.is_diagnosis_pending(app);
        if octets == 0 && !pending {
            return acknowledge(buffer);
        }
        head(if pending { Reply::DataHigh } else { Reply::DataLow }).close(buffer, octets)
    }

    /// Anything but Data_Exchange, which is not to save registers for it.
    #[inline(never)]
    fn build_other<A: Application>(
        &mut self,
        now: Instant,
        station: u8,
        owed: Owed,
        buffer: &mut [u8; TRANSMISSION_OCTETS],
        app: &mut A,
    ) -> Option<u8> {
        let Owed { answer, master, saps } = owed;
        let data = Head { saps, ..bare(station, master, Reply::DataLow) };
        let octets = match answer {
            Answer::ShortAcknowledge => return acknowledge(buffer),
            Answer::Bare(reply) => return bare(station, master, reply).close(buffer, 0),
            Answer::Diagnosis => {
                let octets = self.diagnosis(now, data.room(buffer), app)?;
                if self.master == Some(master) {
                    self.note_diagnosis_read(master, app);
                }
                octets
            }
            Answer::Configuration => {
                let mut out = Writer::new(data.room(buffer));
                app.configuration(&mut out);
                out.len()
            }
            Answer::DataExchange | Answer::Inputs => self.data.inputs(now, data.room(buffer), app),
            Answer::Outputs => {
                let outputs = self.data.outputs();
                data.room(buffer).get_mut(..outputs.len())?.copy_from_slice(outputs);
                outputs.len()
            }
        };
        data.close(buffer, octets)
    }

    /// Whether the owner must read the diagnosis.
    #[inline]
    fn is_diagnosis_pending<A: Application>(&self, app: &A) -> bool {
        self.diagnosis_read != Some(app.diagnosis_version())
    }

    /// Writes the octets of Slave_Diag and says how many they are.
    fn diagnosis<A: Application>(
        &self,
        now: Instant,
        room: &mut [u8],
        app: &mut A,
    ) -> Option<usize> {
        let (standard, extended) = room.split_first_chunk_mut::<6>()?;
        let mut out = Writer::new(extended);
        app.diagnosis(now, &mut out);
        let octets = standard.len() + out.len();
        let [high, low] = self.ident_number.to_be_bytes();
        *standard = [
            self.station_status_1(app.has_diagnosis()),
            self.station_status_2(),
            0,
            self.master.unwrap_or(NO_MASTER),
            high,
            low,
        ];
        Some(octets)
    }

    fn station_status_1(&self, extended: bool) -> u8 {
        bit(self.state != State::DataExchange, status_1::STATION_NOT_READY)
            | bit(self.faults.configuration, status_1::CFG_FAULT)
            | bit(extended, status_1::EXT_DIAG)
            | bit(self.faults.not_supported, status_1::NOT_SUPPORTED)
            | bit(self.faults.parameters, status_1::PRM_FAULT)
    }

    /// Stat_Diag is never set (decision): with it a master does nothing but read the diagnosis,
    /// and could not send the value that ends the fault.
    fn station_status_2(&self) -> u8 {
        status_2::ALWAYS
            | bit(self.state == State::WaitPrm, status_2::PRM_REQ)
            | bit(self.watchdog.is_on(), status_2::WD_ON)
            | bit(self.data.freeze, status_2::FREEZE_MODE)
            | bit(self.data.sync, status_2::SYNC_MODE)
    }
}

const fn bit(set: bool, bit: u8) -> u8 {
    if set { bit } else { 0 }
}

/// An answer without service access points.
const fn bare(station: u8, master: u8, reply: Reply) -> Head {
    let function_code = FunctionCode::reply(reply);
    Head { destination: master, source: station, function_code, saps: None }
}

fn acknowledge(buffer: &mut [u8; TRANSMISSION_OCTETS]) -> Option<u8> {
    *buffer.first_mut()? = SC;
    Some(1)
}

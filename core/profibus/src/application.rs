//! What a device brings to the stack: its parameters, its process data, its diagnosis.

use codewheel_station::{Instant, Writer};

use crate::Event;

/// The application refuses what the master asks for. It has said why, in its own events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refused;

/// How many octets of process data a configuration carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lengths {
    /// From the slave to the master.
    pub inputs: u8,
    /// From the master to the slave.
    pub outputs: u8,
}

/// A DP slave's device, lent to [`Slave`](crate::Slave) for one call.
pub trait Application {
    /// Judges and takes the user parameters: the octets of Set_Prm from 8 on, as many as there are,
    /// none in the shortest form. Station status, watchdog, ident number and octet 8 itself have
    /// been found good. All of them are taken or, with an error, none.
    ///
    /// Called for every Set_Prm that passes so far, identical ones too.
    ///
    /// # Errors
    /// [`Refused`]: Prm_Fault.
    fn parameterize(&mut self, now: Instant, user: &[u8]) -> Result<(), Refused>;

    /// A Set_Prm was found bad before [`parameterize`](Self::parameterize) was asked: too short, a
    /// watchdog factor of 0, wrong ident number, octet 8. The slave is in WAIT_PRM after it, and may
    /// have been there before.
    fn parameters_refused(&mut self, now: Instant);

    /// Judges the identifiers of Chk_Cfg and takes them where they are good.
    ///
    /// # Errors
    /// [`Refused`]: Cfg_Fault.
    fn configure(&mut self, now: Instant, identifiers: &[u8]) -> Result<Lengths, Refused>;

    /// Writes the identifiers for Get_Cfg: those accepted last, before that the default ones.
    fn configuration(&self, out: &mut Writer<'_>);

    /// Data exchange begins: the slave has come from WAIT_CFG to DATA_EXCH, or another
    /// configuration was taken in DATA_EXCH. Outputs are 0, Sync and Freeze are off.
    fn data_exchange_begins(&mut self, now: Instant);

    /// Writes today's inputs into all of `octets`, which are as many as [`configure`](Self::configure) said.
    fn inputs(&mut self, now: Instant, octets: &mut [u8]);

    /// Outputs are transferred to the device: with each Data_Exchange, or in Sync mode with each
    /// Sync and Unsync.
    fn outputs(&mut self, now: Instant, octets: &[u8]);

    /// Clear: the master has set all outputs to 0, by Global_Control or with an empty
    /// Data_Exchange. Outputs that a watchdog or a new parameterization sets to 0 are not told.
    fn clear(&mut self, now: Instant);

    /// Writes the diagnosis behind the six octets of the standard, header octet and all; what it
    /// writes depends on whether parameters are in force, as
    /// [`parameterize`](Self::parameterize) and
    /// [`parameters_refused`](Self::parameters_refused) left it.
    fn diagnosis(&mut self, now: Instant, out: &mut Writer<'_>);

    /// Whether the diagnosis shows a fault or a warning now: bit Ext_Diag.
    fn has_diagnosis(&self) -> bool;

    /// A number that changes whenever the diagnosis changes so that the master must read it.
    fn diagnosis_version(&self) -> u16;

    /// Something happened in the stack.
    fn notice(&mut self, now: Instant, event: Event);
}

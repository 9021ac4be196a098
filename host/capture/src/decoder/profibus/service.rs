//! The services of DP, by the service access point of the slave.

use codewheel_profibus::sap;

use super::super::line::Line;

/// A service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Service {
    /// No service access points.
    DataExchange,
    SetSlaveAddress,
    ReadInputs,
    ReadOutputs,
    GlobalControl,
    GetConfiguration,
    SlaveDiagnosis,
    SetParameters,
    CheckConfiguration,
    /// Any other DSAP.
    Other(u8),
}

impl Service {
    pub(super) const fn of(destination_sap: u8) -> Self {
        match destination_sap {
            sap::SET_SLAVE_ADDRESS => Self::SetSlaveAddress,
            sap::READ_INPUTS => Self::ReadInputs,
            sap::READ_OUTPUTS => Self::ReadOutputs,
            sap::GLOBAL_CONTROL => Self::GlobalControl,
            sap::GET_CONFIGURATION => Self::GetConfiguration,
            sap::SLAVE_DIAGNOSIS => Self::SlaveDiagnosis,
            sap::SET_PARAMETERS => Self::SetParameters,
            sap::CHECK_CONFIGURATION => Self::CheckConfiguration,
            other => Self::Other(other),
        }
    }

    /// Its service access point.
    pub(super) const fn sap(self) -> Option<u8> {
        Some(match self {
            Self::DataExchange => return None,
            Self::SetSlaveAddress => sap::SET_SLAVE_ADDRESS,
            Self::ReadInputs => sap::READ_INPUTS,
            Self::ReadOutputs => sap::READ_OUTPUTS,
            Self::GlobalControl => sap::GLOBAL_CONTROL,
            Self::GetConfiguration => sap::GET_CONFIGURATION,
            Self::SlaveDiagnosis => sap::SLAVE_DIAGNOSIS,
            Self::SetParameters => sap::SET_PARAMETERS,
            Self::CheckConfiguration => sap::CHECK_CONFIGURATION,
            Self::Other(sap) => sap,
        })
    }

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::DataExchange => "Data_Exchange",
            Self::SetSlaveAddress => "Set_Slave_Add",
            Self::ReadInputs => "RD_Inp",
            Self::ReadOutputs => "RD_Outp",
            Self::GlobalControl => "Global_Control",
            Self::GetConfiguration => "Get_Cfg",
            Self::SlaveDiagnosis => "Slave_Diag",
            Self::SetParameters => "Set_Prm",
            Self::CheckConfiguration => "Chk_Cfg",
            Self::Other(_) => "SAP",
        }
    }

    /// Its name, or the number of its service access point.
    pub(super) fn tell(self, line: &mut Line<'_>) {
        line.attribute("service", &[self.name()]);
        if let Self::Other(sap) = self {
            line.number("sap", "", sap.into(), "");
        }
    }
}

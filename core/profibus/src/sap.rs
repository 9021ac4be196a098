//! The service access points of a DP-V0 slave, and the master's.

/// Set_Slave_Add.
pub const SET_SLAVE_ADDRESS: u8 = 55;
/// RD_Inp.
pub const READ_INPUTS: u8 = 56;
/// RD_Outp.
pub const READ_OUTPUTS: u8 = 57;
/// Global_Control.
pub const GLOBAL_CONTROL: u8 = 58;
/// Get_Cfg.
pub const GET_CONFIGURATION: u8 = 59;
/// Slave_Diag.
pub const SLAVE_DIAGNOSIS: u8 = 60;
/// Set_Prm.
pub const SET_PARAMETERS: u8 = 61;
/// Chk_Cfg.
pub const CHECK_CONFIGURATION: u8 = 62;
/// The master's own, SSAP of its requests.
pub const MASTER: u8 = 62;

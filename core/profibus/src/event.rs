//! What the stack tells its device, in place of a log.

use core::fmt;

use codewheel_station::rs485::BaudRate;

/// What is wrong with the octets of Set_Prm that the standard defines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterFault {
    /// Fewer than the seven octets of the standard.
    Short {
        /// How many there were.
        octets: u8,
    },
    /// WD_On, and a watchdog factor (octet 2 or 3) is 0.
    WatchdogFactor {
        /// Octets 2 and 3.
        factors: [u8; 2],
    },
    /// Octets 5 and 6 name another device type.
    IdentNumber {
        /// What the master expects.
        given: u16,
        /// What the slave is.
        own: u16,
    },
    /// Octet 8 asks for what a DP-V0 slave has not: DP-V1, fail-safe, publisher.
    NotSupported {
        /// Octet 8.
        octet: u8,
    },
}

/// Why data exchange, or the way to it, ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// The master was silent for longer than the watchdog time.
    Watchdog,
    /// The master let go of the slave (Set_Prm with Unlock).
    Unlocked,
    /// The master sent parameters that were refused.
    Parameters,
    /// The master sent a configuration that was refused.
    Configuration,
    /// The master sent as many outputs as the configuration does not have.
    OutputLength {
        /// How many octets came.
        given: u8,
        /// How many the configuration has.
        expected: u8,
    },
}

/// Something that happened to the slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The rate of the line was found.
    BaudRateFound(BaudRate),
    /// The line was silent, or unintelligible, for so long that its rate is searched anew.
    BaudRateLost,
    /// A master parameterized the slave: WAIT_CFG.
    Parameterized {
        /// Its address.
        master: u8,
    },
    /// Parameters were refused for what the standard says about them.
    ParametersRefused(ParameterFault),
    /// Parameters were taken though bits of station status are set that mean nothing.
    ReservedStationStatus {
        /// These bits, of 0 to 2.
        bits: u8,
    },
    /// Parameters were taken though bits of octet 8 are set that mean nothing.
    ReservedOperating {
        /// These bits, 3 and 4.
        bits: u8,
    },
    /// The configuration was accepted: DATA_EXCH.
    DataExchange {
        /// The master.
        master: u8,
    },
    /// The slave went back to WAIT_PRM.
    Lost(Loss),
    /// A master that is not the owner tried to parameterize or configure the slave.
    Stranger {
        /// Its address.
        master: u8,
    },
}

impl Event {
    /// Whether something went wrong that a person should look at.
    #[must_use]
    pub const fn is_trouble(&self) -> bool {
        match self {
            Self::ParametersRefused(_) | Self::Stranger { .. } => true,
            Self::Lost(loss) => !matches!(loss, Loss::Unlocked),
            _ => false,
        }
    }
}

impl fmt::Display for ParameterFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Short { octets } => {
                write!(f, "Set_Prm has {octets} octets: the standard demands 7")
            }
            Self::WatchdogFactor { factors: [first, second] } => write!(
                f,
                "Set_Prm octets 2–3: watchdog factors {first} and {second}; with the watchdog on \
                 both are 1 to 255"
            ),
            Self::IdentNumber { given, own } => write!(
                f,
                "Set_Prm octets 5–6: ident number {given:04X}h, this device is {own:04X}h: the \
                 master has the GSD file of another device"
            ),
            Self::NotSupported { octet } => write!(
                f,
                "Set_Prm octet 8: {octet:02X}h asks for DP-V1, fail-safe or publisher; a DP-V0 \
                 slave has only bit 2, the watchdog base of 1 ms"
            ),
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BaudRateFound(rate) => write!(f, "baud rate found: {rate}"),
            Self::BaudRateLost => f.write_str("baud rate lost, searching"),
            Self::Parameterized { master } => write!(f, "parameterized by master {master}"),
            Self::ParametersRefused(fault) => write!(f, "parameters refused: {fault}"),
            Self::ReservedStationStatus { bits } => {
                write!(f, "Set_Prm octet 1: reserved bits {bits:02X}h are set, and ignored")
            }
            Self::ReservedOperating { bits } => {
                write!(f, "Set_Prm octet 8: reserved bits {bits:02X}h are set, and ignored")
            }
            Self::DataExchange { master } => write!(f, "data exchange with master {master}"),
            Self::Lost(Loss::Watchdog) => {
                f.write_str("the master was silent longer than the watchdog time")
            }
            Self::Lost(Loss::Unlocked) => f.write_str("the master let go of the slave"),
            Self::Lost(Loss::Parameters) => f.write_str("back to WAIT_PRM: parameters refused"),
            Self::Lost(Loss::Configuration) => {
                f.write_str("back to WAIT_PRM: configuration refused")
            }
            Self::Lost(Loss::OutputLength { given, expected }) => write!(
                f,
                "back to WAIT_PRM: the master sent {given} octets of outputs, the configuration \
                 has {expected}"
            ),
            Self::Stranger { master } => {
                write!(f, "master {master} tried to take the slave, which belongs to another")
            }
        }
    }
}

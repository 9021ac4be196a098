//! What the master and its slaves are told, and why it may not be.

use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;
use profirust::fdl::{Parameters, ParametersBuilder};
use thiserror::Error;

use super::clock::Clock;

/// The highest station address.
pub const HIGHEST_ADDRESS: u8 = 125;
/// The most octets of process data one way.
pub const DATA_OCTETS: usize = 244;
/// The most user parameters: octets 8 and following of Set_Prm.
pub const USER_PARAMETER_OCTETS: usize = 237;
/// The longest slot time in bits.
pub const LONGEST_SLOT: u16 = 16_383;

/// What the master is told about itself and the bus.
///
/// Start from [`MasterSettings::new`] and change what differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MasterSettings {
    /// Its station address, 0 … 125.
    pub address: u8,
    /// The rate of the bus.
    pub baud_rate: BaudRate,
    /// The slot time T_SL in bits, how long it waits for an answer to begin:
    /// [`shortest_slot`] … 16 383; `None` for the shortest. PC ports that are slower than a bus
    /// need longer ones.
    pub slot_bits: Option<u16>,
    /// The delay min T_SDR in bits that slaves shall keep before they answer, 11 … 255
    /// (Set_Prm octet 4).
    pub min_station_delay: u8,
    /// HSA, 1 … 126: other masters are looked for below it (GAP). Greater than the address.
    pub highest_station_address: u8,
    /// How many times the token goes round between two searches for masters, 1 … 100. A master
    /// alone on its bus asks one address in each cycle, whatever this says.
    pub gap_wait_rotations: u8,
    /// How often a request is repeated before its slave counts as absent, 1 … 15.
    pub retries: u8,
    /// The time after which slaves without a master let go, 10 ms … 650 s, rounded up to 10 ms or
    /// a little more, as two factors say it; `None` leaves their watchdogs off.
    pub watchdog: Option<Duration>,
    /// The target rotation time T_TR in bits, 256 … 16 777 960; `None` for 5000 bits for each
    /// address below HSA. Below twice the bus cycle the token goes on in the midst of a cycle.
    pub token_rotation_bits: Option<u32>,
}

/// What the master is told about one slave.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SlaveSettings {
    /// Its station address, 0 … 125.
    pub address: u8,
    /// The ident number it must have (Set_Prm octets 5, 6).
    pub ident_number: u16,
    /// Octets 8 and following of Set_Prm, up to 237.
    pub user_parameters: Vec<u8>,
    /// The identifiers of Chk_Cfg, 1 … 244 octets.
    pub configuration: Vec<u8>,
    /// Octets from the slave to the master, as the configuration says, up to 244.
    pub inputs: usize,
    /// Octets from the master to the slave, as the configuration says, up to 244.
    pub outputs: usize,
    /// Its groups, a bit each (Set_Prm octet 7).
    pub groups: u8,
    /// Whether the slave shall be able to obey Sync (Set_Prm octet 1 bit 5).
    pub sync: bool,
    /// Whether the slave shall be able to obey Freeze (Set_Prm octet 1 bit 4).
    pub freeze: bool,
}

/// Why settings cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SettingsError {
    /// The master's address is above 125.
    #[error("master address {0} does not exist: station addresses are 0 to 125")]
    MasterAddress(u8),
    /// The slot time is too short for the rate, or longer than 14 bits can say.
    #[error(
        "a slot time of {given} bits is not possible at {baud_rate}: {} to {LONGEST_SLOT} are",
        shortest_slot(*.baud_rate)
    )]
    SlotTime {
        /// What was given.
        given: u16,
        /// The rate.
        baud_rate: BaudRate,
    },
    /// min T_SDR is below one character.
    #[error("a min T_SDR of {0} bits is too short: 11 to 255 are possible")]
    StationDelay(u8),
    /// HSA is not above the master's address, or above 126.
    #[error("HSA {given} does not fit master {address}: it lies above that address, 126 at most")]
    HighestStationAddress {
        /// What was given.
        given: u8,
        /// The master's address.
        address: u8,
    },
    /// The GAP factor is out of range.
    #[error("a GAP factor of {0} is not possible: 1 to 100 rotations are")]
    GapWait(u8),
    /// The number of retries is out of range.
    #[error("{0} retries are not possible: 1 to 15 are")]
    Retries(u8),
    /// The watchdog time is out of range.
    #[error(
        "a watchdog time of {0} s is not possible: 10 ms to 650 s are; without one, leave it out"
    )]
    Watchdog(Duration),
    /// The target rotation time is out of range.
    #[error("a target rotation time of {0} bits is not possible: 256 to 16 777 960 are")]
    TokenRotation(u32),
    /// A slave's address is above 125.
    #[error("slave address {0} does not exist: station addresses are 0 to 125")]
    SlaveAddress(u8),
    /// Two stations have one address.
    #[error("address {0} is given to two stations")]
    AddressInUse(u8),
    /// More user parameters than Set_Prm carries.
    #[error("slave {address} is given {given} user parameters: Set_Prm carries 237")]
    UserParameters {
        /// The slave.
        address: u8,
        /// How many octets.
        given: usize,
    },
    /// No identifier, or more than Chk_Cfg carries.
    #[error("slave {address} is given {given} configuration identifiers: Chk_Cfg carries 1 to 244")]
    Configuration {
        /// The slave.
        address: u8,
        /// How many octets.
        given: usize,
    },
    /// More process data than a telegram carries.
    #[error("slave {address} is given {given} octets of inputs or outputs: a telegram carries 244")]
    Data {
        /// The slave.
        address: u8,
        /// How many octets.
        given: usize,
    },
}

/// The shortest slot time at a rate, in bits: longer than any slave may take to answer there.
#[must_use]
pub const fn shortest_slot(baud_rate: BaudRate) -> u16 {
    match baud_rate {
        BaudRate::Kbit500 => 200,
        BaudRate::Mbit1_5 => 300,
        BaudRate::Mbit3 => 400,
        BaudRate::Mbit6 => 600,
        BaudRate::Mbit12 => 1_000,
        _ => 100,
    }
}

/// How long an answer may take to begin on the port of a PC, which takes its time.
const PATIENCE: Duration = Duration::from_millis(20);

/// A slot time at a rate for the ports of a PC, in bits: 20 ms, as far as a slot time can be as long,
/// and never less than [`shortest_slot`].
#[must_use]
pub fn patient_slot(baud_rate: BaudRate) -> u16 {
    let bits = PATIENCE.as_nanos() * u64::from(baud_rate.bits_per_second()) / 1_000_000_000;
    let patient = u16::try_from(bits).unwrap_or(LONGEST_SLOT).min(LONGEST_SLOT);
    patient.max(shortest_slot(baud_rate))
}

impl MasterSettings {
    /// A master at `address` with the shortest slot time, min T_SDR 11, HSA 126, GAP factor 10, one
    /// retry, and a watchdog of 200 ms.
    #[must_use]
    pub const fn new(address: u8, baud_rate: BaudRate) -> Self {
        Self {
            address,
            baud_rate,
            slot_bits: None,
            min_station_delay: 11,
            highest_station_address: 126,
            gap_wait_rotations: 10,
            retries: 1,
            watchdog: Some(Duration::from_millis(200)),
            token_rotation_bits: None,
        }
    }

    /// The slot time in bits that is in force.
    #[must_use]
    pub const fn slot(&self) -> u16 {
        match self.slot_bits {
            Some(bits) => bits,
            None => shortest_slot(self.baud_rate),
        }
    }

    /// Whether a master can be made of them.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn check(&self) -> Result<(), SettingsError> {
        let Self { address, baud_rate, .. } = *self;
        if address > HIGHEST_ADDRESS {
            return Err(SettingsError::MasterAddress(address));
        }
        let slot = self.slot();
        if !(shortest_slot(baud_rate)..=LONGEST_SLOT).contains(&slot) {
            return Err(SettingsError::SlotTime { given: slot, baud_rate });
        }
        if self.min_station_delay < 11 {
            return Err(SettingsError::StationDelay(self.min_station_delay));
        }
        let given = self.highest_station_address;
        if given <= address || given > HIGHEST_ADDRESS + 1 {
            return Err(SettingsError::HighestStationAddress { given, address });
        }
        if !(1..=100).contains(&self.gap_wait_rotations) {
            return Err(SettingsError::GapWait(self.gap_wait_rotations));
        }
        if !(1..=15).contains(&self.retries) {
            return Err(SettingsError::Retries(self.retries));
        }
        if let Some(watchdog) = self.watchdog
            && !(Duration::from_millis(10)..=Duration::from_secs(650)).contains(&watchdog)
        {
            return Err(SettingsError::Watchdog(watchdog));
        }
        match self.token_rotation_bits {
            Some(bits) if !(256..=16_777_960).contains(&bits) => {
                Err(SettingsError::TokenRotation(bits))
            }
            _ => Ok(()),
        }
    }

    /// The parameters for profirust, which panics unless [`check`](Self::check) is content.
    pub(super) fn parameters(&self) -> Parameters {
        let mut builder = ParametersBuilder::new(self.address, Clock::TOLD);
        builder
            .slot_bits(self.slot())
            .highest_station_address(self.highest_station_address)
            .gap_wait_rotations(self.gap_wait_rotations)
            .max_retry_limit(self.retries)
            .min_tsdr(self.min_station_delay);
        if let Some(bits) = self.token_rotation_bits {
            builder.token_rotation_bits(bits);
        }
        if let Some(watchdog) = self.watchdog {
            let centiseconds = watchdog.as_nanos().div_ceil(10_000_000);
            builder.watchdog_timeout(profirust::time::Duration::from_millis(centiseconds * 10));
        }
        builder.build()
    }
}

impl SlaveSettings {
    /// Whether a slave of `master` can be made of them.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn check(&self, master: u8) -> Result<(), SettingsError> {
        let Self { address, inputs, outputs, .. } = *self;
        if address > HIGHEST_ADDRESS {
            return Err(SettingsError::SlaveAddress(address));
        }
        if address == master {
            return Err(SettingsError::AddressInUse(address));
        }
        let given = self.user_parameters.len();
        if given > USER_PARAMETER_OCTETS {
            return Err(SettingsError::UserParameters { address, given });
        }
        let given = self.configuration.len();
        if !(1..=DATA_OCTETS).contains(&given) {
            return Err(SettingsError::Configuration { address, given });
        }
        let given = inputs.max(outputs);
        if given > DATA_OCTETS {
            return Err(SettingsError::Data { address, given });
        }
        Ok(())
    }
}

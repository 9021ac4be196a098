//! The passport of an encoder: all that a replacement needs to give the same positions.
//!
//! ```text
//! take ──▶ Passport ──▶ to_toml ──▶ a file ──▶ parse ──▶ Passport ──▶ plan ──▶ Plan ──▶ carry_out ──▶ Report
//!             ▲                                             └──▶ compare ──▶ Differences
//! from_capture ┘
//! ```
//!
//! Settings are the same on any encoder; the position is not. It is the code of the disc, scaled, plus
//! the offset that a preset has made, and another disc has another code at the same place of the
//! machine. So the encoder that the passport is of gets its offset back, wherever the machine stands,
//! and any other one a preset, while the machine stands at a place whose position is known.

mod capture;
mod carry_out;
mod compare;
mod file;
mod measure;
mod plan;
mod project;
mod report;
mod take;

use std::time::SystemTime;

use codewheel_device::Product;
use codewheel_device::product::Bus;
use codewheel_station::Duration;
use jiff::Timestamp;

use crate::{Identity, Reading};

pub use capture::from_capture;
pub use compare::{Difference, Subject, compare};
pub use file::FileError;
pub use plan::{Change, Plan, Positioning, plan};
pub use project::{ExpectedPacketRates, Project, ProjectWord};
pub use report::{Report, Step, Verdict};
pub use take::take;

/// The version of the file that is written, and the only one that is read.
pub const FORMAT: u32 = 1;

/// What an encoder said of itself at one moment.
///
/// What it did not say is `None`, or absent from the settings, and where the passport comes from a
/// capture [`absent`](Self::absent) names it.
#[derive(Clone, Debug, PartialEq)]
pub struct Passport {
    /// When it said so, in whole seconds.
    pub taken: Timestamp,
    /// The program that wrote it down, with its version: `codewheel 0.1.0`.
    pub program: String,
    /// Who told it.
    pub source: Source,
    /// What was not to be learned: `settings.cos-delta`, `identity.serial`. Empty where the device
    /// was asked.
    pub absent: Vec<String>,
    /// The bus.
    pub bus: Bus,
    /// The address.
    pub address: u8,
    /// The rate of the bus in bit/s.
    pub bit_rate: Option<u32>,
    /// Who the device is.
    pub nameplate: Nameplate,
    /// What people chose, in the order of its manual.
    pub settings: Vec<Setting>,
    /// Where it stood.
    pub position: Position,
    /// What the project of its master must say.
    pub project: Project,
}

/// Who told a passport.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Source {
    /// The device, asked by a master of ours.
    Device,
    /// The traffic of a bus, recorded while others spoke.
    Capture,
}

/// Who a device is. What it did not say is `None`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Nameplate {
    /// The products of the catalogue that it may be; empty for a device that is not ours.
    pub models: Vec<&'static Product>,
    /// The vendor: DeviceNet identity attribute 1.
    pub vendor: Option<u16>,
    /// The device type: identity attribute 2.
    pub device_type: Option<u16>,
    /// The product code: identity attribute 3; on PROFIBUS the ident number.
    pub product_code: Option<u16>,
    /// Major and minor revision: identity attribute 4.
    pub revision: Option<(u8, u8)>,
    /// The serial number: identity attribute 6. PROFIBUS does not tell it.
    pub serial: Option<u32>,
    /// The product name: identity attribute 7.
    pub product_name: Option<String>,
    /// The version of its firmware: `1.01`.
    pub firmware: Option<String>,
    /// S, the steps of its disc in a turn.
    pub singleturn_resolution: Option<u32>,
    /// M, the turns that it can tell apart: 65536 of a multiturn encoder, 1 of a singleturn one.
    pub revolutions: Option<u32>,
}

impl From<Identity> for Nameplate {
    fn from(identity: Identity) -> Self {
        Self {
            models: identity.models,
            vendor: identity.vendor,
            device_type: identity.device_type,
            product_code: Some(identity.product_code),
            revision: identity.revision,
            serial: identity.serial,
            product_name: identity.product_name,
            firmware: identity.firmware,
            singleturn_resolution: None,
            revolutions: None,
        }
    }
}

impl Nameplate {
    /// Whether two nameplates are of one and the same encoder; `None` where nothing tells. A serial
    /// number alone does not: encoders of other makers and models count theirs from 1, too.
    fn is_same_unit(&self, other: &Self) -> Option<bool> {
        fn contradict<T: PartialEq>(one: &Option<T>, other: &Option<T>) -> bool {
            one.as_ref().zip(other.as_ref()).is_some_and(|(one, other)| one != other)
        }
        let is_other = contradict(&self.serial, &other.serial)
            || contradict(&self.vendor, &other.vendor)
            || contradict(&self.device_type, &other.device_type)
            || contradict(&self.product_code, &other.product_code)
            || contradict(&self.product_name, &other.product_name)
            || contradict(&self.singleturn_resolution, &other.singleturn_resolution)
            || contradict(&self.revolutions, &other.revolutions);
        if is_other {
            return Some(false);
        }
        self.serial.zip(other.serial).map(|_| true)
    }
}

/// One setting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The name on the command line: `steps-per-turn`, `2f/1/7`, `parameter/3`.
    pub name: String,
    /// What it is.
    pub reading: Reading,
    /// What a person should know of it, in one line: the comment behind it in the file.
    pub note: String,
}

/// Where an encoder stood. What is not known is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Position {
    /// The preset as last written, in steps.
    pub preset: Option<i64>,
    /// What presets add to the scaled code, in steps.
    pub offset: Option<i64>,
    /// The position, in steps.
    pub steps: Option<u32>,
    /// Whether the shaft was at rest: it moved by no more than a step while it was watched.
    pub at_rest: Option<bool>,
}

/// What a passport says besides what the device tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Circumstances {
    /// The time now.
    pub when: SystemTime,
    /// The program and its version: `codewheel 0.1.0`.
    pub program: String,
    /// The rate of the bus in bit/s, where it is known.
    pub bit_rate: Option<u32>,
    /// How long the shaft is watched, to see whether it is at rest; 250 ms will do.
    pub watch: Duration,
}

impl Circumstances {
    /// Circumstances with 250 ms of watching and an unknown bit rate.
    #[must_use]
    pub fn new(when: SystemTime, program: impl Into<String>) -> Self {
        Self { when, program: program.into(), bit_rate: None, watch: Duration::from_millis(250) }
    }

    /// The time in whole seconds; what no calendar has becomes 1970.
    fn taken(&self) -> Timestamp {
        whole_seconds(Timestamp::try_from(self.when).unwrap_or(Timestamp::UNIX_EPOCH))
    }
}

fn whole_seconds(moment: Timestamp) -> Timestamp {
    Timestamp::from_second(moment.as_second()).unwrap_or(Timestamp::UNIX_EPOCH)
}

impl Passport {
    /// The setting of this name.
    #[must_use]
    pub fn setting(&self, name: &str) -> Option<&Reading> {
        self.settings.iter().find(|setting| setting.name == name).map(|setting| &setting.reading)
    }

    /// The setting of this name, where it is a number.
    #[must_use]
    pub fn number(&self, name: &str) -> Option<i64> {
        match self.setting(name) {
            Some(Reading::Number(number)) => Some(*number),
            _ => None,
        }
    }
}

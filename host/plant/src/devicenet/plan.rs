//! What a plan says of the scanner of a DeviceNet.

use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::Trigger;
use codewheel_station::Duration;

use crate::field_bus::PlannedMaster;

/// A scanner.
#[derive(Clone, Debug, PartialEq)]
pub struct MasterPlan {
    /// What messages call it.
    pub name: String,
    /// Its address.
    pub mac: MacId,
    /// How often it polls.
    pub interval: Duration,
    /// The shortest pause between two poll cycles.
    pub interscan_delay: Duration,
    /// Whether its terminating resistor is on.
    pub termination: bool,
    /// It has the address of an earlier station on purpose.
    pub duplicate: bool,
    /// Its scan list.
    pub slaves: Vec<SlavePlan>,
}

/// How the data of a slave is fetched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exchange {
    /// The master asks and the slave answers.
    Poll,
    /// The slave produces of its own accord.
    Change {
        /// What makes it produce.
        trigger: Trigger,
        /// Whether each production is acknowledged.
        acknowledged: bool,
        /// The shortest pause between two productions in ms; 0: none.
        production_inhibit: u16,
    },
    /// The slave is only kept reachable.
    Explicit,
}

/// One line of a scan list.
#[derive(Clone, Debug, PartialEq)]
pub struct SlavePlan {
    /// Its address.
    pub mac: MacId,
    /// How its data is fetched.
    pub exchange: Exchange,
    /// The expected packet rate in ms; 0: no time-out.
    pub expected_packet_rate: u16,
    /// The assembly it shall produce; `None` leaves what it has kept.
    pub assembly: Option<u8>,
    /// Vendor and product code it must have; `None` takes any.
    pub identity: Option<(u16, u16)>,
}

impl SlavePlan {
    /// Polls `mac`, whatever it is, with an expected packet rate of 200 ms.
    #[must_use]
    pub const fn poll(mac: MacId) -> Self {
        let exchange = Exchange::Poll;
        Self { mac, exchange, expected_packet_rate: 200, assembly: None, identity: None }
    }
}

impl PlannedMaster for MasterPlan {
    const KIND: &'static str = "scanner";

    fn name(&self) -> &str {
        &self.name
    }

    fn address(&self) -> u8 {
        self.mac.value()
    }

    fn termination(&self) -> bool {
        self.termination
    }

    fn slaves(&self) -> impl Iterator<Item = u8> {
        self.slaves.iter().map(|slave| slave.mac.value())
    }
}

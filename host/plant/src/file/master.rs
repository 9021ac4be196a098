//! The tables of masters and the slaves they serve.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Spanned;

use crate::TimeSpan;

/// A master.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MasterTable {
    /// What messages call it. Default: its kind and its address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
    /// What it is. Default: the one that belongs to its bus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<MasterKind>")]
    pub(crate) kind: Option<Spanned<MasterKind>>,
    /// The bus it is on. Default: the bus, where there is only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) bus: Option<Spanned<String>>,
    /// Its address: 0 to 63 on a DeviceNet, 0 to 125 on a PROFIBUS.
    #[schemars(with = "u8", range(max = 125))]
    pub(crate) address: Spanned<i64>,
    /// Scanner: how often it polls. Default 10ms; 0s: as fast as the bus carries it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<TimeSpan>")]
    pub(crate) interval: Option<Spanned<TimeSpan>>,
    /// Scanner: the shortest pause between two poll cycles. Default 0s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<TimeSpan>")]
    pub(crate) interscan_delay: Option<Spanned<TimeSpan>>,
    /// DP master: the slot time in bits, how long it waits for an answer to begin, up to 16383.
    /// Default: the shortest at the rate of the bus on virtual buses; on others 20 ms, since a PC is
    /// slower than a slave.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u16>")]
    pub(crate) slot_bits: Option<Spanned<u16>>,
    /// DP master: how many bits slaves wait before they answer, 11 to 255. Default 11.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u8>", range(min = 11))]
    pub(crate) min_station_delay: Option<Spanned<u8>>,
    /// DP master: after this time without it its slaves let go, 10ms to 650s. Default 200ms, 5s
    /// below 187.5k; 0s: never.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<TimeSpan>")]
    pub(crate) watchdog: Option<Spanned<TimeSpan>>,
    /// DP master: the addresses below which it looks for other masters, up to 126. Default 126.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u8>", range(min = 1, max = 126))]
    pub(crate) highest_station_address: Option<Spanned<u8>>,
    /// DP master: how many times the token goes round between two such looks, 1 to 100. Default 10.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u8>", range(min = 1, max = 100))]
    pub(crate) gap_wait_rotations: Option<Spanned<u8>>,
    /// DP master: how often it repeats a request, 1 to 15. Default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u8>", range(min = 1, max = 15))]
    pub(crate) retries: Option<Spanned<u8>>,
    /// DP master: the target rotation time of the token in bits, 256 to 16777960. Default: 5000 for
    /// each address below the highest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u32>")]
    pub(crate) token_rotation_bits: Option<Spanned<u32>>,
    /// Whether its terminating resistor is on. Default true.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) termination: Option<bool>,
    /// It has the address of an earlier station on purpose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<bool>")]
    pub(crate) duplicate: Option<Spanned<bool>>,
    /// The slaves it serves. Default: every device of its bus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) slave: Option<Vec<SlaveTable>>,
}

/// What a master is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum MasterKind {
    /// Of a DeviceNet.
    Scanner,
    /// Of a PROFIBUS.
    DpMaster,
}

/// A slave that a master serves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SlaveTable {
    /// Its address: 0 to 63 on a DeviceNet, 0 to 125 on a PROFIBUS.
    #[schemars(with = "u8", range(max = 125))]
    pub(crate) address: Spanned<i64>,
    /// DeviceNet: how its data is fetched. Default poll.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Connection>")]
    pub(crate) connection: Option<Spanned<Connection>>,
    /// DeviceNet: the expected packet rate, 0 to 65535ms in whole milliseconds; after four times as long the
    /// connection times out, and change-of-state and cyclic slaves produce at least this often.
    /// Default 200ms, 1s for change-of-state; 0s: never. A cyclic slave needs at least 1ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<TimeSpan>")]
    pub(crate) expected_packet_rate: Option<Spanned<TimeSpan>>,
    /// For change-of-state and cyclic: whether each production is acknowledged. Default true.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<bool>")]
    pub(crate) acknowledged: Option<Spanned<bool>>,
    /// For change-of-state and cyclic: the shortest pause between two productions, at most the
    /// expected packet rate. Default 0s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<TimeSpan>")]
    pub(crate) production_inhibit: Option<Spanned<TimeSpan>>,
    /// DeviceNet: what it shall produce; of these encoders assembly 1, the position, or 2, position
    /// and flags. Default: what it has kept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u8>")]
    pub(crate) assembly: Option<Spanned<u8>>,
    /// DeviceNet: the vendor it must have; together with product_code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u16>")]
    pub(crate) vendor: Option<Spanned<u16>>,
    /// DeviceNet: the product code it must have; together with vendor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u16>")]
    pub(crate) product_code: Option<Spanned<u16>>,
    /// PROFIBUS: its device class. 2 has scaling, preset and the long diagnosis. Default 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u8>", range(min = 1, max = 2))]
    pub(crate) class: Option<Spanned<u8>>,
    /// PROFIBUS: what is exchanged. F1 and F0 carry presets, D1 and D0 do not; F0 and D0 carry the
    /// low 16 bits of the position only. Default F1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<ConfigurationName>")]
    pub(crate) configuration: Option<Spanned<ConfigurationName>>,
    /// PROFIBUS: the sense of rotation in which the position grows. Default cw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<DirectionName>")]
    pub(crate) direction: Option<Spanned<DirectionName>>,
    /// PROFIBUS: whether the position is scaled. Default true in class 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<bool>")]
    pub(crate) scaling: Option<Spanned<bool>>,
    /// PROFIBUS: the steps per turn. Default: what the code disc has, 8192 where the slave is
    /// none of this plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u32>")]
    pub(crate) steps_per_turn: Option<Spanned<u32>>,
    /// PROFIBUS: the total resolution in steps. Default: as many turns as the device tells apart,
    /// 65536 where it is none of this plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u32>")]
    pub(crate) total_resolution: Option<Spanned<u32>>,
    /// PROFIBUS: the groups it is in, 1 to 8 each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vec<u8>>", inner(inner(range(min = 1, max = 8))))]
    pub(crate) groups: Option<Spanned<Vec<u8>>>,
    /// PROFIBUS: the presets it gets, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) preset: Vec<PresetTable>,
}

/// A preset that a master gives to a slave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PresetTable {
    /// When, from the start of the plant; later where the slave exchanges no data then.
    #[schemars(with = "TimeSpan")]
    pub(crate) at: Spanned<TimeSpan>,
    /// The position that the shaft has from then on.
    #[schemars(with = "u32")]
    pub(crate) value: Spanned<u32>,
}

/// What a slave and its master exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub(crate) enum ConfigurationName {
    /// Two words each way.
    F1,
    /// Two words to the master.
    D1,
    /// One word each way.
    F0,
    /// One word to the master.
    D0,
}

/// A sense of rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum DirectionName {
    /// Clockwise seen looking at the flange.
    Cw,
    /// Counterclockwise.
    Ccw,
}

/// How the data of a slave is fetched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Connection {
    /// The master asks and the slave answers.
    #[default]
    Poll,
    /// The slave produces what changes, and at the expected packet rate.
    ChangeOfState,
    /// The slave produces at the expected packet rate.
    Cyclic,
    /// The slave is only kept reachable; no I/O data.
    Explicit,
}

//! The plant file as it is written: tables, keys and what serde can say about their values.
//!
//! What the values mean together is told by [`check`](crate::check).

use std::borrow::Cow;
use std::fmt;
use std::path::PathBuf;

use codewheel_device::product;
use codewheel_station::can::BitRate;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toml::Spanned;

use crate::TimeSpan;

/// A plant: buses, the devices on them, their shafts, memories and faults, and the masters that
/// talk to them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Codewheel plant")]
pub(crate) struct PlantFile {
    /// The buses.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) bus: Vec<BusTable>,
    /// The devices.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) device: Vec<DeviceTable>,
    /// The masters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) master: Vec<MasterTable>,
}

/// A bus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct BusTable {
    /// What devices and masters call it.
    #[schemars(with = "String")]
    pub(crate) name: Spanned<String>,
    /// What is spoken on it.
    #[serde(default)]
    pub(crate) kind: BusKind,
    /// Where it is: virtual:NAME is simulated, slcan-listen:HOST:PORT plays an adapter that others
    /// connect to, slcan:HOST:PORT connects to an adapter. Default virtual: and the name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) uri: Option<Spanned<String>>,
    /// The bit rate.
    #[serde(default)]
    pub(crate) baud: Baud,
    /// How likely a station misses a frame, 0 to 1. Virtual buses only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>", range(min = 0.0, max = 1.0))]
    pub(crate) loss: Option<Spanned<f64>>,
    /// How likely a frame is destroyed and repeated, 0 to 1. Virtual buses only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>", range(min = 0.0, max = 1.0))]
    pub(crate) corruption: Option<Spanned<f64>>,
    /// What all chance on this bus is drawn from: the same seed, the same course of events.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u32>")]
    pub(crate) seed: Option<Spanned<u32>>,
}

/// What is spoken on a bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub(crate) enum BusKind {
    #[default]
    #[serde(rename = "devicenet")]
    DeviceNet,
}

/// A bit rate of DeviceNet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub(crate) enum Baud {
    #[default]
    #[serde(rename = "125k")]
    Kbit125,
    #[serde(rename = "250k")]
    Kbit250,
    #[serde(rename = "500k")]
    Kbit500,
}

impl From<Baud> for BitRate {
    fn from(baud: Baud) -> Self {
        match baud {
            Baud::Kbit125 => Self::Kbit125,
            Baud::Kbit250 => Self::Kbit250,
            Baud::Kbit500 => Self::Kbit500,
        }
    }
}

impl From<BitRate> for Baud {
    fn from(rate: BitRate) -> Self {
        match rate {
            BitRate::Kbit125 => Self::Kbit125,
            BitRate::Kbit250 => Self::Kbit250,
            BitRate::Kbit500 => Self::Kbit500,
        }
    }
}

fn models(schema: &mut Schema) {
    let models: Vec<_> = product::DEVICENET.iter().map(|product| product.model).collect();
    schema.insert("enum".into(), models.into());
}

/// An encoder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DeviceTable {
    /// What messages call it. Default: model and address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
    /// The bus it is on. Default: the bus, where there is only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) bus: Option<Spanned<String>>,
    /// The model, as `codewheel models` lists it.
    #[schemars(with = "String", transform = models)]
    pub(crate) model: Spanned<String>,
    /// The address, 0 to 63; sets the switches, those of the bit rate as the bus has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u8>", range(max = 63))]
    pub(crate) address: Option<Spanned<i64>>,
    /// The switches themselves, where `address` cannot say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<SwitchesValue>")]
    pub(crate) switches: Option<Spanned<SwitchesValue>>,
    /// Whether its terminating resistor is on.
    #[serde(default)]
    pub(crate) termination: bool,
    /// What its shaft does: still, turn rpm=60, sine amplitude=90deg period=2s,
    /// profile 0s:0 1s:90deg, csv FILE.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) shaft: Option<Spanned<String>>,
    /// The file of its non-volatile memory, from the folder of the plant file. Without one it
    /// forgets with the process, but not with a power cut.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) memory: Option<Spanned<PathBuf>>,
    /// Its serial number. Default: what its memory holds, else its address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) serial: Option<u32>,
    /// It has the address of an earlier station on purpose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<bool>")]
    pub(crate) duplicate: Option<Spanned<bool>>,
    /// What will go wrong with it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) fault: Vec<FaultTable>,
}

/// Where switches stand: the number that both rotary switches show, or each switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SwitchesValue {
    Number(u8),
    Each(SwitchTable),
}

/// Each switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SwitchTable {
    /// Rotary switch 1, tens, and 2, units: 0 to 9 each.
    #[schemars(inner(range(max = 9)))]
    pub(crate) rotary: [u8; 2],
    /// DIP switches 1, 2 and 3, true for ON; 1 means nothing, 2 and 3 set the bit rate. Default:
    /// as the bus has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) dip: Option<[bool; 3]>,
}

impl Serialize for SwitchesValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(number) => number.serialize(serializer),
            Self::Each(table) => table.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for SwitchesValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(SwitchesVisitor)
    }
}

struct SwitchesVisitor;

impl<'de> Visitor<'de> for SwitchesVisitor {
    type Value = SwitchesValue;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the number that the rotary switches show, 0 to 99, or { rotary = [0, 5] }")
    }

    fn visit_i64<E: de::Error>(self, number: i64) -> Result<Self::Value, E> {
        match u8::try_from(number) {
            Ok(number @ 0..=99) => Ok(SwitchesValue::Number(number)),
            _ => Err(E::invalid_value(de::Unexpected::Signed(number), &self)),
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        SwitchTable::deserialize(MapAccessDeserializer::new(map)).map(SwitchesValue::Each)
    }
}

impl JsonSchema for SwitchesValue {
    fn schema_name() -> Cow<'static, str> {
        "Switches".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "The number that both rotary switches show, or each switch",
            "anyOf": [
                { "type": "integer", "minimum": 0, "maximum": 99 },
                generator.subschema_for::<SwitchTable>(),
            ],
        })
    }
}

/// Something that goes wrong, or right again, at one moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FaultTable {
    /// When, from the start of the plant.
    pub(crate) at: TimeSpan,
    /// What.
    #[schemars(with = "FaultKind")]
    pub(crate) kind: Spanned<FaultKind>,
    /// For jump: how many raw steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<i32>")]
    pub(crate) steps: Option<Spanned<i32>>,
    /// For power-cut (default 1s), drop-answers, late-answers and bad-transceiver (default for
    /// ever): how long.
    #[serde(default, rename = "for", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<TimeSpan>")]
    pub(crate) lasts: Option<Spanned<TimeSpan>>,
    /// For drop-answers: after so many it is over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u32>")]
    pub(crate) count: Option<Spanned<u32>>,
    /// For drop-answers and bad-transceiver: how likely each frame is hit, 0 to 1. Default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>", range(min = 0.0, max = 1.0))]
    pub(crate) probability: Option<Spanned<f64>>,
    /// For late-answers: how late.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<TimeSpan>")]
    pub(crate) delay: Option<Spanned<TimeSpan>>,
}

/// What can go wrong with a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum FaultKind {
    /// The code jumps by some steps and stays there: a position error, where a shaft that turns
    /// cannot have come that far.
    Jump,
    /// The voltage of the lithium cell is too low from now on.
    CellLow,
    /// The voltage of the lithium cell is right again.
    CellRight,
    /// The sensor holds its code from now on.
    Stuck,
    /// The sensor is free again.
    Free,
    /// The power fails and comes back; a record that is just being written is torn.
    PowerCut,
    /// What the device says does not arrive.
    DropAnswers,
    /// What the device says comes late.
    LateAnswers,
    /// The CAN controller leaves the bus for 128 times 11 bits.
    BusOff,
    /// What the device sends is destroyed on the wire, until its controller leaves the bus. Virtual
    /// buses only.
    BadTransceiver,
}

/// A master.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MasterTable {
    /// What messages call it. Default: scanner and its address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
    /// What it is.
    #[serde(default)]
    pub(crate) kind: MasterKind,
    /// The bus it is on. Default: the bus, where there is only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) bus: Option<Spanned<String>>,
    /// Its address, 0 to 63.
    #[schemars(with = "u8", range(max = 63))]
    pub(crate) address: Spanned<i64>,
    /// How often it polls. Default 10ms; 0s: as fast as the bus carries it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) interval: Option<TimeSpan>,
    /// The shortest pause between two poll cycles. Default 0s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) interscan_delay: Option<TimeSpan>,
    /// Whether its terminating resistor is on. Default true.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) termination: Option<bool>,
    /// It has the address of an earlier station on purpose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<bool>")]
    pub(crate) duplicate: Option<Spanned<bool>>,
    /// Its scan list. Default: every device of its bus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) slave: Option<Vec<SlaveTable>>,
}

/// What a master is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum MasterKind {
    #[default]
    Scanner,
}

/// One line of a scan list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SlaveTable {
    /// Its address, 0 to 63.
    #[schemars(with = "u8", range(max = 63))]
    pub(crate) address: Spanned<i64>,
    /// How its data is fetched.
    #[serde(default)]
    pub(crate) connection: Connection,
    /// The expected packet rate, 0 to 65535ms in whole milliseconds; after four times as long the
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
    /// What it shall produce; of these encoders assembly 1, the position, or 2, position and flags.
    /// Default: what it has kept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) assembly: Option<u8>,
    /// The vendor it must have; together with product_code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u16>")]
    pub(crate) vendor: Option<Spanned<u16>>,
    /// The product code it must have; together with vendor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u16>")]
    pub(crate) product_code: Option<Spanned<u16>>,
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

/// The JSON Schema of plant files, as text that ends with a line feed.
#[must_use]
pub fn schema() -> String {
    let schema = schemars::schema_for!(PlantFile);
    let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
    text.push('\n');
    text
}

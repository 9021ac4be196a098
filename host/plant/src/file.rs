//! The plant file as it is written: tables, keys and what serde can say about their values.
//!
//! What the values mean together is told by [`check`](crate::check).

mod master;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fmt;
use std::path::PathBuf;

use codewheel_device::Product;
use codewheel_station::can::BitRate;
use codewheel_station::rs485::BaudRate;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toml::Spanned;

use crate::TimeSpan;

pub(crate) use master::{
    ConfigurationName, Connection, DirectionName, MasterKind, MasterTable, PresetTable, SlaveTable,
};

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
    /// Where it is: virtual:NAME is simulated. A DeviceNet: socketcan:can0 is a CAN interface of
    /// Linux; slcan:/dev/tty… is an SLCAN adapter at a serial port, of 115200 bit/s unless @SPEED
    /// follows, slcan:HOST:PORT one on TCP; slcan-listen:HOST:PORT and slcan-listen:pty:PATH play an
    /// adapter that others connect to, socketcand-listen:HOST:PORT a socketcand server. A PROFIBUS:
    /// rs485:/dev/tty… is a serial port; rs485-listen:HOST:PORT and rs485-listen:pty:PATH are a line
    /// that others connect to, rs485:HOST:PORT connects to such a line. A PATH begins with / or a
    /// dot. Default virtual: and the name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) uri: Option<Spanned<String>>,
    /// The bit rate. A DeviceNet has 125k, 250k and 500k, default 125k; a PROFIBUS 9.6k, 19.2k,
    /// 45.45k, 93.75k, 187.5k, 500k, 1.5M, 3M, 6M and 12M, default 1.5M.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>", transform = rates)]
    pub(crate) baud: Option<Spanned<String>>,
    /// PROFIBUS: how long its cable is, in metres; no longer than the rate allows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u32>")]
    pub(crate) cable_m: Option<Spanned<u32>>,
    /// How likely a station misses a frame or telegram, 0 to 1. Virtual buses only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>", range(min = 0.0, max = 1.0))]
    pub(crate) loss: Option<Spanned<f64>>,
    /// How likely a frame or telegram is destroyed, 0 to 1; a frame is repeated. Virtual buses
    /// only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>", range(min = 0.0, max = 1.0))]
    pub(crate) corruption: Option<Spanned<f64>>,
    /// PROFIBUS: how likely a character is broken, 0 to 1. Virtual buses only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>", range(min = 0.0, max = 1.0))]
    pub(crate) broken: Option<Spanned<f64>>,
    /// PROFIBUS: how likely two bits of a character are turned over, which its parity does not
    /// show, 0 to 1. Virtual buses only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>", range(min = 0.0, max = 1.0))]
    pub(crate) flipped: Option<Spanned<f64>>,
    /// PROFIBUS: how likely a telegram has a pause in it, 0 to 1. Virtual buses only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>", range(min = 0.0, max = 1.0))]
    pub(crate) pause: Option<Spanned<f64>>,
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
    #[serde(rename = "profibus")]
    Profibus,
}

/// Names the rates of both buses, each once.
fn rates(schema: &mut Schema) {
    let of_can = BitRate::ALL.iter().map(ToString::to_string);
    let mut rates: Vec<_> = of_can.chain(BaudRate::ALL.iter().map(ToString::to_string)).collect();
    let mut seen = BTreeSet::new();
    rates.retain(|rate| seen.insert(rate.clone()));
    schema.insert("enum".into(), rates.into());
}

fn models(schema: &mut Schema) {
    let models: Vec<_> = Product::all().map(|product| product.model).collect();
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
    /// The address, 0 to 63 on a DeviceNet, 0 to 99 on a PROFIBUS; sets the switches, on a
    /// DeviceNet those of the bit rate as the bus has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u8>", range(max = 99))]
    pub(crate) address: Option<Spanned<i64>>,
    /// The switches themselves, where `address` cannot say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<SwitchesValue>")]
    pub(crate) switches: Option<Spanned<SwitchesValue>>,
    /// Whether its terminating resistor is on.
    #[serde(default)]
    pub(crate) termination: bool,
    /// What its shaft does: still, turn rpm=60, sine amplitude=90deg period=2s,
    /// profile 0s:0 1s:90deg, csv FILE. Of a converter: the shaft of the encoder at its SSI line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) shaft: Option<Spanned<String>>,
    /// PROFIBUS: whether it searches the rate of its line. Default true on virtual buses, false on
    /// others, where it is told the rate of the bus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<bool>")]
    pub(crate) auto_baud: Option<Spanned<bool>>,
    /// Of a converter (HEAG 162): how it reads the encoder at its SSI line, and what that encoder
    /// sends. Default: the word of the product, Gray, 500k, 20us, read once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<SsiTable>")]
    pub(crate) ssi: Option<Spanned<SsiTable>>,
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
    /// DeviceNet: DIP switches 1, 2 and 3, true for ON; 1 means nothing, 2 and 3 set the bit rate.
    /// Default: as the bus has it.
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

/// How a converter reads its SSI line.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SsiTable {
    /// The bits of the word: 13, 18 or 29 as the product says, or 25 on an SP 29.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u8>")]
    pub(crate) word: Option<Spanned<u8>>,
    /// How the code is written. Default gray.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) code: Option<CodeName>,
    /// The clock, 100k to 1M. Default 500k.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) clock: Option<Spanned<String>>,
    /// How long the encoder wants no clock before it latches anew. Default 20us.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<TimeSpan>")]
    pub(crate) monoflop: Option<Spanned<TimeSpan>>,
    /// A real encoder in place of the one on the shaft, at an SPI controller of Linux:
    /// spidev:/dev/spidev0.0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub(crate) line: Option<Spanned<String>>,
    /// Whether each word is read twice and compared. Default false.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) double_read: Option<bool>,
}

/// How a code is written in an SSI word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum CodeName {
    /// One bit changes with each step.
    Gray,
    /// The binary number.
    Binary,
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
    /// For drop-answers and bad-transceiver: how likely each answer is hit, 0 to 1. Default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<f64>", range(min = 0.0, max = 1.0))]
    pub(crate) probability: Option<Spanned<f64>>,
    /// For late-answers: how late.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<TimeSpan>")]
    pub(crate) delay: Option<Spanned<TimeSpan>>,
    /// For ssi-wrong-word: how many bits, 1 to 32. For ssi-flipped-bits: which ones, as a number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u32>")]
    pub(crate) bits: Option<Spanned<u32>>,
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
    /// What the device sends is destroyed on the wire; a CAN controller leaves the bus in the end.
    /// Virtual buses only.
    BadTransceiver,
    /// The SSI encoder is unplugged: its line stays high.
    SsiUnplugged,
    /// The SSI data line is shorted: it stays low.
    SsiShort,
    /// The SSI encoder sends words of another length.
    SsiWrongWord,
    /// The SSI encoder does not pull its line low after the word.
    SsiNoMonoflop,
    /// Some bits of each SSI word arrive inverted; its repetition is sound.
    SsiFlippedBits,
    /// Nothing is wrong with the SSI line any more.
    SsiRight,
}

/// The JSON Schema of plant files, as text that ends with a line feed.
#[must_use]
pub fn schema() -> String {
    let schema = schemars::schema_for!(PlantFile);
    let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
    text.push('\n');
    text
}

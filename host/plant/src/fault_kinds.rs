//! The kinds of faults that people can begin and end, and what each of them takes.

use codewheel_device::Product;
use codewheel_sim::ssi;
use codewheel_station::Duration;

use crate::check::cannot_suffer;
use crate::fault::Lever;
use crate::{FaultDescription, FaultParameter, ParameterKind, SensorPlan};

/// A kind of fault.
struct Kind {
    name: &'static str,
    title: &'static str,
    help: &'static str,
    /// What it is like, to be asked whether a product can have it.
    like: Lever,
    /// What ends it; `None` where it is over at once.
    end: Option<End>,
    parameters: &'static [FaultParameter],
}

/// What ends a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum End {
    /// The lever's own end.
    Released,
    /// Another lever.
    By(Lever),
}

const PROBABILITY: FaultParameter = FaultParameter {
    name: "probability",
    kind: ParameterKind::Probability,
    required: false,
    default: Some("1"),
    help: "How likely each answer is hit",
};

const LASTS: FaultParameter = FaultParameter {
    name: "for",
    kind: ParameterKind::Time,
    required: false,
    default: None,
    help: "How long; without it until it is ended",
};

/// All kinds, in the order in which people meet them.
static KINDS: [Kind; 13] = [
    Kind {
        name: "jump",
        title: "The code jumps",
        help: "The code jumps and stays there: a position error",
        like: Lever::Jump(0),
        end: None,
        parameters: &[FaultParameter {
            name: "steps",
            kind: ParameterKind::Integer,
            required: true,
            default: None,
            help: "How many raw steps, clockwise where positive",
        }],
    },
    Kind {
        name: "stuck",
        title: "The sensor is stuck",
        help: "The sensor holds its code while the shaft turns on",
        like: Lever::Stuck(true),
        end: Some(End::By(Lever::Stuck(false))),
        parameters: &[],
    },
    Kind {
        name: "cell-low",
        title: "The lithium cell runs low",
        help: "The voltage of the lithium cell is too low: a warning",
        like: Lever::CellLow(true),
        end: Some(End::By(Lever::CellLow(false))),
        parameters: &[],
    },
    Kind {
        name: "power-cut",
        title: "The power is cut",
        help: "The power fails and comes back; a record that is just being written is torn",
        like: Lever::PowerCut(Duration::ZERO),
        end: Some(End::Released),
        parameters: &[FaultParameter {
            default: Some("1s"),
            help: "How long the power is gone",
            ..LASTS
        }],
    },
    Kind {
        name: "drop-answers",
        title: "Answers are lost",
        help: "What the device says does not arrive",
        like: Lever::DropAnswers { probability: 1.0, count: None, lasts: None },
        end: Some(End::Released),
        parameters: &[
            PROBABILITY,
            FaultParameter {
                name: "count",
                kind: ParameterKind::Integer,
                required: false,
                default: None,
                help: "After so many it is over",
            },
            LASTS,
        ],
    },
    Kind {
        name: "late-answers",
        title: "Answers are late",
        help: "What the device says comes late",
        like: Lever::LateAnswers { delay: Duration::ZERO, lasts: None },
        end: Some(End::Released),
        parameters: &[
            FaultParameter {
                name: "delay",
                kind: ParameterKind::Time,
                required: true,
                default: None,
                help: "How late",
            },
            LASTS,
        ],
    },
    Kind {
        name: "bus-off",
        title: "The controller leaves the bus",
        help: "The CAN controller is off the bus for 128 times 11 bits",
        like: Lever::BusOff,
        end: None,
        parameters: &[],
    },
    Kind {
        name: "bad-transceiver",
        title: "The transceiver is bad",
        help: "What the device sends is destroyed on the wire",
        like: Lever::BadTransceiver { probability: 1.0, lasts: None },
        end: Some(End::Released),
        parameters: &[PROBABILITY, LASTS],
    },
    Kind {
        name: "ssi-unplugged",
        title: "The SSI encoder is unplugged",
        help: "The SSI data line stays high",
        like: Lever::Ssi(Some(ssi::Fault::Unplugged)),
        end: Some(End::By(Lever::Ssi(None))),
        parameters: &[],
    },
    Kind {
        name: "ssi-short",
        title: "The SSI data line is shorted",
        help: "The SSI data line stays low",
        like: Lever::Ssi(Some(ssi::Fault::Shorted)),
        end: Some(End::By(Lever::Ssi(None))),
        parameters: &[],
    },
    Kind {
        name: "ssi-wrong-word",
        title: "SSI words have another length",
        help: "The SSI encoder sends words of so many bits",
        like: Lever::Ssi(Some(ssi::Fault::WordLength(1))),
        end: Some(End::By(Lever::Ssi(None))),
        parameters: &[FaultParameter {
            name: "bits",
            kind: ParameterKind::Integer,
            required: true,
            default: None,
            help: "How many bits a word has, 1 to 32",
        }],
    },
    Kind {
        name: "ssi-no-monoflop",
        title: "The SSI encoder loses its monoflop",
        help: "The SSI data line is not low after the word",
        like: Lever::Ssi(Some(ssi::Fault::NoMonoflop)),
        end: Some(End::By(Lever::Ssi(None))),
        parameters: &[],
    },
    Kind {
        name: "ssi-flipped-bits",
        title: "Bits of SSI words arrive inverted",
        help: "Some bits of each SSI word arrive inverted; its repetition is sound",
        like: Lever::Ssi(Some(ssi::Fault::FlippedBits(0))),
        end: Some(End::By(Lever::Ssi(None))),
        parameters: &[FaultParameter {
            name: "bits",
            kind: ParameterKind::Integer,
            required: true,
            default: None,
            help: "Which bits, as a number: 1 is the lowest",
        }],
    },
];

/// What can go wrong with `product` and `sensor` on a simulated wire or a real port.
pub(crate) fn of(product: &Product, sensor: &SensorPlan, simulated: bool) -> Vec<FaultDescription> {
    let possible =
        KINDS.iter().filter(|kind| cannot_suffer(kind.like, product, sensor, simulated).is_none());
    possible
        .map(|kind| FaultDescription {
            kind: kind.name,
            title: kind.title,
            help: kind.help,
            lasts: kind.end.is_some(),
            parameters: kind.parameters.to_vec(),
        })
        .collect()
}

/// What a kind of fault is like, and what ends it; `None` where there is no such kind.
pub(crate) fn end_of(name: &str) -> Option<(Lever, Option<End>)> {
    KINDS.iter().find(|kind| kind.name == name).map(|kind| (kind.like, kind.end))
}

/// The names of all kinds.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    KINDS.iter().map(|kind| kind.name)
}

/// The kind of a fault of an SSI line.
pub(crate) const fn kind_of(fault: ssi::Fault) -> &'static str {
    match fault {
        ssi::Fault::Unplugged => "ssi-unplugged",
        ssi::Fault::Shorted => "ssi-short",
        ssi::Fault::WordLength(_) => "ssi-wrong-word",
        ssi::Fault::NoMonoflop => "ssi-no-monoflop",
        ssi::Fault::FlippedBits(_) => "ssi-flipped-bits",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::lever_of_words;

    #[test]
    fn each_kind_is_one_of_plant_files_and_takes_the_parameters_that_it_names() {
        let has_a_cell = Product::find("amg81-d29").unwrap();
        let converter = Product::find("heag162-p29").unwrap();
        let ssi = SensorPlan::parse(converter, &[]).unwrap();
        for kind in &KINDS {
            let (product, sensor) = match kind.like {
                Lever::Ssi(_) => (converter, &ssi),
                _ => (has_a_cell, &SensorPlan::Disc),
            };
            let lever = |wanted: &dyn Fn(&FaultParameter) -> bool| {
                let words = kind.parameters.iter().filter(|parameter| wanted(parameter));
                let words = words.map(|parameter| {
                    let value = match parameter.kind {
                        ParameterKind::Integer => "13",
                        ParameterKind::Probability => "0.5",
                        ParameterKind::Time => "20ms",
                    };
                    format!(" {}={value}", parameter.name)
                });
                let words = format!("{}{}", kind.name, words.collect::<String>());
                lever_of_words(&words, product, sensor, true)
            };
            for lever in [lever(&|_| true), lever(&|parameter| parameter.required)] {
                let lever = lever.unwrap_or_else(|error| panic!("{}: {error}", kind.name));
                assert_eq!(std::mem::discriminant(&lever), std::mem::discriminant(&kind.like));
                if let Lever::Ssi(Some(fault)) = lever {
                    assert_eq!(kind_of(fault), kind.name);
                }
            }
            for left_out in kind.parameters.iter().filter(|parameter| parameter.required) {
                assert!(lever(&|parameter| parameter.name != left_out.name).is_err());
            }
        }
    }

    /// The schema of plant files is made of all kinds that there are.
    #[test]
    fn every_kind_of_plant_files_begins_or_ends_a_fault_here() {
        let schema: serde_json::Value = serde_json::from_str(&crate::schema()).unwrap();
        let kinds = schema["$defs"]["FaultKind"]["oneOf"].as_array().unwrap();
        let ends = ["cell-right", "free", "ssi-right"];
        let mut kinds: Vec<_> = kinds.iter().map(|kind| kind["const"].as_str().unwrap()).collect();
        kinds.retain(|kind| !ends.contains(kind));
        let mut named: Vec<_> = names().collect();
        kinds.sort_unstable();
        named.sort_unstable();
        assert_eq!(named, kinds);
    }

    #[test]
    fn a_product_is_offered_the_faults_that_it_can_have() {
        let names = |model: &str, simulated| {
            let product = Product::find(model).unwrap();
            let sensor = SensorPlan::parse(product, &[]).unwrap();
            let kinds = of(product, &sensor, simulated).into_iter().map(|fault| fault.kind);
            kinds.collect::<Vec<_>>()
        };
        assert!(names("amg81-d29", true).contains(&"cell-low"));
        assert!(!names("amg11-d29", true).contains(&"cell-low"));
        assert!(names("amg11-d29", true).contains(&"bad-transceiver"));
        assert!(!names("amg11-d29", false).contains(&"bad-transceiver"));
        assert!(!names("amg11-p29", true).contains(&"bus-off"));
        assert!(names("heag162-p29", true).contains(&"ssi-short"));
        assert!(!names("amg11-p29", true).contains(&"ssi-short"));
    }
}

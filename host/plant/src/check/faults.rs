//! What the keys of a fault mean for its kind.

use std::mem::discriminant;
use std::ops::Range;

use codewheel_device::Product;
use codewheel_device::product::{Bus, Shaft};
use codewheel_sim::ssi;
use codewheel_station::{Duration, Instant};

use super::{Source, span};
use crate::fault::{Fault, Lever};
use crate::field_bus::FieldBus;
use crate::file::{FaultKind, FaultTable};
use crate::{BusPlan, Complaint, SensorPlan};

/// How long a power cut lasts that does not say it.
const POWER_CUT: Duration = Duration::from_secs(1);

impl Source<'_> {
    pub(super) fn faults<B: FieldBus>(
        &self,
        tables: &[FaultTable],
        product: &Product,
        sensor: &SensorPlan,
        bus: &BusPlan<B>,
    ) -> Result<Vec<Fault>, Complaint> {
        let mut faults: Vec<(Fault, usize)> = Vec::new();
        for table in tables {
            let fault = Fault { at: Instant::ZERO + table.at.0, lever: self.lever(table)? };
            let at = table.kind.span();
            if let Some(message) = cannot_suffer(fault.lever, product, sensor, bus.is_virtual()) {
                return Err(self.complaint(at, message));
            }
            if let Some((_, line)) = faults.iter().find(|(other, _)| overlap(&fault, other)) {
                let message =
                    format!("this is still going on, or begins meanwhile, by line {line}");
                return Err(self.complaint(at, message));
            }
            faults.push((fault, self.line(&table.kind)));
        }
        Ok(faults.into_iter().map(|(fault, _)| fault).collect())
    }

    fn lever(&self, table: &FaultTable) -> Result<Lever, Complaint> {
        let kind = *table.kind.get_ref();
        let lasts = table.lasts.as_ref().map(|time| time.get_ref().0);
        let allowed: &[&str] = match kind {
            FaultKind::Jump => &["steps"],
            FaultKind::PowerCut => &["for"],
            FaultKind::DropAnswers => &["probability", "count", "for"],
            FaultKind::LateAnswers => &["delay", "for"],
            FaultKind::BadTransceiver => &["probability", "for"],
            FaultKind::SsiWrongWord | FaultKind::SsiFlippedBits => &["bits"],
            FaultKind::CellLow
            | FaultKind::CellRight
            | FaultKind::Stuck
            | FaultKind::Free
            | FaultKind::BusOff
            | FaultKind::SsiUnplugged
            | FaultKind::SsiShort
            | FaultKind::SsiNoMonoflop
            | FaultKind::SsiRight => &[],
        };
        for (key, at) in given(table) {
            if !allowed.contains(&key) {
                let allowed = match allowed {
                    [] => String::new(),
                    allowed => format!(" and {}", allowed.join(", ")),
                };
                let message =
                    format!("`{key}` means nothing to this kind, which takes at{allowed}");
                return Err(self.complaint(at, message));
            }
        }
        if let Some(time) = table.lasts.as_ref().filter(|time| time.get_ref().0 == Duration::ZERO) {
            let message = "a fault lasts longer than nothing".to_owned();
            return Err(self.complaint(time.span(), message));
        }
        let missing = |key| {
            self.complaint(table.kind.span(), format!("missing key `{key}` for this kind of fault"))
        };
        let probability = self.probability(table.probability.as_ref())?.unwrap_or(1.0);
        let count = table.count.as_ref().map(|count| *count.get_ref());
        Ok(match kind {
            FaultKind::Jump => {
                Lever::Jump(*table.steps.as_ref().ok_or_else(|| missing("steps"))?.get_ref())
            }
            FaultKind::CellLow => Lever::CellLow(true),
            FaultKind::CellRight => Lever::CellLow(false),
            FaultKind::Stuck => Lever::Stuck(true),
            FaultKind::Free => Lever::Stuck(false),
            FaultKind::PowerCut => Lever::PowerCut(lasts.unwrap_or(POWER_CUT)),
            FaultKind::DropAnswers => Lever::DropAnswers { probability, count, lasts },
            FaultKind::LateAnswers => {
                let delay = table.delay.as_ref().ok_or_else(|| missing("delay"))?;
                Lever::LateAnswers { delay: delay.get_ref().0, lasts }
            }
            FaultKind::BusOff => Lever::BusOff,
            FaultKind::SsiUnplugged => Lever::Ssi(Some(ssi::Fault::Unplugged)),
            FaultKind::SsiShort => Lever::Ssi(Some(ssi::Fault::Shorted)),
            FaultKind::SsiNoMonoflop => Lever::Ssi(Some(ssi::Fault::NoMonoflop)),
            FaultKind::SsiRight => Lever::Ssi(None),
            FaultKind::SsiFlippedBits => {
                let bits = *table.bits.as_ref().ok_or_else(|| missing("bits"))?.get_ref();
                Lever::Ssi(Some(ssi::Fault::FlippedBits(bits)))
            }
            FaultKind::SsiWrongWord => {
                let given = table.bits.as_ref().ok_or_else(|| missing("bits"))?;
                let bits =
                    u8::try_from(*given.get_ref()).ok().filter(|bits| (1..=32).contains(bits));
                let bits = bits.ok_or_else(|| {
                    let message = format!("{} bits are no word: it has 1 to 32", given.get_ref());
                    self.complaint(given.span(), message)
                })?;
                Lever::Ssi(Some(ssi::Fault::WordLength(bits)))
            }
            FaultKind::BadTransceiver => Lever::BadTransceiver { probability, lasts },
        })
    }
}

/// Why a product cannot suffer a fault.
pub(crate) fn cannot_suffer(
    lever: Lever,
    product: &Product,
    sensor: &SensorPlan,
    on_virtual_bus: bool,
) -> Option<String> {
    let model = product.model;
    match lever {
        lever if lever.is_of_the_sensor() && matches!(sensor, SensorPlan::SsiLine(..)) => {
            Some("a real encoder is at the SSI line: it fails by itself".into())
        }
        Lever::CellLow(_) if !product.encoder.lithium_cell => {
            Some(format!("an {model} has no lithium cell"))
        }
        Lever::BadTransceiver { .. } if !on_virtual_bus => Some(
            "bad-transceiver is for virtual buses: there are no bits to destroy on this one".into(),
        ),
        Lever::BusOff if product.bus != Bus::DeviceNet => {
            Some(format!("bus-off is for CAN: an {model} has no controller that gives up"))
        }
        Lever::Ssi(_) if product.family.shaft() != Shaft::None => {
            Some(format!("an {model} has no SSI line: that is for a HEAG 162"))
        }
        _ => None,
    }
}

/// The fault in words, as on a command line: `jump steps=4000 at=5s`, for `product` with `sensor`
/// on a real port.
///
/// # Errors
/// What is wrong, as one sentence.
pub(crate) fn fault_of_words(
    words: &str,
    product: &Product,
    sensor: &SensorPlan,
) -> Result<Fault, String> {
    let (at, lever) = table_of_words(words)?;
    match cannot_suffer(lever, product, sensor, false) {
        Some(message) => Err(message),
        None => Ok(Fault { at, lever }),
    }
}

/// The fault in words that begins now, `jump steps=4000`, for `product` with `sensor`.
///
/// # Errors
/// What is wrong, as one sentence.
pub(crate) fn lever_of_words(
    words: &str,
    product: &Product,
    sensor: &SensorPlan,
    on_virtual_bus: bool,
) -> Result<Lever, String> {
    if words.split_whitespace().any(|word| word.starts_with("at=")) {
        return Err("a fault that is asked for begins now: leave out at=".to_owned());
    }
    let (_, lever) = table_of_words(&format!("{words} at=0s"))?;
    match cannot_suffer(lever, product, sensor, on_virtual_bus) {
        Some(message) => Err(message),
        None => Ok(lever),
    }
}

/// When words say that a fault begins, and what it does.
fn table_of_words(words: &str) -> Result<(Instant, Lever), String> {
    let mut words = words.split_whitespace();
    let kind = words.next().ok_or("say what goes wrong, as in 'jump steps=4000 at=5s'")?;
    let mut keys = vec![("kind", kind)];
    for word in words {
        let key = word.split_once('=');
        keys.push(key.ok_or_else(|| format!("{word:?} is no key=value, as in steps=4000"))?);
    }
    let text = super::toml_of(keys);
    let table: FaultTable =
        toml::from_str(&text).map_err(|error| super::in_our_words(error.message()))?;
    let source = Source { text: &text, name: "", folder: std::path::Path::new("") };
    let lever = source.lever(&table).map_err(|complaint| complaint.message().to_owned())?;
    Ok((Instant::ZERO + table.at.0, lever))
}

/// The keys that a fault has besides `at` and `kind`.
fn given(table: &FaultTable) -> impl Iterator<Item = (&'static str, Range<usize>)> {
    let FaultTable { at: _, kind: _, steps, lasts, count, probability, delay, bits } = table;
    [
        ("steps", span(steps)),
        ("for", span(lasts)),
        ("count", span(count)),
        ("probability", span(probability)),
        ("delay", span(delay)),
        ("bits", span(bits)),
    ]
    .into_iter()
    .filter_map(|(key, at)| Some((key, at?)))
}

/// Whether two faults of one kind last at the same time, so that the end of one would end both.
fn overlap(a: &Fault, b: &Fault) -> bool {
    let end = |fault: &Fault| fault.lever.lasts().map_or(fault.at, |lasts| fault.at + lasts);
    let lasting = a.lever.lasts().is_some() || b.lever.lasts().is_some();
    lasting
        && discriminant(&a.lever) == discriminant(&b.lever)
        && a.at < end(b).max(b.at + Duration::from_nanos(1))
        && b.at < end(a).max(a.at + Duration::from_nanos(1))
}

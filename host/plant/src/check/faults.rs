//! What the keys of a fault mean for its kind.

use std::mem::discriminant;
use std::ops::Range;

use codewheel_device::Product;
use codewheel_link::BusUri;
use codewheel_station::{Duration, Instant};
use toml::Spanned;

use super::Source;
use crate::fault::{Fault, Lever};
use crate::file::{FaultKind, FaultTable};
use crate::{Complaint, TimeSpan};

/// How long a power cut lasts that does not say it.
const POWER_CUT: Duration = Duration::from_secs(1);

impl Source<'_> {
    pub(super) fn faults(
        &self,
        tables: &[FaultTable],
        product: &Product,
        uri: &BusUri,
    ) -> Result<Vec<Fault>, Complaint> {
        let mut faults: Vec<(Fault, usize)> = Vec::new();
        for table in tables {
            let fault = Fault { at: Instant::ZERO + table.at.0, lever: self.lever(table)? };
            let at = table.kind.span();
            if matches!(fault.lever, Lever::CellLow(_)) && !product.encoder.lithium_cell {
                let message = format!("an {} has no lithium cell", product.model);
                return Err(self.complaint(at, message));
            }
            let is_virtual = matches!(uri, BusUri::Virtual(_));
            if matches!(fault.lever, Lever::BadTransceiver { .. }) && !is_virtual {
                let message = "bad-transceiver is for virtual buses: there are no bits to destroy \
                               on this one";
                return Err(self.complaint(at, message.into()));
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
            FaultKind::CellLow
            | FaultKind::CellRight
            | FaultKind::Stuck
            | FaultKind::Free
            | FaultKind::BusOff => &[],
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
            FaultKind::BadTransceiver => Lever::BadTransceiver { probability, lasts },
        })
    }
}

/// The keys that a fault has besides `at` and `kind`.
fn given(table: &FaultTable) -> impl Iterator<Item = (&'static str, Range<usize>)> {
    fn span<T>(value: &Option<Spanned<T>>) -> Option<Range<usize>> {
        value.as_ref().map(Spanned::span)
    }
    let FaultTable { at: _, kind: _, steps, lasts, count, probability, delay } = table;
    [
        ("steps", span(steps)),
        ("for", span::<TimeSpan>(lasts)),
        ("count", span(count)),
        ("probability", span(probability)),
        ("delay", span(delay)),
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

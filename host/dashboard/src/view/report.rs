//! What happened.

use codewheel_plant::{BusSnapshot, Report};
use serde::Serialize;
use utoipa::ToSchema;

use super::seconds;

/// Something that happened in the plant.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct ReportDocument {
    /// Seconds since the start; null where it has no moment.
    at: Option<f64>,
    /// The bus; null where it is none.
    bus: Option<String>,
    /// The device; null where it is the bus itself.
    device: Option<String>,
    text: String,
    /// Whether a person should look at it.
    trouble: bool,
}

impl ReportDocument {
    /// All that `bus` reports, in order.
    pub(crate) fn all(bus: &BusSnapshot) -> Vec<Self> {
        let own = bus.reports.iter().map(|report| (report, None));
        let of_devices = bus.devices.iter().flat_map(|device| {
            device.reports.iter().map(|report| (report, Some(device.name.as_str())))
        });
        let mut reports: Vec<_> = own.chain(of_devices).collect();
        reports.sort_by_key(|(report, _)| report.at);
        reports.into_iter().map(|(report, device)| Self::new(bus, device, report)).collect()
    }

    /// Says that reports were lost, because more came than a stream could tell.
    pub(crate) fn lost(count: u64) -> Self {
        Self {
            at: None,
            bus: None,
            device: None,
            text: format!("{count} reports were lost before they were told"),
            trouble: true,
        }
    }

    fn new(bus: &BusSnapshot, device: Option<&str>, report: &Report) -> Self {
        Self {
            at: Some(seconds(report.at)),
            bus: Some(bus.name.clone()),
            device: device.map(str::to_owned),
            text: report.what.to_string(),
            trouble: report.what.is_trouble(),
        }
    }
}

//! What happens while a plant runs, told on stderr.

use codewheel_plant::{BusSnapshot, Report};

use crate::arguments::Chatter;

/// Who has to hear of it: what a device tells of its own accord is for those who ask for more,
/// trouble is for everybody, a loss also for those who asked for silence.
pub(crate) const fn is_for(report: &Report, chatter: Chatter) -> bool {
    match chatter {
        Chatter::Quiet => report.what.is_loss(),
        Chatter::Normal => report.what.is_trouble(),
        Chatter::Verbose => true,
    }
}

/// Tells what one bus and its devices have to report, in order.
pub(crate) fn snapshot(snapshot: &BusSnapshot, chatter: Chatter) {
    let mut reports: Vec<(&Report, Option<&str>)> =
        snapshot.reports.iter().map(|report| (report, None)).collect();
    for device in &snapshot.devices {
        reports.extend(device.reports.iter().map(|report| (report, Some(device.name.as_str()))));
    }
    reports.retain(|(report, _)| is_for(report, chatter));
    reports.sort_by_key(|(report, _)| report.at);
    for (Report { at, what }, device) in reports {
        match device {
            Some(device) => eprintln!("codewheel: {at} {}: {device}: {what}", snapshot.name),
            None => eprintln!("codewheel: {at} {}: {what}", snapshot.name),
        }
    }
}

/// Whether [`snapshot`] would say anything.
pub(crate) fn has_something(snapshot: &BusSnapshot, chatter: Chatter) -> bool {
    let devices = snapshot.devices.iter().flat_map(|device| &device.reports);
    snapshot.reports.iter().chain(devices).any(|report| is_for(report, chatter))
}

//! What the API says of a plant, as JSON. The documents here are the contract with the page and with
//! programs: a member is added when there is more to say, and never changes its meaning.

mod description;
mod object;
mod report;
mod state;
mod trace;

pub(crate) use description::PlantDocument;
pub(crate) use object::{GroupDocument, ValueDocument};
pub(crate) use report::ReportDocument;
pub(crate) use state::{BusState, StateDocument};
pub(crate) use trace::TraceDocument;

/// `number` with so many decimals, so that what has hardly changed is not sent again.
fn rounded(number: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    (number * scale).round() / scale
}

/// Seconds since the start of the plant, in milliseconds.
fn seconds(at: codewheel_station::Instant) -> f64 {
    rounded(at.as_nanos() as f64 / 1e9, 3)
}

fn milliseconds(time: codewheel_station::Duration) -> f64 {
    rounded(time.as_nanos() as f64 / 1e6, 2)
}

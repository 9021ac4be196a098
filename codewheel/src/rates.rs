//! Bit rates as `--baud` gives them.

use codewheel_plant::Profibus;
use codewheel_station::can::BitRate;
use codewheel_station::rs485::BaudRate;

use crate::failure::Failure;

/// A rate of DeviceNet; 125k where none is given, as an encoder leaves the factory.
pub(crate) fn devicenet(text: Option<&str>) -> Result<BitRate, Failure> {
    let Some(text) = text else { return Ok(BitRate::Kbit125) };
    let mut rates = BitRate::ALL.into_iter();
    let rate = rates.find(|rate| rate.to_string().eq_ignore_ascii_case(text));
    rate.ok_or_else(|| no_rate(text, "125k, 250k and 500k"))
}

/// A rate of PROFIBUS; 1.5M where none is given.
pub(crate) fn profibus(text: Option<&str>) -> Result<BaudRate, Failure> {
    let Some(text) = text else { return Ok(BaudRate::Mbit1_5) };
    Profibus::rate(text).ok_or_else(|| {
        let rates: Vec<_> = BaudRate::ALL.iter().map(ToString::to_string).collect();
        no_rate(text, &rates.join(", "))
    })
}

fn no_rate(text: &str, rates: &str) -> Failure {
    Failure::Usage(format!("invalid value '{text}' for '--baud <RATE>': the rates are {rates}"))
}

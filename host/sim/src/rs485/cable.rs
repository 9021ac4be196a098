//! How long the cable may be.

use codewheel_station::rs485::BaudRate;

/// The longest cable of type A, in metres, that a segment may have at this rate (PROFIBUS manual,
/// chapter 10).
///
/// The manual's table has neither 45.45k nor 6M. Here they have what both their neighbours have,
/// 1200 m and 100 m (decision).
#[must_use]
pub const fn longest_cable(rate: BaudRate) -> u32 {
    match rate {
        BaudRate::Kbit9_6 | BaudRate::Kbit19_2 | BaudRate::Kbit45_45 | BaudRate::Kbit93_75 => 1_200,
        BaudRate::Kbit187_5 => 1_000,
        BaudRate::Kbit500 => 400,
        BaudRate::Mbit1_5 => 200,
        BaudRate::Mbit3 | BaudRate::Mbit6 | BaudRate::Mbit12 => 100,
    }
}

//! SSI lines at the SPI controllers of Linux (`/dev/spidev0.0`).
//!
//! [`SsiUri`] names a line, `SpidevLine` (Linux only) clocks it.
//!
//! **Compiled and tested without a controller; nobody has tried it on hardware yet.**

#[cfg(target_os = "linux")]
mod line;
mod uri;

#[cfg(target_os = "linux")]
pub use line::{CannotOpen, SpidevLine};
pub use uri::{InvalidSsiUri, SsiUri};

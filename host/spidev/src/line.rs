//! An SSI line at an SPI controller.

use std::io;
use std::path::{Path, PathBuf};

use codewheel_encoder::ssi::{Line, Settings, octets_for, samples_of};
use codewheel_station::{Duration, Instant};
use spidev::{SpiModeFlags, Spidev, SpidevOptions, SpidevTransfer};
use thiserror::Error;

/// The octets of the longest reading.
const MOST_OCTETS: usize = 8;

/// An SSI line whose clock is the clock of an SPI controller and whose data are its input, through
/// RS-422 drivers. Output and chip select stay unconnected.
///
/// The controller runs in mode 2: its clock rests high and samples at the falling edge. It clocks
/// whole octets without a gap between them, and at a rate it can make, at most the one asked for;
/// a period of that must still be shorter than the monoflop time of the encoder. The receiver must
/// be fail-safe, so that a missing encoder reads as high.
///
/// Compiled and tested without a controller; not tried on hardware.
#[derive(Debug)]
pub struct SpidevLine {
    spidev: Spidev,
    /// How long the kernel keeps the line at rest after a reading, so that the next one, however
    /// soon it is asked for, comes after the monoflop time.
    pause_micros: u16,
    error: Option<io::Error>,
}

/// Why a controller cannot be used; the message says what to do.
#[derive(Debug, Error)]
pub enum CannotOpen {
    /// The file does not open.
    #[error(
        "cannot open {}: {error}; switch SPI on for this computer, and see that you may read and \
         write the file", path.display()
    )]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        #[source]
        error: io::Error,
    },
    /// It cannot be set to the clock of SSI.
    #[error(
        "{} cannot be an SSI line: {error}; it must be an SPI controller that knows mode 2 and \
         {clock_hz} Hz", path.display()
    )]
    Controller {
        /// The file.
        path: PathBuf,
        /// The clock asked for.
        clock_hz: u32,
        /// What the system says.
        #[source]
        error: io::Error,
    },
}

impl SpidevLine {
    /// Opens the controller at `path` for readings by `settings`.
    ///
    /// # Errors
    /// [`CannotOpen`], where the file does not open or is no controller for this clock.
    pub fn open(path: &Path, settings: &Settings) -> Result<Self, CannotOpen> {
        let spidev = Spidev::open(path)
            .map_err(|error| CannotOpen::File { path: path.to_owned(), error })?;
        let mut line = Self { spidev, pause_micros: whole_micros(settings.monoflop), error: None };
        let options = SpidevOptions::new()
            .bits_per_word(8)
            .max_speed_hz(settings.clock_hz)
            .lsb_first(false)
            .mode(SpiModeFlags::SPI_MODE_2)
            .build();
        line.spidev.configure(&options).map_err(|error| CannotOpen::Controller {
            path: path.to_owned(),
            clock_hz: settings.clock_hz,
            error,
        })?;
        Ok(line)
    }

    /// Takes what the system said to the last transfer that failed, which the encoder sees as
    /// [`NoTransfer`](codewheel_encoder::ssi::LineFault::NoTransfer).
    pub const fn take_error(&mut self) -> Option<io::Error> {
        self.error.take()
    }
}

impl Line for SpidevLine {
    /// Reads at once, whatever `now` is, and returns after the monoflop time.
    fn transfer(&mut self, _now: Instant, clocks: u8, clock_hz: u32) -> Option<u64> {
        let mut octets = [0; MOST_OCTETS];
        let wanted = octets.get_mut(..octets_for(clocks))?;
        let mut transfer = SpidevTransfer::read(wanted);
        transfer.speed_hz = clock_hz;
        transfer.delay_usecs = self.pause_micros;
        match self.spidev.transfer(&mut transfer) {
            Ok(()) => Some(samples_of(&octets, clocks)),
            Err(error) => {
                self.error = Some(error);
                None
            }
        }
    }
}

/// Rounded up; at most 65 ms, which is more than a cycle.
fn whole_micros(span: Duration) -> u16 {
    u16::try_from(span.as_nanos().div_ceil(1_000)).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use codewheel_encoder::ssi::{Input, LineFault, Word};
    use codewheel_encoder::{Reading, Sensor};

    use super::*;

    const SETTINGS: Settings = Settings::of_word(Word::Bits25);

    #[test]
    fn a_file_that_is_not_there_is_named_with_what_to_do() {
        let error = SpidevLine::open(Path::new("/dev/spidev99.99"), &SETTINGS).unwrap_err();
        let sentence = error.to_string();
        assert!(sentence.starts_with("cannot open /dev/spidev99.99: "), "{sentence}");
        assert!(sentence.contains("switch SPI on"), "{sentence}");
    }

    #[test]
    fn a_file_that_is_no_controller_is_refused() {
        let error = SpidevLine::open(Path::new("/dev/null"), &SETTINGS).unwrap_err();
        let sentence = error.to_string();
        assert!(sentence.starts_with("/dev/null cannot be an SSI line: "), "{sentence}");
        assert!(sentence.ends_with("mode 2 and 500000 Hz"), "{sentence}");
    }

    #[test]
    fn a_transfer_that_fails_is_a_fault_whose_cause_can_be_told() {
        let spidev = Spidev::new(File::open("/dev/null").unwrap());
        let line = SpidevLine { spidev, pause_micros: 20, error: None };
        let mut input = Input::new(line, SETTINGS).unwrap();
        let sample = input.sample(Instant::ZERO);
        assert_eq!(sample.reading, Reading::Failed(LineFault::NoTransfer));
        assert!(input.line_mut().take_error().is_some());
        assert!(input.line_mut().take_error().is_none());
    }

    #[test]
    fn the_pause_is_never_shorter_than_the_monoflop_time() {
        for (nanos, micros) in [(1, 1), (20_000, 20), (20_001, 21), (u64::MAX, u16::MAX)] {
            assert_eq!(whole_micros(Duration::from_nanos(nanos)), micros);
        }
    }
}

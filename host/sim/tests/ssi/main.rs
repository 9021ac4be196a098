//! A virtual SSI encoder, its line and the input of a converter, situation by situation.

mod converter;
mod double_reading;
mod line_faults;
mod round_trips;
mod waveforms;
mod wrong_bit_counts;

use codewheel_encoder::ssi::{Code, Input, Line, LineFault, Settings, Word};
use codewheel_encoder::{Sample, Sensor};
use codewheel_sim::ssi::{Behaviour, Fault, VirtualEncoder, VirtualLine};
use codewheel_station::{Duration, Instant};

const WORDS: [Word; 4] = [Word::Bits13, Word::Bits18, Word::Bits25, Word::Bits29];

/// A disc that stands where the test puts it.
#[derive(Clone, Debug, Default)]
struct Disc(u32);

impl Sensor for Disc {
    fn sample(&mut self, _: Instant) -> Sample {
        Sample { code: self.0, ..Sample::default() }
    }

    fn changes_at(&self, _: Instant) -> Option<Instant> {
        None
    }
}

type DiscLine = VirtualLine<Disc>;

fn line(behaviour: Behaviour) -> DiscLine {
    VirtualLine::new(VirtualEncoder::new(Disc::default(), behaviour))
}

/// Reads the line with the disc at `code`, a millisecond after the reading before.
fn read(
    line: &mut DiscLine,
    settings: &Settings,
    now: &mut Instant,
    code: u32,
) -> Result<u32, LineFault> {
    *now += Duration::from_millis(1);
    line.encoder_mut().sensor_mut().0 = code;
    let sampled = line.transfer(*now, settings.clocks(), settings.clock_hz);
    settings.decode(sampled.expect("the clock is not 0 Hz"))
}

fn micros(micros: u64) -> Instant {
    Instant::ZERO + Duration::from_micros(micros)
}

fn millis(millis: u64) -> Instant {
    micros(millis * 1_000)
}

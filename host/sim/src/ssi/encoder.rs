//! The encoder at the far end of an SSI line.

use codewheel_encoder::Sensor;
use codewheel_encoder::ssi::{Code, DEFAULT_MONOFLOP, Word};
use codewheel_station::{Duration, Instant};

/// How an encoder behaves at its line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Behaviour {
    /// The bits of its word, 1 … 32; others are taken for the nearest of these.
    pub bits: u8,
    /// How the code is written in it.
    pub code: Code,
    /// How long after the last falling edge it latches anew and lets the line go high.
    pub monoflop: Duration,
    /// Whether the same word comes again, a low bit between, while the clock goes on within the
    /// monoflop time. Otherwise the line stays low.
    pub repeats: bool,
}

impl Behaviour {
    /// What a converter in its delivery state expects: such words in Gray code and a monoflop of
    /// 20 µs; the word is repeated.
    #[must_use]
    pub const fn of_word(word: Word) -> Self {
        Self { bits: word.bits(), code: Code::Gray, monoflop: DEFAULT_MONOFLOP, repeats: true }
    }
}

/// What can be wrong with an encoder or its wires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// No encoder: the line stays high.
    Unplugged,
    /// The data line is shorted: it stays low.
    Shorted,
    /// These bits of each word arrive inverted; its repetitions are sound.
    FlippedBits(u32),
    /// The word has so many bits in place of those of [`Behaviour`].
    WordLength(u8),
    /// The encoder is ready again right after the last bit: the line does not go low.
    NoMonoflop,
}

/// An encoder that answers clock edges.
///
/// Both lines rest high. The first falling edge latches the code of the sensor; each rising edge
/// shows one bit, the highest first; after the last bit the line is low. When no falling edge has
/// come for the monoflop time, the line goes high and the next one latches anew.
#[derive(Clone, Debug)]
pub struct VirtualEncoder<S> {
    sensor: S,
    behaviour: Behaviour,
    fault: Option<Fault>,
    /// The word being shown, from its latching until the monoflop time is over.
    latched: Option<Latched>,
    last_falling_edge: Instant,
}

#[derive(Clone, Copy, Debug)]
struct Latched {
    word: u32,
    rising_edges: u64,
}

impl<S: Sensor> VirtualEncoder<S> {
    /// A sound encoder whose code is the sensor's, its lowest bits where the word is shorter.
    #[must_use]
    pub const fn new(sensor: S, behaviour: Behaviour) -> Self {
        Self { sensor, behaviour, fault: None, latched: None, last_falling_edge: Instant::ZERO }
    }

    /// Lets something go wrong from now on, or be right again.
    pub const fn set_fault(&mut self, fault: Option<Fault>) {
        self.fault = fault;
    }

    /// What is wrong.
    #[must_use]
    pub const fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// How it behaves while nothing is wrong.
    #[must_use]
    pub const fn behaviour(&self) -> Behaviour {
        self.behaviour
    }

    /// The sensor.
    pub const fn sensor(&self) -> &S {
        &self.sensor
    }

    /// The sensor, to be changed or replaced.
    pub const fn sensor_mut(&mut self) -> &mut S {
        &mut self.sensor
    }

    /// The clock line has fallen at `at`. Time never goes back from edge to edge.
    pub fn clock_falls(&mut self, at: Instant) {
        if self.showing(at).is_none() {
            let code = self.sensor.sample(at).code;
            let word = self.word(code);
            self.latched = Some(Latched { word, rising_edges: 0 });
        }
        self.last_falling_edge = at;
    }

    /// The clock line has risen at `at`.
    pub fn clock_rises(&mut self, at: Instant) {
        let shown = self
            .showing(at)
            .map(|latched| Latched { rising_edges: latched.rising_edges + 1, ..latched });
        let over = |latched: &Latched| latched.rising_edges > u64::from(self.bits());
        let ready_again = self.fault == Some(Fault::NoMonoflop);
        self.latched = shown.filter(|latched| !(ready_again && over(latched)));
    }

    /// Whether the data line is high at `at`, not before the last edge.
    #[must_use]
    pub fn data_is_high(&self, at: Instant) -> bool {
        match self.fault {
            Some(Fault::Unplugged) => true,
            Some(Fault::Shorted) => false,
            _ => self.showing(at).is_none_or(|latched| self.bit(latched)),
        }
    }

    /// The word being shown at `at`, unless the monoflop time is over.
    fn showing(&self, at: Instant) -> Option<Latched> {
        let running = at.since(self.last_falling_edge) < self.behaviour.monoflop;
        self.latched.filter(|_| running)
    }

    /// What the line shows of `latched`.
    fn bit(&self, latched: Latched) -> bool {
        let bits = u64::from(self.bits());
        let Some(place) = latched.rising_edges.checked_sub(1) else {
            return true; // It still rests.
        };
        let (round, place) = (place / (bits + 1), place % (bits + 1));
        if place == bits || (round > 0 && !self.behaviour.repeats) {
            return false;
        }
        let word = match self.fault {
            Some(Fault::FlippedBits(flipped)) if round == 0 => latched.word ^ flipped,
            _ => latched.word,
        };
        word >> (bits - 1 - place) & 1 == 1
    }

    fn bits(&self) -> u8 {
        let bits = match self.fault {
            Some(Fault::WordLength(bits)) => bits,
            _ => self.behaviour.bits,
        };
        bits.clamp(1, 32)
    }

    /// The word for `code`. Its length is that of the moment of latching.
    fn word(&self, code: u32) -> u32 {
        let code = code & (u32::MAX >> (32 - self.bits()));
        match self.behaviour.code {
            Code::Binary => code,
            Code::Gray => code ^ (code >> 1),
        }
    }
}

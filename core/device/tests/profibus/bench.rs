//! One encoder on a line of its own, with a master that the test speaks for octet by octet, a shaft
//! and a memory that it holds in its hand.

use codewheel_device::profibus::{Factory, Switches};
use codewheel_device::{Event, Lamp, Product, ProfibusEncoder, ProfibusState, Snapshot};
use codewheel_encoder::{RECORD_OCTETS, Reading, Sample, Sensor, Slot, Start, choose, encode};
use codewheel_profibus::{Baud, Timing};
use codewheel_sim::memory::TornMemory;
use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Instant, Station};

/// A shaft that the test turns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hand {
    pub(crate) code: u32,
    pub(crate) cell_low: bool,
    pub(crate) reading: Reading,
    /// Whether it is to be looked at every millisecond.
    pub(crate) turning: bool,
}

impl Sensor for Hand {
    fn sample(&mut self, _: Instant) -> Sample {
        Sample { code: self.code, cell_low: self.cell_low, reading: self.reading }
    }
    fn changes_at(&self, now: Instant) -> Option<Instant> {
        self.turning.then_some(now)
    }
}

pub(crate) const MASTER: u8 = 2;
pub(crate) const SLAVE: u8 = 7;
const RATE: BaudRate = BaudRate::Mbit1_5;
/// Longer than the slot time at this rate.
const PATIENCE: Duration = RATE.bits(1_000);

/// The octets of Set_Prm with everything at its default, as far as octet 9: lock, Sync and Freeze
/// allowed, watchdog 1 × 200 × 10 ms.
pub(crate) const STANDARD: &str = "B8 01 C8 0B 05 9B 00 00";
/// Set_Prm for class 2 with the steps and the range of the 29-bit disc.
pub(crate) const FULL_RANGE: &str = "0A 00002000 20000000";
/// Set_Prm for class 2 with the manual's example: 3600 steps, 256 turns.
pub(crate) const EXAMPLE: &str = "0A 00000E10 000E1000";

pub(crate) struct Bench {
    pub(crate) device: ProfibusEncoder<Hand>,
    pub(crate) factory: Factory,
    pub(crate) memory: TornMemory,
    pub(crate) now: Instant,
    /// Whether the memory takes records at once.
    pub(crate) serves_memory: bool,
    /// The FCB of the master's next request.
    frame_count: bool,
}

pub(crate) fn start(memory: &TornMemory) -> Start {
    choose(memory.read(Slot::A), memory.read(Slot::B))
}

impl Bench {
    pub(crate) fn power_up(model: &str) -> Self {
        Self::power_up_with(model, TornMemory::new(), Hand::default())
    }

    pub(crate) fn power_up_with(model: &str, memory: TornMemory, hand: Hand) -> Self {
        let product = Product::find(model).expect("a model of the catalogue");
        let factory = Factory {
            model: product.encoder,
            serial: 1234,
            baud: Baud::Fixed(RATE),
            timing: Timing::Exact,
        };
        Self::power_up_as(product, factory, memory, hand)
    }

    pub(crate) fn power_up_as(
        product: &'static Product,
        factory: Factory,
        memory: TornMemory,
        hand: Hand,
    ) -> Self {
        let now = Instant::ZERO;
        let switches = Switches::set_to(SLAVE);
        let device =
            ProfibusEncoder::power_up(now, product, factory, switches, &start(&memory), hand);
        Self { device, factory, memory, now, serves_memory: true, frame_count: true }
    }

    /// Takes the power away and gives it back with the shaft at `code`: what the memory holds is all
    /// that is left.
    pub(crate) fn power_cycled(mut self, code: u32) -> Self {
        let hand = Hand { code, ..self.device.sensor_mut().clone() };
        Self::power_up_as(self.device.product(), self.factory, self.memory, hand)
    }

    /// Exchanges data in class 2 and F1h with these octets from 9 on.
    #[track_caller]
    pub(crate) fn running(mut self, octets: &str) -> Self {
        self.brings_up(octets, 0xF1);
        self
    }

    #[track_caller]
    pub(crate) fn brings_up(&mut self, octets: &str, identifier: u8) {
        self.parameterizes(octets);
        self.configures(identifier);
        let diagnosis = self.diagnosis();
        assert_eq!(diagnosis[0] & !0x08, 0, "not ready: {}", hex(&diagnosis));
    }

    #[track_caller]
    pub(crate) fn parameterizes(&mut self, octets: &str) {
        let answer = self.asks(0x3D, &octets_of(&[STANDARD, octets].concat()));
        assert_eq!(answer.as_deref(), Some("E5"));
    }

    #[track_caller]
    pub(crate) fn configures(&mut self, identifier: u8) {
        assert_eq!(self.asks(0x3E, &[identifier]).as_deref(), Some("E5"));
    }

    /// The octets of Slave_Diag.
    #[track_caller]
    pub(crate) fn diagnosis(&mut self) -> Vec<u8> {
        let answer = octets_of(&self.asks(0x3C, &[]).expect("Slave_Diag is always answered"));
        let head = [0x68, SLAVE, MASTER];
        assert_eq!([answer[0], answer[5] & 0x7F, answer[4] & 0x7F], head);
        answer[9..answer.len() - 2].to_vec()
    }

    /// The first six octets of Slave_Diag, in hex.
    #[track_caller]
    pub(crate) fn status(&mut self) -> String {
        hex(&self.diagnosis()[..6])
    }

    /// A request with this DSAP, as master 2 sends it; what comes back, in hex.
    pub(crate) fn asks(&mut self, service: u8, data: &[u8]) -> Option<String> {
        let frame_count = self.next_frame_count();
        let body = [&[SLAVE | 0x80, MASTER | 0x80, 0x5C | frame_count, service, 0x3E], data];
        self.hears(&variable(&body.concat()))
    }

    /// Data_Exchange with these outputs; the response function and the inputs, in hex.
    #[track_caller]
    pub(crate) fn exchanges(&mut self, outputs: &str) -> (u8, String) {
        let frame_count = self.next_frame_count();
        let outputs = octets_of(outputs);
        let head = [SLAVE, MASTER, 0x5D | frame_count];
        let request = if outputs.is_empty() {
            fixed(head)
        } else {
            variable(&[&head[..], &outputs].concat())
        };
        let answer = octets_of(&self.hears(&request).expect("data is exchanged"));
        assert_eq!(answer[4..6], [MASTER, SLAVE], "{}", hex(&answer));
        (answer[6], hex(&answer[7..answer.len() - 2]))
    }

    /// The position that a Data_Exchange with these outputs brings.
    #[track_caller]
    pub(crate) fn position(&mut self, outputs: &str) -> u32 {
        let (_, inputs) = self.exchanges(outputs);
        u32::from_str_radix(&inputs, 16).expect("a position")
    }

    /// Global_Control to all slaves of all groups.
    pub(crate) fn controls(&mut self, command: u8) {
        let body = [0xFF, MASTER | 0x80, 0x46, 0x3A, 0x3E, command, 0];
        assert_eq!(self.hears(&variable(&body)), None);
    }

    fn next_frame_count(&mut self) -> u8 {
        self.frame_count = !self.frame_count;
        if self.frame_count { 0x20 } else { 0 }
    }

    /// Octets arrive after a pause; what comes back within the slot time, in hex.
    pub(crate) fn hears(&mut self, octets: &[u8]) -> Option<String> {
        self.wait(RATE.bits(50) + RATE.characters(octets.len() as u32));
        self.hears_now(octets)
    }

    /// The same, for octets whose end is now: the device had no time for anything before them.
    pub(crate) fn hears_now(&mut self, octets: &[u8]) -> Option<String> {
        self.device.handle(self.now, Input::Octets(octets));
        let end = self.now + PATIENCE;
        loop {
            if self.serves_memory {
                self.serve_memory();
            }
            if let Some(answer) = self.device.transmit(self.now) {
                self.now += RATE.characters(answer.octets().len() as u32);
                return Some(hex(answer.octets()));
            }
            let deadline = self.device.deadline().filter(|deadline| *deadline <= end)?;
            self.now = self.now.max(deadline);
            self.device.advance(self.now);
        }
    }

    /// What comes back to a whole telegram in hex.
    #[track_caller]
    pub(crate) fn answers(&mut self, request: &str, expected: &str) {
        let answer = self.hears(&octets_of(request));
        assert_eq!(answer, Some(hex(&octets_of(expected))), "in answer to {request}");
    }

    pub(crate) fn wait(&mut self, span: Duration) {
        let end = self.now + span;
        while let Some(deadline) = self.device.deadline().filter(|deadline| *deadline <= end) {
            self.now = self.now.max(deadline);
            self.device.advance(self.now);
            if self.serves_memory {
                self.serve_memory();
            }
        }
        self.now = end;
        self.device.advance(self.now);
    }

    pub(crate) fn turn_to(&mut self, code: u32) {
        // A shaft needs its time for that.
        self.wait(Duration::from_millis(10));
        self.device.sensor_mut().code = code;
        self.device.advance(self.now);
    }

    /// Writes what is to be kept into memory, as a host does.
    pub(crate) fn serve_memory(&mut self) {
        while let Some(kept) = self.device.keep(self.now) {
            let (slot, sequence) = start(&self.memory).next();
            let octets: [u8; RECORD_OCTETS] = encode(&kept, sequence);
            self.memory.write(slot, &octets, None);
            self.device.kept(self.now, Ok::<(), ()>(()));
        }
    }

    pub(crate) fn snapshot(&self) -> Snapshot {
        self.device.snapshot(self.now)
    }

    pub(crate) fn state(&self) -> ProfibusState {
        *self.snapshot().profibus().expect("it speaks PROFIBUS")
    }

    pub(crate) fn lamp(&self) -> Lamp {
        self.snapshot().lamp
    }

    pub(crate) fn writes(&self) -> u32 {
        self.snapshot().writes
    }

    pub(crate) fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.device.take_event()).map(|(_, event)| event).collect()
    }

    /// The events as people read them.
    pub(crate) fn told(&mut self) -> Vec<String> {
        self.events().into_iter().map(|event| event.to_string()).collect()
    }
}

/// SD1, without data.
pub(crate) fn fixed(head: [u8; 3]) -> Vec<u8> {
    [&[0x10], &head[..], &[checksum(&head), 0x16]].concat()
}

/// SD2, with data of any length.
pub(crate) fn variable(body: &[u8]) -> Vec<u8> {
    let length = body.len() as u8;
    [&[0x68, length, length, 0x68], body, &[checksum(body), 0x16]].concat()
}

fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, octet| sum.wrapping_add(*octet))
}

pub(crate) fn octets_of(text: &str) -> Vec<u8> {
    let digits: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let pair = |at| u8::from_str_radix(&digits[at..at + 2], 16).expect("hexadecimal");
    (0..digits.len()).step_by(2).map(pair).collect()
}

pub(crate) fn hex(octets: &[u8]) -> String {
    octets.iter().map(|octet| format!("{octet:02X}")).collect()
}

//! One encoder on an ideal medium, with a shaft and a memory that the test holds in its hand.

use codewheel_device::{DeviceNetEncoder, Event, Factory, Product, Switches};
use codewheel_encoder::{RECORD_OCTETS, Sample, Sensor, Start, choose, encode};
use codewheel_sim::memory::TornMemory;
use codewheel_station::can::{BitRate, Frame, Input};
use codewheel_station::{Duration, Instant, Station};

/// A shaft that the test turns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hand {
    pub(crate) code: u32,
    pub(crate) cell_low: bool,
    /// Whether it is to be looked at every millisecond.
    pub(crate) turning: bool,
    pub(crate) looks: u64,
}

impl Sensor for Hand {
    fn sample(&mut self, _: Instant) -> Sample {
        self.looks += 1;
        Sample { code: self.code, cell_low: self.cell_low, ..Sample::default() }
    }
    fn changes_at(&self, now: Instant) -> Option<Instant> {
        self.turning.then_some(now)
    }
}

pub(crate) struct Bench {
    pub(crate) device: DeviceNetEncoder<Hand>,
    pub(crate) memory: TornMemory,
    pub(crate) now: Instant,
    /// Whether the memory takes records at once.
    pub(crate) serves_memory: bool,
    pub(crate) records: u32,
    /// What came on other identifiers while an explicit answer was waited for.
    pub(crate) productions: Vec<String>,
}

pub(crate) const SERIAL: u32 = 1234;

fn start(memory: &TornMemory) -> Start {
    use codewheel_encoder::Slot;
    choose(memory.read(Slot::A), memory.read(Slot::B))
}

impl Bench {
    pub(crate) fn power_up(model: &str) -> Self {
        Self::power_up_with(model, TornMemory::new(), Hand::default())
    }

    pub(crate) fn power_up_with(model: &str, memory: TornMemory, hand: Hand) -> Self {
        let product = Product::find(model).expect("a model of the catalogue");
        let device = DeviceNetEncoder::power_up(
            Instant::ZERO,
            product,
            Factory::with_serial(SERIAL),
            Switches::set_to(5, BitRate::Kbit500),
            &start(&memory),
            hand,
        );
        Self {
            device,
            memory,
            now: Instant::ZERO,
            serves_memory: true,
            records: 0,
            productions: Vec::new(),
        }
    }

    /// Takes the power away and gives it back: what the memory holds is all that is left.
    pub(crate) fn power_cycled(self) -> Self {
        let model = self.device.product().model;
        let mut device = self.device;
        let hand = device.sensor_mut().clone();
        Self::power_up_with(model, self.memory, hand).allocated()
    }

    /// On-line, allocated by master 10 with explicit and poll connection, polled with 100 ms.
    pub(crate) fn allocated(mut self) -> Self {
        self.collect();
        self.wait(Duration::from_secs(2));
        self.says("42E#0A4B0301030A", &["42B#0ACB00"]);
        self.asks("10 05 01 09 00 00", "90 0000");
        self.asks("10 05 02 09 00 00", "90 0000");
        self
    }

    pub(crate) fn turn_to(&mut self, code: u32) {
        self.device.sensor_mut().code = code;
        self.device.advance(self.now);
    }

    /// Writes what is to be kept into memory, as a host does.
    pub(crate) fn serve_memory(&mut self) {
        while let Some(kept) = self.device.keep(self.now) {
            self.records += 1;
            let (slot, sequence) = start(&self.memory).next();
            let octets: [u8; RECORD_OCTETS] = encode(&kept, sequence);
            self.memory.write(slot, &octets, None);
            self.device.kept(self.now, Ok::<(), ()>(()));
        }
    }

    pub(crate) fn collect(&mut self) -> Vec<String> {
        let mut sent = Vec::new();
        loop {
            if self.serves_memory {
                self.serve_memory();
            }
            let Some(frame) = self.device.transmit(self.now) else { break };
            sent.push(frame.to_string());
            self.device.handle(self.now, Input::Sent(&frame));
            assert!(sent.len() < 100, "the device does not stop sending: {sent:?}");
        }
        sent
    }

    #[track_caller]
    pub(crate) fn says(&mut self, candump: &str, expected: &[&str]) {
        let frame = codewheel_sim::can::parse_frame(candump).expect("candump notation");
        self.device.handle(self.now, Input::Frame(&frame));
        assert_eq!(self.collect(), expected, "in answer to {candump}");
    }

    /// The body of the response to an explicit request of master 10, or `None` for silence.
    pub(crate) fn ask(&mut self, request: &str) -> Option<String> {
        let octets = octets(request);
        let mut frames = Vec::new();
        if octets.len() <= 7 {
            frames.push([&[0x0A], &octets[..]].concat());
        } else {
            let last = octets.len().div_ceil(6) - 1;
            for (index, chunk) in octets.chunks(6).enumerate() {
                let kind = if index == 0 {
                    0
                } else if index == last {
                    0x80
                } else {
                    0x40
                };
                frames.push([&[0x8A, kind | index as u8], chunk].concat());
            }
        }
        let fragmented = frames.len() > 1;
        let mut incoming = Vec::new();
        for data in frames {
            self.device.handle(self.now, Input::Frame(&Frame::standard(0x42C, &data)));
            incoming = self.explicit_answers();
            if fragmented {
                incoming.remove(0);
            }
        }
        let mut answer = Vec::new();
        while !incoming.is_empty() {
            let frame = codewheel_sim::can::parse_frame(&incoming.remove(0)).expect("own frame");
            match *frame.data() {
                [0x0A, ref whole @ ..] => return Some(hex(whole)),
                [0x8A, octet, ref rest @ ..] => {
                    answer.extend_from_slice(rest);
                    let acknowledge = Frame::standard(0x42C, &[0x8A, 0xC0 | octet & 0x3F, 0]);
                    self.device.handle(self.now, Input::Frame(&acknowledge));
                    if octet >> 6 == 2 {
                        return Some(hex(&answer));
                    }
                    incoming = self.explicit_answers();
                }
                ref other => panic!("not an explicit message: {other:02X?}"),
            }
        }
        None
    }

    /// What the device says on its explicit connection; productions are laid aside.
    fn explicit_answers(&mut self) -> Vec<String> {
        let (explicit, others): (Vec<_>, Vec<_>) =
            self.collect().into_iter().partition(|frame| frame.starts_with("42B#"));
        self.productions.extend(others);
        explicit
    }

    /// Asks, and returns what was produced meanwhile.
    #[track_caller]
    pub(crate) fn produces_when_asked(&mut self, request: &str) -> Vec<String> {
        self.productions.clear();
        let answer = self.ask(request).expect("an answer");
        assert!(!answer.starts_with("94"), "{request} is refused with {answer}");
        std::mem::take(&mut self.productions)
    }

    /// A frame arrives; what the device has to say waits for the wire.
    pub(crate) fn hears(&mut self, candump: &str) {
        let frame = codewheel_sim::can::parse_frame(candump).expect("candump notation");
        self.device.handle(self.now, Input::Frame(&frame));
    }

    /// The shaft stands at `code` now; what the device produces of it.
    pub(crate) fn turned_to(&mut self, code: u32) -> Vec<String> {
        self.turn_to(code);
        self.collect()
    }

    #[track_caller]
    pub(crate) fn asks(&mut self, request: &str, expected: &str) {
        assert_eq!(self.ask(request), Some(hex(&octets(expected))), "in answer to {request}");
    }

    /// Reads a number of class 2Fh.
    #[track_caller]
    pub(crate) fn read(&mut self, attribute: u8) -> i64 {
        let answer = self.ask(&format!("0E 2F 01 {attribute:02X}")).expect("an answer");
        let octets = octets(&answer);
        assert_eq!(octets[0], 0x8E, "attribute {attribute}: {answer}");
        let bits =
            octets[1..].iter().rev().fold(0_u64, |bits, octet| bits << 8 | u64::from(*octet));
        if octets.len() == 5 { i64::from(bits as u32 as i32) } else { bits as i64 }
    }

    /// Writes a four-octet number of class 2Fh and returns the answer.
    pub(crate) fn write(&mut self, attribute: u8, value: u32) -> String {
        let request = format!("10 2F 01 {attribute:02X} {}", hex(&value.to_le_bytes()));
        self.ask(&request).expect("an answer")
    }

    pub(crate) fn wait(&mut self, span: Duration) -> Vec<String> {
        let end = self.now + span;
        let mut sent = Vec::new();
        while let Some(deadline) = self.device.deadline().filter(|deadline| *deadline <= end) {
            self.now = self.now.max(deadline);
            self.device.advance(self.now);
            sent.append(&mut self.collect());
        }
        self.now = end;
        self.device.advance(self.now);
        sent.append(&mut self.collect());
        sent
    }

    pub(crate) fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.device.take_event()).map(|(_, event)| event).collect()
    }
}

pub(crate) fn octets(text: &str) -> Vec<u8> {
    let digits: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let pair = |at| u8::from_str_radix(&digits[at..at + 2], 16).expect("hexadecimal");
    (0..digits.len()).step_by(2).map(pair).collect()
}

pub(crate) fn hex(octets: &[u8]) -> String {
    octets.iter().map(|octet| format!("{octet:02X}")).collect()
}

//! A slave that is no encoder: it answers FDL status and Slave_Diag, octet by octet from the book.

use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Instant, Station};

pub(crate) struct Stranger {
    pub(crate) address: u8,
    pub(crate) rate: BaudRate,
    /// Slave_Diag from octet 1 on.
    pub(crate) diagnosis: Vec<u8>,
    octets: Vec<u8>,
    heard_at: Instant,
    answer: Option<(Instant, Vec<u8>)>,
}

impl Stranger {
    pub(crate) fn new(address: u8, rate: BaudRate, diagnosis: &[u8]) -> Self {
        Self {
            address,
            rate,
            diagnosis: diagnosis.to_vec(),
            octets: Vec::new(),
            heard_at: Instant::ZERO,
            answer: None,
        }
    }

    fn answer_to(&self, request: &[u8]) -> Option<Vec<u8>> {
        match *request {
            [0x10, to, from, 0x49, _, 0x16] if to == self.address => {
                Some(vec![0x10, from, to, 0x00, from.wrapping_add(to), 0x16])
            }
            [0x68, 5, 5, 0x68, to, from, _, 0x3C, 0x3E, _, 0x16] if to & 0x7F == self.address => {
                let mut body = vec![from, to, 0x08, 0x3E, 0x3C];
                body.extend(&self.diagnosis);
                let length = u8::try_from(body.len()).expect("short");
                let sum = body.iter().fold(0, |sum: u8, octet| sum.wrapping_add(*octet));
                Some([&[0x68, length, length, 0x68][..], &body, &[sum, 0x16]].concat())
            }
            _ => None,
        }
    }
}

impl Station for Stranger {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        // A telegram follows an idle line.
        if now.since(self.heard_at) > self.rate.bits(20) {
            self.octets.clear();
        }
        self.heard_at = now;
        self.answer = None;
        if let Input::Octets(octets) = input {
            self.octets.extend_from_slice(octets);
        }
        if let Some(answer) = self.answer_to(&self.octets) {
            self.answer = Some((now + self.rate.bits(30), answer));
        }
    }

    fn advance(&mut self, _: Instant) {}

    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        let (_, answer) = self.answer.take_if(|(at, _)| *at <= now)?;
        Transmission::new(&answer)
    }

    fn deadline(&self) -> Option<Instant> {
        self.answer.as_ref().map(|(at, _)| *at)
    }
}

impl Node for Stranger {
    fn baud_rate(&self) -> BaudRate {
        self.rate
    }
}

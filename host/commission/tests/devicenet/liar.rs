//! A slave that answers whatever comes to its mind.

use std::collections::VecDeque;

use codewheel_commission::{Name, Reading, Session};
use codewheel_station::can::{Frame, Identifier, Input};
use codewheel_station::{Instant, Station};

use crate::wire_seat::{WireSeat, secs};

/// It takes every allocation and release, so that it is asked, and makes up all other answers.
#[derive(Clone, Debug)]
pub(crate) struct Liar {
    address: u16,
    random: u64,
    owed: VecDeque<Frame>,
}

impl Liar {
    pub(crate) fn new(address: u16, seed: u64) -> Self {
        Self { address, random: seed, owed: VecDeque::new() }
    }

    fn next(&mut self) -> u64 {
        self.random =
            self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963);
        self.random >> 33
    }

    fn answer(&mut self, header: u8, service: u8) {
        let mut octets = vec![header & 0x7F];
        match (service, self.next() % 8) {
            (0x4B, _) if header & 0x80 == 0 => octets.extend([0xCB, 0]),
            (0x4C, _) => octets.push(0xCC),
            (_, 0) => octets.extend([0x94, self.next() as u8, self.next() as u8]),
            (_, 1) => {
                // A fragment of anything.
                octets[0] |= 0x80;
                octets.push((self.next() % 3) as u8 | ((self.next() % 4) << 6) as u8);
                let length = self.next() % 6;
                octets.extend((0..length).map(|_| self.random as u8));
            }
            (_, 2) if self.next().is_multiple_of(4) => return,
            _ => {
                octets.push(service | 0x80);
                for _ in 0..self.next() % 7 {
                    octets.push([0, 1, 2, 0x0A, 0x7F, 0x80, 0xFF, 4][(self.next() % 8) as usize]);
                }
            }
        }
        self.owed.push_back(Frame::standard(0x403 | self.address << 3, &octets));
    }
}

impl Station for Liar {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _: Instant, input: Input<'_>) {
        let Input::Frame(frame) = input else { return };
        let own = 0x400 | self.address << 3;
        match (frame.identifier(), frame.data()) {
            (Identifier::Standard(bits), [header, service, ..])
                if bits == own | 4 || bits == own | 6 =>
            {
                self.answer(*header, *service);
            }
            (Identifier::Standard(bits), _) if bits == own | 5 => {
                let octets: Vec<u8> = (0..self.next() % 9).map(|_| self.random as u8).collect();
                self.owed.push_back(Frame::standard(0x3C0 | self.address, &octets));
            }
            _ => {}
        }
    }
    fn advance(&mut self, _: Instant) {}
    fn transmit(&mut self, _: Instant) -> Option<Frame> {
        self.owed.pop_front()
    }
    fn deadline(&self) -> Option<Instant> {
        None
    }
}

#[test]
fn whatever_a_device_answers_every_call_ends_and_none_panics() {
    let mut opened = 0;
    for seed in 0..60 {
        let mut seat = WireSeat::new();
        seat.liar(Liar::new(9, seed));
        let Ok(mut session) = seat.open(9) else { continue };
        opened += 1;
        let begun = session.now();
        let _ = session.values();
        for name in [
            Name::Parameter(1),
            Name::Key("serial-number".to_owned()),
            Name::Key("product-name".to_owned()),
            Name::Key("steps-per-turn".to_owned()),
            Name::Key("poll-assembly".to_owned()),
            Name::Path { class: 0x64, instance: 1, attribute: 1 },
        ] {
            let _ = session.value(&name);
            let _ = session.write(&name, &Reading::Number(1));
            let _ = session.write(&name, &Reading::Octets(vec![1, 2]));
        }
        let _ = (session.identify(), session.preset(3), session.save(), session.sample());
        let _ = session.release();
        assert!(session.now().since(begun) < secs(3_600), "seed {seed}");
    }
    assert!(opened > 20, "{opened} of 60 let themselves be opened");
}

//! A master and slaves of a few lines that keep the rules of the line.

use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Deadline, Duration, Instant, Station};

/// The address of the master.
pub const MASTER: u8 = 2;

/// A master that asks the slaves 3 … for their data, one after the other, and goes on when it has
/// heard nothing for so many bits, or nothing at all for its slot time.
#[derive(Clone, Debug)]
pub struct Master {
    rate: BaudRate,
    slaves: u8,
    quiet_bits: u32,
    slot_bits: u32,
    asked: u8,
    next: Instant,
    answers: u64,
}

/// A slave that answers each request with four octets.
#[derive(Clone, Debug)]
pub struct Slave {
    rate: BaudRate,
    address: u8,
    station_delay: Duration,
    telegram: [u8; 16],
    length: usize,
    /// Something was wrong, and 33 idle bits have not come yet.
    lost: bool,
    heard_until: Instant,
    answer: Deadline,
    position: u32,
}

/// One of the two.
#[derive(Clone, Debug)]
pub enum Toy {
    /// The master.
    Master(Master),
    /// A slave.
    Slave(Slave),
}

impl Toy {
    /// A master of so many slaves, at addresses from 3 on.
    pub fn master(rate: BaudRate, slaves: u8, quiet_bits: u32, slot_bits: u32) -> Self {
        let next = Instant::ZERO + rate.bits(100);
        Self::Master(Master { rate, slaves, quiet_bits, slot_bits, asked: 0, next, answers: 0 })
    }

    /// A slave with its delay between request and answer.
    pub fn slave(rate: BaudRate, address: u8, station_delay_bits: u32) -> Self {
        Self::Slave(Slave {
            rate,
            address,
            station_delay: rate.bits(station_delay_bits),
            telegram: [0; 16],
            length: 0,
            lost: true,
            heard_until: Instant::ZERO,
            answer: Deadline::NEVER,
            position: 0,
        })
    }

    /// How many whole answers the master has heard.
    pub fn answers(&self) -> u64 {
        match self {
            Self::Master(master) => master.answers,
            Self::Slave(_) => 0,
        }
    }
}

fn checked(octets: &[u8]) -> u8 {
    octets.iter().fold(0, |sum: u8, octet| sum.wrapping_add(*octet))
}

impl Master {
    fn request(&mut self, now: Instant) -> Transmission {
        let to = 3 + self.asked;
        self.asked = (self.asked + 1) % self.slaves;
        self.next = now + self.rate.bits(66 + self.slot_bits);
        let check = checked(&[to, MASTER, 0x6D]);
        Transmission::new(&[0x10, to, MASTER, 0x6D, check, 0x16]).unwrap()
    }
}

impl Slave {
    fn hear(&mut self, now: Instant, octets: &[u8]) {
        self.answer = Deadline::NEVER;
        let begin = now - self.rate.characters(octets.len() as u32);
        let pause = begin.since(self.heard_until);
        self.heard_until = now;
        if pause + Duration::from_nanos(1) >= self.rate.bits(33) {
            (self.lost, self.length) = (false, 0);
        } else if pause > Duration::from_nanos(2) {
            self.lost = true;
        }
        if self.lost || self.length + octets.len() > self.telegram.len() {
            return self.lost = true;
        }
        self.telegram[self.length..][..octets.len()].copy_from_slice(octets);
        self.length += octets.len();
        let &[0x10, to, MASTER, function, check, 0x16] = &self.telegram[..self.length] else {
            return;
        };
        if to == self.address && check == checked(&[to, MASTER, function]) {
            self.answer = Deadline::at(now + self.station_delay);
        }
    }

    fn data(&mut self) -> Transmission {
        self.position = self.position.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let [a, b, c, d] = self.position.to_be_bytes();
        let body = [MASTER, self.address, 0x08, a, b, c, d];
        let mut telegram = [0x68, 7, 7, 0x68, 0, 0, 0, 0, 0, 0, 0, checked(&body), 0x16];
        telegram[4..11].copy_from_slice(&body);
        Transmission::new(&telegram).unwrap()
    }
}

impl Station for Toy {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        match (self, input) {
            (Self::Master(master), input) => {
                if input == Input::Octets(&[0x16]) {
                    master.answers += 1;
                }
                master.next = now + master.rate.bits(master.quiet_bits);
            }
            (Self::Slave(slave), Input::Octets(octets)) => slave.hear(now, octets),
            (Self::Slave(slave), Input::BrokenCharacter) => {
                (slave.lost, slave.heard_until) = (true, now);
                slave.answer = Deadline::NEVER;
            }
        }
    }

    fn advance(&mut self, _now: Instant) {}

    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        match self {
            Self::Master(master) => (master.next <= now).then(|| master.request(now)),
            Self::Slave(slave) => slave.answer.take_due(now).then(|| slave.data()),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        match self {
            Self::Master(master) => Some(master.next),
            Self::Slave(slave) => slave.answer.instant(),
        }
    }
}

impl Node for Toy {
    fn baud_rate(&self) -> BaudRate {
        match self {
            Self::Master(master) => master.rate,
            Self::Slave(slave) => slave.rate,
        }
    }
}

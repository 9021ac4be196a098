//! A line in bit times: octets one by one to everybody else, and a police that knows pauses.

use codewheel_commission::profibus::{Event, Master, MasterSettings, SlaveSettings};
use codewheel_station::rs485::{BaudRate, Input, Node};
use codewheel_station::{Duration, Instant};

use crate::scripted::Scripted;

/// A telegram that was sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Sent {
    pub(crate) at: Instant,
    /// Its place: masters first, then slaves.
    pub(crate) who: usize,
    pub(crate) octets: Vec<u8>,
}

impl Sent {
    /// As the books print it.
    pub(crate) fn hex(&self) -> String {
        hex(&self.octets)
    }
}

pub(crate) fn hex(octets: &[u8]) -> String {
    octets.iter().map(|octet| format!("{octet:02X}")).collect::<Vec<_>>().join(" ")
}

/// Octets from how the books print them.
pub(crate) fn octets(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|octet| u8::from_str_radix(octet, 16).unwrap()).collect()
}

/// Masters and scripted slaves on one line.
pub(crate) struct Bench<M = Master> {
    pub(crate) now: Instant,
    pub(crate) rate: BaudRate,
    pub(crate) masters: Vec<M>,
    pub(crate) slaves: Vec<Scripted>,
    pub(crate) log: Vec<Sent>,
    /// Asks the masters in steps of this in place of their deadlines.
    pub(crate) step: Option<Duration>,
    /// Idle bits that masters must leave.
    pub(crate) idle_bits: u32,
    /// Hands masters the first octet of a telegram alone and the others with its last.
    pub(crate) in_portions: bool,
    /// Whether stations must leave pauses and take turns; otherwise one that speaks out of turn is
    /// not heard.
    pub(crate) is_policed: bool,
    /// Times that masters were asked at their deadlines.
    pub(crate) asked: u64,
    sending: Option<(usize, usize)>,
    idle_since: Instant,
    next_step: Instant,
}

impl Bench<Master> {
    /// Master 2 with its slaves, all at `rate`.
    pub(crate) fn new(rate: BaudRate, slaves: Vec<Scripted>) -> Self {
        let settings = MasterSettings::new(2, rate);
        Self::with(settings, slaves)
    }

    pub(crate) fn with(settings: MasterSettings, slaves: Vec<Scripted>) -> Self {
        let told = slaves.iter().map(|slave| slave_settings(slave.address)).collect();
        let rate = settings.baud_rate;
        Self::of(rate, vec![Master::new(settings, told).unwrap()], slaves)
    }

    pub(crate) fn master(&mut self) -> &mut Master {
        &mut self.masters[0]
    }

    pub(crate) fn events(&mut self) -> Vec<Event> {
        std::iter::from_fn(|| self.masters[0].take_event()).collect()
    }

    /// Runs until all slaves exchange data.
    pub(crate) fn bring_up(&mut self) {
        use codewheel_commission::profibus::SlaveState::DataExchange;
        for _ in 0..10_000 {
            if self.masters[0].slaves().all(|slave| slave.state == DataExchange) {
                return;
            }
            self.run_bits(1_000);
        }
        panic!("not all slaves exchange data: {:#?}", self.masters[0]);
    }
}

impl<M: Node> Bench<M> {
    pub(crate) fn of(rate: BaudRate, masters: Vec<M>, slaves: Vec<Scripted>) -> Self {
        Self {
            now: Instant::ZERO,
            rate,
            masters,
            slaves,
            log: Vec::new(),
            step: None,
            idle_bits: 33,
            in_portions: false,
            is_policed: true,
            asked: 0,
            sending: None,
            idle_since: Instant::ZERO,
            next_step: Instant::ZERO,
        }
    }

    pub(crate) fn run_bits(&mut self, bits: u32) {
        self.run(self.rate.bits(bits));
    }

    pub(crate) fn run(&mut self, span: Duration) {
        let until = self.now + span;
        let mut stuck = 0;
        while let Some(next) = self.next().filter(|next| *next <= until) {
            stuck = if next == self.now { stuck + 1 } else { 0 };
            assert!(stuck < 1_000, "time stands still at {}", self.now);
            self.now = next;
            self.carry();
            self.ask();
        }
        self.now = until;
    }

    fn next(&self) -> Option<Instant> {
        let octet = self.sending.map(|(sent, place)| self.end_of(sent, place));
        let masters = match self.step {
            Some(_) => Some(self.next_step),
            None => self.masters.iter().filter_map(|master| master.deadline()).min(),
        };
        let slaves = self.slaves.iter().filter_map(|slave| slave.due).min();
        [octet, masters, slaves].into_iter().flatten().min().map(|next| next.max(self.now))
    }

    fn end_of(&self, sent: usize, place: usize) -> Instant {
        self.log[sent].at + self.rate.characters(u32::try_from(place + 1).unwrap())
    }

    /// Brings the octet that ends now to everybody else.
    fn carry(&mut self) {
        let Some((sent, place)) = self.sending.filter(|(s, p)| self.end_of(*s, *p) <= self.now)
        else {
            return;
        };
        let Sent { who, octets, .. } = &self.log[sent];
        let (who, octet, length) = (*who, [octets[place]], octets.len());
        let portion = match place {
            _ if !self.in_portions || place == 0 => &octet[..],
            _ if place + 1 == length => &octets[1..],
            _ => &[],
        };
        self.sending = (place + 1 < length).then_some((sent, place + 1));
        self.idle_since = self.now;
        for (other, master) in self.masters.iter_mut().enumerate() {
            if other != who && !portion.is_empty() {
                master.handle(self.now, Input::Octets(portion));
            }
        }
        for (other, slave) in self.slaves.iter_mut().enumerate() {
            if other + self.masters.len() != who {
                slave.hear(self.now, self.rate, octet[0]);
            }
        }
    }

    /// Asks those who may want to speak.
    fn ask(&mut self) {
        let stepped = self.step.is_some_and(|_| self.next_step <= self.now);
        if let Some(step) = self.step.filter(|_| stepped) {
            self.next_step = self.now + step;
        }
        for place in 0..self.masters.len() {
            let master = &mut self.masters[place];
            let due = master.deadline().is_some_and(|deadline| deadline <= self.now);
            if stepped || (self.step.is_none() && due) {
                self.asked += 1;
                master.advance(self.now);
                while let Some(telegram) = self.masters[place].transmit(self.now) {
                    self.send(place, telegram.octets().to_vec(), self.idle_bits);
                }
            }
        }
        for place in 0..self.slaves.len() {
            if let Some(answer) = self.slaves[place].speak(self.now) {
                self.send(self.masters.len() + place, answer, 11);
            }
        }
    }

    fn send(&mut self, who: usize, octets: Vec<u8>, idle_bits: u32) {
        if !self.is_policed && self.sending.is_some() {
            return;
        }
        let text = hex(&octets);
        assert!(self.sending.is_none(), "{who} speaks while another does: {text}");
        let idle = self.now.since(self.idle_since);
        assert!(
            self.log.is_empty() || !self.is_policed || idle >= self.rate.bits(idle_bits),
            "{who} left only {idle} s before {text}"
        );
        self.log.push(Sent { at: self.now, who, octets });
        self.sending = Some((self.log.len() - 1, 0));
    }

    /// Everything to and from a slave, as the books print it; tokens and searches left out.
    pub(crate) fn conversation(&self, address: u8) -> Vec<String> {
        let mut answers = false;
        let mut lines = Vec::new();
        for sent in &self.log {
            let head = if sent.octets[0] == 0x68 { 4 } else { 1 };
            let asked = sent.octets.len() > 3
                && sent.octets[head] & 0x7F == address
                && sent.octets[head + 2] != 0x49;
            if sent.who < self.masters.len() {
                answers = asked;
            }
            if answers {
                let who = if sent.who < self.masters.len() { "M" } else { "S" };
                lines.push(format!("{who} {}", sent.hex()));
            }
        }
        lines
    }
}

/// The encoder of the printed conversation: 29 bit, F1h.
pub(crate) fn slave_settings(address: u8) -> SlaveSettings {
    SlaveSettings {
        address,
        ident_number: 0x059B,
        user_parameters: octets("00 0A 00 00 20 00 20 00 00 00"),
        configuration: vec![0xF1],
        inputs: 4,
        outputs: 4,
        groups: 0,
        sync: true,
        freeze: true,
    }
}

//! Anything that a line can bring to a master with three slaves, as octets; and in the end three
//! slaves as they should be, with which it must get to the exchange of data.
//!
//! An input is a head and operations. The head is an octet: bits 3–0 the rate (modulo ten), bit 4 the
//! slaves answer by themselves from the beginning. Slaves 7 to 9 are asked; whoever was asked last
//! answers. Then, until the end:
//!
//! | octet | then | what happens |
//! |---|---|---|
//! | 00–3F | bits 4–0 octets | it answers with data, after 11 bits; bit 5 with high priority |
//! | 40–5F | bits 4–0 octets | the same, to another master |
//! | 60 | | it answers SC |
//! | 61 | FC | it answers without data |
//! | 62 | | it answers as it should |
//! | 63 | slave u8 | one of them (modulo three) restarts and has no parameters any more |
//! | 64 | | the slaves answer by themselves from now on, or no longer |
//! | 80 | length u8, octets | any octets arrive after 33 idle bits |
//! | 81 | length u8, octets | any octets arrive without a pause |
//! | 82 | ms u16 | time passes, from deadline to deadline |
//! | 83 | bits u16 | the same |
//! | 84 | ms u16 | time passes, and nobody looks at deadlines |
//! | 85 | | a character with an error arrives |
//! | 86 | slave u8, value u8 | outputs are set |
//! | 87 | slave u8 | a diagnosis is asked for |
//! | 88 | DA, SA | a token comes by |
//! | 89 | DA, SA, FC | a telegram without data comes by |
//! | 8A | address u8, what u8 | a station is asked outside of the cycle, for one of four (modulo) |
//! | 8B | slave u8 | one of them (modulo three) is begun anew |
//!
//! Every other octet does nothing. An operation that the input ends in takes zeros.

use codewheel_commission::profibus::{Acyclic, Master, MasterSettings, SlaveSettings, SlaveState};
use codewheel_profibus::function_code::FunctionCode;
use codewheel_profibus::telegram::{Data, Head, SC, Saps, Telegram};
use codewheel_station::rs485::{BaudRate, Input, Transmission};
use codewheel_station::{Duration, Instant, Reader, Station};

/// Its address.
const MASTER: u8 = 2;
const SLAVES: [u8; 3] = [7, 8, 9];
/// Telegrams that may leave in one operation of time; then nobody looks at deadlines.
const STEPS: usize = 400;
/// Bits of silence that a master leaves before it speaks.
const SYNCHRONIZATION_BITS: u32 = 33;
const IDENT_NUMBER: u16 = 0x059B;

/// A slave that knows how far it is, and nothing else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stands {
    Free,
    Parameterized,
    Running,
}

struct Bench {
    master: Master,
    rate: BaudRate,
    now: Instant,
    /// When the line fell silent.
    idle_since: Instant,
    stands: [Stands; 3],
    /// The telegram sent last, until somebody else speaks.
    asked: Option<Transmission>,
    answer_by_themselves: bool,
}

/// Does what `octets` say and fails where the master does what it must not.
pub(crate) fn body(octets: &[u8]) {
    let mut reader = Reader::new(octets);
    let head = reader.u8().unwrap_or_default();
    let mut bench =
        Bench::new(BaudRate::ALL[usize::from(head & 0xF) % BaudRate::ALL.len()], head & 0x10 != 0);
    while let Ok(operation) = reader.u8() {
        bench.operate(operation, &mut reader);
        bench.judge();
    }
    bench.recover();
}

fn slave_settings(address: u8) -> SlaveSettings {
    SlaveSettings {
        address,
        ident_number: IDENT_NUMBER,
        user_parameters: vec![0, 0x0A, 0, 0, 0x20, 0, 0x20, 0, 0, 0],
        configuration: vec![0xF1],
        inputs: 4,
        outputs: 4,
        groups: 0,
        sync: true,
        freeze: true,
    }
}

impl Bench {
    fn new(rate: BaudRate, answer_by_themselves: bool) -> Self {
        let slaves = SLAVES.map(slave_settings).to_vec();
        let master = Master::new(MasterSettings::new(MASTER, rate), slaves);
        Self {
            master: master.expect("settings that are possible"),
            rate,
            now: Instant::ZERO,
            idle_since: Instant::ZERO,
            stands: [Stands::Free; 3],
            asked: None,
            answer_by_themselves,
        }
    }

    fn operate(&mut self, operation: u8, reader: &mut Reader<'_>) {
        let number = |reader: &mut Reader<'_>| reader.u16_le().unwrap_or_default();
        match operation {
            0x00..=0x5F => {
                let data = take(reader, operation & 0x1F);
                let code = if operation & 0x20 == 0 { 0x08 } else { 0x0A };
                let to_another = operation & 0x40 != 0;
                if let Some((slave, saps, _)) = self.asked_for() {
                    let destination = if to_another { MASTER + 1 } else { MASTER };
                    self.answer(&telegram(destination, slave, code, saps, data));
                }
            }
            0x60 => self.answer(&[SC]),
            0x61 => {
                let code = reader.u8().unwrap_or_default();
                if let Some((slave, ..)) = self.asked_for() {
                    self.answer(&telegram(MASTER, slave, code, None, &[]));
                }
            }
            0x62 => self.answer_as_it_should(),
            0x63 => self.stands[usize::from(reader.u8().unwrap_or_default() % 3)] = Stands::Free,
            0x64 => self.answer_by_themselves = !self.answer_by_themselves,
            0x80 | 0x81 => {
                let idle = if operation == 0x80 { SYNCHRONIZATION_BITS } else { 0 };
                let length = reader.u8().unwrap_or_default();
                self.hear(idle, take(reader, length));
            }
            0x82 => self.run(Duration::from_millis(number(reader).into())),
            0x83 => self.run(self.rate.bits(number(reader).into())),
            0x84 => self.now += Duration::from_millis(number(reader).into()),
            0x85 => {
                self.idle_since = self.now;
                self.master.handle(self.now, Input::BrokenCharacter);
            }
            0x86 => {
                let [slave, value] = reader.array().unwrap_or_default();
                let known = SLAVES.contains(&slave);
                assert_eq!(self.master.set_outputs(slave, &[value; 4]).is_ok(), known);
            }
            0x87 => {
                let slave = reader.u8().unwrap_or_default();
                let known = SLAVES.contains(&slave);
                assert_eq!(self.master.request_diagnosis(slave).is_ok(), known);
            }
            0x88 => {
                let [destination, source] = reader.array().unwrap_or_default();
                self.hear(SYNCHRONIZATION_BITS, &[0xDC, destination, source]);
            }
            0x89 => {
                let [to, from, code] = reader.array().unwrap_or_default();
                self.hear(SYNCHRONIZATION_BITS, &telegram(to, from, code, None, &[]));
            }
            0x8A => {
                let [address, what] = reader.array().unwrap_or_default();
                let all = [
                    Acyclic::FdlStatus,
                    Acyclic::Diagnosis,
                    Acyclic::Configuration,
                    Acyclic::Unlock,
                ];
                let asked = self.master.ask(address, all[usize::from(what % 4)]);
                assert_eq!(asked.is_ok(), address <= 125 && address != MASTER);
            }
            0x8B => {
                let slave = SLAVES[usize::from(reader.u8().unwrap_or_default() % 3)];
                self.master.serve(slave_settings(slave)).expect("settings that are possible");
            }
            _ => {}
        }
    }

    /// Octets that end after so many idle bits and the time they take.
    fn hear(&mut self, idle_bits: u32, octets: &[u8]) {
        self.run(self.rate.bits(idle_bits));
        // Whoever speaks, the master does not look before the end.
        self.now += self.rate.characters(octets.len() as u32);
        if !octets.is_empty() {
            self.idle_since = self.now;
        }
        self.asked = None;
        self.master.handle(self.now, Input::Octets(octets));
    }

    /// Goes from deadline to deadline.
    fn run(&mut self, span: Duration) {
        let end = self.now + span;
        for _ in 0..STEPS {
            let next = self.master.deadline().expect("a master is never done");
            if next > end {
                break;
            }
            let before = self.now;
            self.now = self.now.max(next);
            self.master.advance(self.now);
            let spoke = self.speak();
            let later = self.master.deadline().expect("a master is never done");
            assert!(spoke || later > self.now, "{later} after {before} and {}", self.now);
        }
        self.now = self.now.max(end);
    }

    /// Asks the master for a telegram, and says whether there was one.
    fn speak(&mut self) -> bool {
        let Some(sent) = self.master.transmit(self.now) else { return false };
        let whole = Telegram::decode(sent.octets()).expect("it is sound").expect("it is whole");
        assert_eq!(whole.length(), sent.octets().len(), "{sent:?}");
        match whole {
            Telegram::Token { source, .. } => assert_eq!(source, MASTER, "{sent:?}"),
            Telegram::Data(data) => {
                assert_eq!(data.source(), MASTER, "{sent:?}");
            }
            Telegram::ShortAcknowledge => panic!("a master does not acknowledge"),
        }
        let idle = self.now.since(self.idle_since);
        assert!(idle >= self.rate.bits(SYNCHRONIZATION_BITS), "{sent:?} after {idle} s");
        self.now += self.rate.characters(sent.octets().len() as u32);
        self.idle_since = self.now;
        self.asked = Some(sent);
        assert_eq!(self.master.transmit(self.now), None, "33 bits are idle between telegrams");
        if self.answer_by_themselves {
            self.answer_as_it_should();
        }
        true
    }

    /// The slave that was asked, with the access points of its answer and what it was sent.
    fn asked_for(&self) -> Option<(u8, Option<Saps>, Data<'_>)> {
        let asked = self.asked.as_ref()?;
        let Ok(Some(Telegram::Data(data))) = Telegram::decode(asked.octets()) else { return None };
        let slave = data.destination();
        let saps = data.saps().ok()?.map(Saps::swapped);
        SLAVES.contains(&slave).then_some((slave, saps, data))
    }

    fn answer(&mut self, octets: &[u8]) {
        if self.asked.take().is_some() {
            self.now += self.rate.bits(11) + self.rate.characters(octets.len() as u32);
            self.idle_since = self.now;
            self.master.handle(self.now, Input::Octets(octets));
        }
    }

    fn answer_as_it_should(&mut self) {
        let Some((slave, saps, data)) = self.asked_for() else { return };
        let place = usize::from(slave - SLAVES[0]);
        let stands = self.stands[place];
        let sends = |code, data: &[u8]| telegram(MASTER, slave, code, saps, data);
        let service = saps.map(|saps| saps.source);
        let answer = match (service, data.function_code().0 & 0x0F) {
            (None, 9) => sends(0, &[]),
            (Some(60), _) => {
                let [high, low] = IDENT_NUMBER.to_be_bytes();
                match stands {
                    Stands::Free => sends(8, &[2, 5, 0, 0xFF, high, low]),
                    _ => sends(8, &[0, 0x0C, 0, MASTER, high, low]),
                }
            }
            (Some(61), _) => {
                let unlocks = data.data().first().is_some_and(|first| first & 0x40 != 0);
                self.stands[place] = if unlocks { Stands::Free } else { Stands::Parameterized };
                vec![SC]
            }
            (Some(62), _) if stands == Stands::Parameterized => {
                self.stands[place] = Stands::Running;
                vec![SC]
            }
            (None, _) if stands == Stands::Running => sends(8, &[0, 0, 0x12, slave]),
            _ => telegram(MASTER, slave, 3, None, &[]),
        };
        self.answer(&answer);
    }

    fn judge(&mut self) {
        assert!(self.master.deadline().is_some(), "a master is never done");
        while let Some(event) = self.master.take_event() {
            assert!(!event.to_string().is_empty());
        }
        while let Some(answered) = self.master.take_answer() {
            assert!(answered.address <= 125 && answered.address != MASTER, "{answered:?}");
        }
        for slave in self.master.slaves() {
            assert!(SLAVES.contains(&slave.address), "{slave:?}");
        }
    }

    /// Three slaves as they should be: within five seconds and a hundred thousand bits all of them
    /// exchange data.
    fn recover(&mut self) {
        self.answer_by_themselves = true;
        self.stands = [Stands::Free; 3];
        let end = self.now + Duration::from_secs(5) + self.rate.bits(100_000);
        while self.now < end {
            self.run(self.rate.bits(1_000));
            self.judge();
            if self.master.slaves().all(|slave| slave.state == SlaveState::DataExchange) {
                return;
            }
        }
        panic!("not all slaves exchange data: {:#?}", self.master);
    }
}

fn telegram(destination: u8, source: u8, code: u8, saps: Option<Saps>, data: &[u8]) -> Vec<u8> {
    let (destination, source) = (destination & 0x7F, source & 0x7F);
    let head = Head { destination, source, function_code: FunctionCode(code), saps };
    head.transmission(data).expect("it fits").octets().to_vec()
}

/// At most `length` octets.
fn take<'a>(reader: &mut Reader<'a>, length: u8) -> &'a [u8] {
    let length = usize::from(length);
    (0..=length).rev().find_map(|length| reader.octets(length).ok()).unwrap_or_default()
}

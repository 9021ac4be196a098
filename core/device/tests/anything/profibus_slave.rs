//! Anything that can happen to an encoder on PROFIBUS, as octets; and in the end a proper master,
//! who must get to the exchange of data.
//!
//! An input is a head and operations. The head: the product (an octet, modulo the catalogue; bit 7: a
//! record follows, [`any_record`]), then an octet: bits 3–0 the rate (modulo ten), 4 it is searched,
//! 5 the link knows no bit times, 6 the word of a converter has 25 bits, where it can. Then, until
//! the end:
//!
//! | octet | then | what happens |
//! |---|---|---|
//! | 00–7F | bits 6–3, at most 15, octets | a request of the first master: bits 2–0 say which |
//! | 80 | length u8, octets | any octets arrive after 50 idle bits |
//! | 81 | length u8, octets | any octets arrive without a pause |
//! | 82 | ms u16 | time passes, from deadline to deadline |
//! | 83 | µs u16 | the same |
//! | 84 | 10 ms u16 | time passes, and nobody looks at deadlines |
//! | 85 | | the memory has taken the record on its way |
//! | 86 | | the memory has refused it |
//! | 87 | octets u8 | the power fails, after so many octets of the record on its way, and comes back |
//! | 88 | | a character with an error arrives |
//! | 89 | | the request sent last comes again |
//! | 8A | code u32, flags | the shaft: bit 0 the cell is low, bit 1 it turns, 2 the reading failed, 3 it is repeated |
//! | 8B | | the device hears what it said last |
//! | 8C | switches u8 | the address switches are turned |
//! | 8D | DA, SA, FC, length u8, octets | a telegram of anyone to anyone |
//! | 8E | identifier u8 | the first master brings the device up with 3600 steps |
//! | 8F | | the medium takes no answers from now on, or again some |
//!
//! The requests: 0 Data_Exchange, 1 Slave_Diag, 2 Get_Cfg, 3 Set_Prm (with twice as many octets and
//! one), 4 Chk_Cfg, 5 RD_Inp, 6 RD_Outp, 7 Global_Control to all. Every other octet does nothing. An
//! operation that the input ends in takes zeros.

use codewheel_device::ProfibusEncoder;
use codewheel_device::product::PROFIBUS;
use codewheel_device::profibus::{Factory, Switches};
use codewheel_encoder::ssi::LineFault;
use codewheel_encoder::{
    Geometry, Kept, Model, Reading, Sample, Sensor, Slot, Start, choose, encode,
};
use codewheel_profibus::function_code::{FunctionCode, Reply};
use codewheel_profibus::telegram::{Data, Head, Saps, Telegram};
use codewheel_profibus::{Baud, State, Timing};
use codewheel_sim::memory::TornMemory;
use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Duration, Instant, Reader, Station};

use crate::any_record::any_record;

/// Deadlines served in one operation; then time passes late.
const STEPS: usize = 200;
/// The most that an answer waits: min T_SDR 255.
const LATEST: u32 = 255;
/// Lock, Sync and Freeze allowed, watchdog 2 s, class 2 with scaling, 3600 steps; the range follows.
const PARAMETERS: [u8; 13] = [0xB8, 1, 200, 11, 0x05, 0x9B, 0, 0, 0x0A, 0, 0, 0x0E, 0x10];

#[derive(Clone, Debug, Default)]
struct Hand {
    code: u32,
    cell_low: bool,
    turns: bool,
    reading: Reading,
}

impl Sensor for Hand {
    fn sample(&mut self, _: Instant) -> Sample {
        Sample { code: self.code, cell_low: self.cell_low, reading: self.reading }
    }
    fn changes_at(&self, now: Instant) -> Option<Instant> {
        self.turns.then_some(now)
    }
}

struct Bench {
    device: ProfibusEncoder<Hand>,
    factory: Factory,
    now: Instant,
    memory: TornMemory,
    /// The record on its way into memory.
    writing: Option<Kept>,
    /// The FCB of the first master's last request.
    frame_count: bool,
    /// The request sent last.
    request: Vec<u8>,
    /// The retries when the last answer went out.
    retries: u32,
    /// The last answer that went out.
    sent: Option<Transmission>,
    medium_takes: bool,
}

/// Does what `octets` say and fails where the device does what it must not.
pub(crate) fn body(octets: &[u8]) {
    let mut reader = Reader::new(octets);
    let mut bench = Bench::power_up(&mut reader);
    bench.serve();
    while let Ok(operation) = reader.u8() {
        bench.operate(operation, &mut reader);
        bench.serve();
        bench.judge();
    }
    bench.recover();
    bench.judge();
}

fn start(memory: &TornMemory) -> Start {
    choose(memory.read(Slot::A), memory.read(Slot::B))
}

impl Bench {
    fn power_up(reader: &mut Reader<'_>) -> Self {
        let head = reader.u8().unwrap_or_default();
        let link = reader.u8().unwrap_or_default();
        let product = &PROFIBUS[usize::from(head & 0x7F) % PROFIBUS.len()];
        let rate = BaudRate::ALL[usize::from(link & 0xF) % BaudRate::ALL.len()];
        let short_word = link & 0x40 != 0 && product.model == "heag162-p29";
        let geometry = if short_word { Geometry::MULTITURN_25 } else { product.encoder.geometry };
        let factory = Factory {
            model: Model { geometry, ..product.encoder },
            serial: 7,
            baud: if link & 0x10 == 0 { Baud::Fixed(rate) } else { Baud::Search },
            timing: if link & 0x20 == 0 { Timing::Exact } else { Timing::Coarse },
        };
        let mut memory = TornMemory::new();
        if head & 0x80 != 0 {
            let record = any_record(reader, product.fingerprint);
            memory.write(Slot::B, &encode(&record, u32::MAX), None);
        }
        let (now, hand) = (Instant::ZERO, Hand::default());
        let switches = Switches::set_to(7);
        let start = start(&memory);
        Self {
            device: ProfibusEncoder::power_up(now, product, factory, switches, &start, hand),
            factory,
            now,
            memory,
            writing: None,
            frame_count: true,
            request: Vec::new(),
            retries: 0,
            sent: None,
            medium_takes: true,
        }
    }

    fn operate(&mut self, operation: u8, reader: &mut Reader<'_>) {
        let number = |reader: &mut Reader<'_>| u64::from(reader.u16_le().unwrap_or_default());
        match operation {
            0x00..=0x7F => {
                let length = operation >> 3;
                let (service, length) = match operation & 7 {
                    0 => (None, length),
                    1 => (Some(60), length),
                    2 => (Some(59), length),
                    3 => (Some(61), 2 * length + 1),
                    4 => (Some(62), length),
                    5 => (Some(56), length),
                    6 => (Some(57), length),
                    _ => (Some(58), length),
                };
                let data = take(reader, length);
                match service {
                    Some(58) => self.controls(data),
                    _ => self.asks(service, data),
                }
            }
            0x80 => {
                let length = reader.u8().unwrap_or_default();
                self.hear(50, take(reader, length));
            }
            0x81 => {
                let length = reader.u8().unwrap_or_default();
                self.hear(0, take(reader, length));
            }
            0x82 => self.wait(Duration::from_millis(number(reader))),
            0x83 => self.wait(Duration::from_micros(number(reader))),
            0x84 => {
                self.now += Duration::from_millis(10 * number(reader));
                self.device.advance(self.now);
            }
            0x85 => self.memory_takes(),
            0x86 if self.writing.take().is_some() => self.device.kept(self.now, Err(())),
            0x87 => self.lose_power(usize::from(reader.u8().unwrap_or_default())),
            0x88 => self.device.handle(self.now, Input::BrokenCharacter),
            0x89 => {
                let request = std::mem::take(&mut self.request);
                self.hear(50, &request);
                self.request = request;
            }
            0x8A => {
                let code =
                    reader.u32_le().unwrap_or_default() % self.factory.model.geometry.range();
                let flags = reader.u8().unwrap_or_default();
                let reading = match flags >> 2 & 3 {
                    0 => Reading::Fresh,
                    1 => Reading::Failed(LineFault::StuckHigh),
                    _ => Reading::Repeated,
                };
                let (cell_low, turns) = (flags & 1 != 0, flags & 2 != 0);
                *self.device.sensor_mut() = Hand { code, cell_low, turns, reading };
                self.device.advance(self.now);
            }
            0x8B => {
                if let Some(sent) = self.sent {
                    self.hear(0, sent.octets());
                }
            }
            0x8C => {
                let switches = Switches::set_to(reader.u8().unwrap_or_default() % 100);
                self.device.set_switches(switches);
            }
            0x8D => {
                let [to, from, code] = reader.array().unwrap_or_default();
                let length = reader.u8().unwrap_or_default();
                let data = take(reader, length);
                let telegram = Data::new(to, from, FunctionCode(code), data).map(Telegram::Data);
                let sent = telegram.and_then(|telegram| telegram.transmission());
                let octets = sent.map(|sent| sent.octets().to_vec()).unwrap_or_default();
                self.request.clone_from(&octets);
                self.hear(50, &octets);
            }
            0x8E => self.bring_up(reader.u8().unwrap_or_default()),
            0x8F => self.medium_takes = !self.medium_takes,
            _ => {}
        }
    }

    /// Its address, as the switches were at power-up.
    fn slave(&self) -> u8 {
        self.device.slave().settings().address
    }

    fn master(&self) -> u8 {
        if self.slave() == 2 { 3 } else { 2 }
    }

    /// A request of `source` with data that need an answer.
    fn asks(&mut self, service: Option<u8>, data: &[u8]) {
        self.frame_count = !self.frame_count;
        let code = if self.frame_count { 0x7D } else { 0x5D };
        self.says(self.master(), self.slave(), code, service, data);
    }

    fn controls(&mut self, data: &[u8]) {
        self.says(self.master(), 127, 0x46, Some(58), data);
    }

    fn says(&mut self, source: u8, destination: u8, code: u8, service: Option<u8>, data: &[u8]) {
        let saps = service.map(|destination| Saps { destination, source: 62 });
        let head = Head { destination, source, function_code: FunctionCode(code), saps };
        let telegram = head.transmission(data).expect("it fits");
        self.request = telegram.octets().to_vec();
        self.hear(50, telegram.octets());
        self.serve();
    }

    fn hear(&mut self, idle_bits: u32, octets: &[u8]) {
        let rate = self.device.baud_rate();
        let span = rate.bits(idle_bits) + rate.characters(octets.len() as u32);
        if idle_bits == 0 {
            self.now += span;
        } else {
            self.wait(span);
        }
        self.device.handle(self.now, Input::Octets(octets));
    }

    fn wait(&mut self, span: Duration) {
        let end = self.now + span;
        for _ in 0..STEPS {
            let Some(deadline) = self.device.deadline().filter(|deadline| *deadline <= end) else {
                break;
            };
            self.now = self.now.max(deadline);
            self.device.advance(self.now);
            self.serve();
        }
        self.now = end;
        self.device.advance(self.now);
    }

    fn memory_takes(&mut self) {
        if let Some(kept) = self.writing.take() {
            let (slot, sequence) = start(&self.memory).next();
            self.memory.write(slot, &encode(&kept, sequence), None);
            self.device.kept(self.now, Ok::<(), ()>(()));
        }
    }

    /// The memory holds the record from before or the one on its way, and nothing else.
    fn lose_power(&mut self, octets: usize) {
        let before = start(&self.memory);
        let writing = self.writing.take();
        if let Some(kept) = &writing {
            let (slot, sequence) = before.next();
            self.memory.write(slot, &encode(kept, sequence), Some(octets));
        }
        let after = start(&self.memory);
        match (&before, &after) {
            (Start::Kept { kept: old, .. }, Start::Kept { kept, .. }) => {
                assert!(kept == old || Some(kept) == writing.as_ref(), "neither old nor new");
            }
            (Start::Fresh { .. }, Start::Fresh { .. }) => {}
            (Start::Fresh { .. }, Start::Kept { kept, .. }) => {
                assert_eq!(Some(kept), writing.as_ref(), "kept from nowhere");
            }
            _ => panic!("{before:?} and a write cut after {octets} octets gave {after:?}"),
        }
        let (product, switches) = (self.device.product(), self.device.switches());
        let hand = self.device.sensor_mut().clone();
        let now = self.now;
        self.device = ProfibusEncoder::power_up(now, product, self.factory, switches, &after, hand);
        self.sent = None;
    }

    /// What a host does after each call.
    fn serve(&mut self) {
        self.device.advance(self.now);
        self.writing = self.writing.or_else(|| self.device.keep(self.now));
        if self.medium_takes {
            let retries = self.device.slave().counters().retries;
            let may_be_old = self.device.slave().is_in_freeze_mode() || retries != self.retries;
            if let Some(answer) = self.device.transmit(self.now) {
                self.judge_answer(&answer, may_be_old);
                self.retries = retries;
                self.sent = Some(answer);
            }
            let deadline = self.device.deadline();
            assert!(deadline.is_none_or(|at| at > self.now || self.now == Instant::ZERO));
            self.device.advance(self.now);
            assert_eq!(self.device.transmit(self.now), None, "one answer, and no other");
        }
        while let Some((at, event)) = self.device.take_event() {
            assert!(at <= self.now && !event.to_string().is_empty());
        }
    }

    /// An answer is a whole telegram of this station to a master that there can be.
    fn judge_answer(&self, answer: &Transmission, may_be_old: bool) {
        let whole = Telegram::decode(answer.octets()).expect("it is sound").expect("it is whole");
        assert_eq!(whole.length(), answer.octets().len(), "{answer:?}");
        let Telegram::Data(data) = whole else {
            assert_eq!(whole, Telegram::ShortAcknowledge, "{answer:?}");
            return;
        };
        assert_eq!(data.source(), self.slave(), "{answer:?}");
        let master = data.destination();
        assert!(master <= 125 && master != self.slave(), "{answer:?} to {master}");
        let reply = data.function_code().answer().expect("an answer");
        if data.saps() == Ok(None) && !data.unit().is_empty() {
            assert!(matches!(reply, Reply::DataLow | Reply::DataHigh), "{answer:?}");
            assert_eq!(self.device.slave().state(), State::DataExchange, "{answer:?}");
            let inputs = match *data.unit() {
                [a, b] => u32::from(u16::from_be_bytes([a, b])),
                [a, b, c, d] => u32::from_be_bytes([a, b, c, d]),
                _ => panic!("{answer:?} has other inputs than one word or two"),
            };
            let width = if data.unit().len() == 2 { 0xFFFF } else { u32::MAX };
            let position = self.device.encoder().position() & width;
            assert!(may_be_old || inputs == position, "{inputs} for {position}");
        }
    }

    fn judge(&self) {
        let model = self.factory.model;
        let snapshot = self.device.snapshot(self.now);
        assert_eq!(snapshot.in_force.check(model), Ok(()));
        assert_eq!(snapshot.saved.check(model), Ok(()));
        let total = snapshot.in_force.settings.total_in_force(model);
        assert!(snapshot.position < total, "{} of {total}", snapshot.position);
        if let Some(kept) = &self.writing {
            assert_eq!(kept.saved.check(model), Ok(()));
        }
        let slave = self.device.slave();
        let free = slave.state() == State::WaitPrm;
        assert_eq!(slave.master().is_none(), free, "{slave:?}");
        assert!(slave.station_delay() >= 11, "{slave:?}");
        assert!(!free || slave.watchdog().is_none(), "{slave:?}");
        assert!(free || !slave.faults().parameters, "{slave:?}");
        let modes = slave.is_in_sync_mode() || slave.is_in_freeze_mode();
        assert!(!modes || slave.state() == State::DataExchange, "{slave:?}");
        let network = snapshot.profibus().expect("it speaks PROFIBUS");
        if slave.state() == State::DataExchange && !network.class_2 {
            assert_eq!(snapshot.in_force.offset, 0, "class 1 has no offset");
            assert!(!snapshot.in_force.settings.scaling, "class 1 has no scaling");
        }
    }

    /// A master that speaks at the rate the slave tries, with pauses that any link knows.
    fn find_rate(&mut self) {
        self.wait(Duration::from_millis(200));
        for _ in 0..3 {
            self.wait(Duration::from_millis(5));
            self.says(self.master(), self.slave(), 0x49, None, &[]);
        }
    }

    fn bring_up(&mut self, identifier: u8) {
        // 100 turns, which the turns of the disc are no multiple of.
        let multiturn = self.factory.model.geometry.is_multiturn();
        let total = if multiturn { 360_000_u32 } else { 100 };
        self.answered(Some(61), &[&PARAMETERS[..], &total.to_be_bytes()].concat());
        self.answered(Some(62), &[identifier]);
        self.answered(Some(60), &[]);
    }

    /// Asks, and waits for the answer.
    fn answered(&mut self, service: Option<u8>, data: &[u8]) -> Vec<u8> {
        self.sent = None;
        self.asks(service, data);
        let rate = self.device.baud_rate();
        self.wait(rate.bits(LATEST + 1));
        self.serve();
        self.sent.map(|sent| sent.octets().to_vec()).unwrap_or_default()
    }

    /// Whoever owns the device lets go of it; then master 2 or 3 gets to the exchange of data, sets
    /// a preset, and finds it again after the power was off.
    fn recover(&mut self) {
        self.medium_takes = true;
        let hand = self.device.sensor_mut();
        (hand.turns, hand.reading) = (false, Reading::Fresh);
        self.find_rate();
        assert!(self.device.slave().has_baud_rate(), "three telegrams are proof enough");
        if let Some(owner) = self.device.slave().master() {
            let unlock = [0x40, 0, 0, 0, 0x05, 0x9B, 0];
            self.says(owner, self.slave(), 0x4D, Some(61), &unlock);
            self.wait(self.device.baud_rate().bits(LATEST + 1));
        }
        assert_eq!(self.device.slave().state(), State::WaitPrm, "nobody owns it");
        self.exchange();
        self.answered(None, &[0x80, 0, 0, 42]);
        assert_eq!(self.device.encoder().position(), 42, "the preset");
        self.answered(None, &[0, 0, 0, 0]);
        while self.writing.is_some() || self.device.keep_due(self.now) {
            self.memory_takes();
            self.serve();
        }
        // A memory that has failed is tried again after a minute.
        self.now += Duration::from_secs(61);
        self.device.advance(self.now);
        self.serve();
        self.memory_takes();
        self.lose_power(0);
        self.find_rate();
        self.exchange();
        assert_eq!(self.device.encoder().position(), 42, "after power-off");
    }

    #[track_caller]
    fn exchange(&mut self) {
        self.bring_up(0xF1);
        assert_eq!(self.device.slave().state(), State::DataExchange);
        let answer = self.answered(None, &[0, 0, 0, 0]);
        assert_eq!(answer.len(), 13, "inputs of two words");
    }
}

/// At most `length` octets.
fn take<'a>(reader: &mut Reader<'a>, length: u8) -> &'a [u8] {
    (0..=usize::from(length))
        .rev()
        .find_map(|length| reader.octets(length).ok())
        .unwrap_or_default()
}

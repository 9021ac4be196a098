//! A device of twenty lines, and a bench that talks to it in hexadecimal telegrams.

use codewheel_profibus::function_code::FunctionCode;
use codewheel_profibus::telegram::{Head, Saps};
use codewheel_profibus::{
    Application, Baud, Event, Lengths, Refused, Settings, Slave, State, Timing,
};
use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Instant, Writer};

/// A box that is no encoder: inputs are what the test puts there, outputs are written down.
#[derive(Clone, Debug)]
pub(crate) struct Toy {
    pub(crate) inputs: [u8; 4],
    /// What came to the device, in its order: outputs, Clear, the beginning of data exchange.
    pub(crate) told: Vec<String>,
    pub(crate) user: Option<Vec<u8>>,
    /// User parameters are refused that begin with this octet.
    pub(crate) refuses: Option<u8>,
    pub(crate) identifiers: Vec<u8>,
    pub(crate) alarm: u8,
    pub(crate) version: u16,
    pub(crate) events: Vec<Event>,
}

impl Default for Toy {
    fn default() -> Self {
        Self {
            inputs: [0, 0, 0x12, 0x34],
            told: Vec::new(),
            user: None,
            refuses: None,
            identifiers: vec![0xF1],
            alarm: 0,
            version: 0,
            events: Vec::new(),
        }
    }
}

impl Toy {
    /// The diagnosis changes so that the master must read it.
    pub(crate) fn set_alarm(&mut self, alarm: u8) {
        self.alarm = alarm;
        self.version += 1;
    }
}

impl Application for Toy {
    fn parameterize(&mut self, _: Instant, user: &[u8]) -> Result<(), Refused> {
        if self.refuses.is_some() && self.refuses == user.first().copied() {
            return Err(Refused);
        }
        self.user = Some(user.to_vec());
        Ok(())
    }
    fn parameters_refused(&mut self, _: Instant) {
        self.user = None;
    }
    fn configure(&mut self, _: Instant, identifiers: &[u8]) -> Result<Lengths, Refused> {
        let lengths = match identifiers {
            [0xF1] => Lengths { inputs: 4, outputs: 4 },
            [0xF0] => Lengths { inputs: 2, outputs: 2 },
            [0xD1] => Lengths { inputs: 4, outputs: 0 },
            [0x21] => Lengths { inputs: 0, outputs: 2 },
            [0xF7] => Lengths { inputs: 16, outputs: 16 },
            _ => return Err(Refused),
        };
        self.identifiers = identifiers.to_vec();
        Ok(lengths)
    }
    fn configuration(&self, out: &mut Writer<'_>) {
        out.octets(&self.identifiers).expect("room");
    }
    fn data_exchange_begins(&mut self, _: Instant) {
        self.told.push("begin".into());
    }
    fn inputs(&mut self, _: Instant, octets: &mut [u8]) {
        octets.copy_from_slice(&self.inputs[4 - octets.len()..]);
    }
    fn outputs(&mut self, _: Instant, octets: &[u8]) {
        self.told.push(hex(octets));
    }
    fn clear(&mut self, _: Instant) {
        self.told.push("clear".into());
    }
    fn diagnosis(&mut self, _: Instant, out: &mut Writer<'_>) {
        out.octets(&[2, self.alarm]).expect("room");
    }
    fn has_diagnosis(&self) -> bool {
        self.alarm != 0
    }
    fn diagnosis_version(&self) -> u16 {
        self.version
    }
    fn notice(&mut self, _: Instant, event: Event) {
        self.events.push(event);
    }
}

pub(crate) fn octets(hex: &str) -> Vec<u8> {
    let octet = |text| u8::from_str_radix(text, 16).expect("a hexadecimal octet");
    hex.split_whitespace().map(octet).collect()
}

pub(crate) fn hex(octets: &[u8]) -> String {
    octets.iter().map(|octet| format!("{octet:02X}")).collect::<Vec<_>>().join(" ")
}

/// Station 7 and whoever speaks to it, on one line.
#[derive(Clone, Debug)]
pub(crate) struct Bench {
    pub(crate) slave: Slave<4>,
    pub(crate) toy: Toy,
    pub(crate) now: Instant,
    /// FCB of the next request that [`asks`](Self::asks) makes; `None` for a first one.
    frame_count: Option<bool>,
}

pub(crate) const ADDRESS: u8 = 7;
pub(crate) const IDENT_NUMBER: u16 = 0x059B;
/// Lock, Sync_Req, Freeze_Req, watchdog 200 ms, T_SDR 11, group 3, one user octet.
pub(crate) const GOOD_PARAMETERS: &str = "B8 01 14 0B 05 9B 03 00";
pub(crate) const RS: &str = "10 02 07 03 0C 16";
pub(crate) const SC: &str = "E5";

impl Bench {
    pub(crate) fn new(baud: Baud, timing: Timing) -> Self {
        let settings = Settings { address: ADDRESS, ident_number: IDENT_NUMBER, baud, timing };
        let slave = Slave::new(settings);
        let now = Instant::from_nanos(1_000_000_000);
        Self { slave, toy: Toy::default(), now, frame_count: None }
    }

    /// At power-up, at 500 kbit/s, on a link that knows bit times.
    pub(crate) fn power_up() -> Self {
        Self::new(Baud::Fixed(BaudRate::Kbit500), Timing::Exact)
    }

    /// At power-up, at 500 kbit/s, on a port of a PC.
    pub(crate) fn on_a_pc() -> Self {
        Self::new(Baud::Fixed(BaudRate::Kbit500), Timing::Coarse)
    }

    /// Master 2 has it parameterized: WAIT_CFG.
    pub(crate) fn parameterized() -> Self {
        Self::power_up().then_parameterized(GOOD_PARAMETERS)
    }

    /// Master 2 exchanges data with it, four octets each way.
    pub(crate) fn exchanging() -> Self {
        Self::power_up().then_exchanging()
    }

    #[track_caller]
    pub(crate) fn then_parameterized(mut self, parameters: &str) -> Self {
        self.asks(2, Some(61), parameters, SC);
        assert_eq!(self.slave.state(), State::WaitCfg);
        self
    }

    #[track_caller]
    pub(crate) fn then_exchanging(mut self) -> Self {
        self = self.then_parameterized(GOOD_PARAMETERS);
        self.then_configured("F1")
    }

    #[track_caller]
    pub(crate) fn then_configured(mut self, identifiers: &str) -> Self {
        self.asks(2, Some(62), identifiers, SC);
        assert_eq!(self.slave.state(), State::DataExchange);
        self.toy.told.clear();
        self
    }

    /// Octets arrive without a pause, after `pause` bits of idle line.
    pub(crate) fn hears_after(&mut self, pause: u32, octets: &[u8]) {
        let rate = self.slave.baud_rate();
        self.wait(rate.bits(pause));
        self.now += rate.characters(octets.len() as u32);
        self.slave.handle(self.now, Input::Octets(octets), &mut self.toy);
    }

    /// Octets arrive after an idle line.
    pub(crate) fn hears(&mut self, hex: &str) {
        self.hears_after(33, &octets(hex));
    }

    /// Time passes from deadline to deadline; what the slave sends meanwhile, with the time at
    /// which it begins to.
    pub(crate) fn sends(&mut self, span: Duration) -> Vec<(Instant, String)> {
        let end = self.now + span;
        let mut sent = Vec::new();
        loop {
            let due = self.slave.deadline().filter(|deadline| *deadline <= end);
            self.now = due.unwrap_or(end).max(self.now);
            self.slave.advance(self.now, &mut self.toy);
            while let Some(transmission) = self.slave.transmit(self.now, &mut self.toy) {
                sent.push((self.now, hex(transmission.octets())));
                assert!(sent.len() < 100, "the slave does not stop sending: {sent:?}");
            }
            match due {
                Some(due) => {
                    assert_ne!(self.slave.deadline(), Some(due), "the deadline is not served");
                }
                None => return sent,
            }
        }
    }

    /// Time passes; the slave says nothing.
    #[track_caller]
    pub(crate) fn wait(&mut self, span: Duration) {
        assert_eq!(self.sends(span), [], "sent of its own accord");
    }

    /// What the slave answers within 300 bits; empty for silence. The line is then idle.
    pub(crate) fn answer(&mut self) -> String {
        let rate = self.slave.baud_rate();
        let mut sent = self.sends(rate.bits(300));
        assert!(sent.len() <= 1, "one answer at most: {sent:?}");
        sent.pop().map(|(_, hex)| hex).unwrap_or_default()
    }

    /// A telegram arrives after an idle line; the answer must be `expected`, empty for silence.
    #[track_caller]
    pub(crate) fn says(&mut self, hex: &str, expected: &str) {
        self.hears(hex);
        assert_eq!(self.answer(), expected, "in answer to {hex}");
    }

    /// A new request of `master` to a service, or Data_Exchange, with the next FCB.
    #[track_caller]
    pub(crate) fn asks(&mut self, master: u8, service: Option<u8>, data: &str, expected: &str) {
        let request = self.request(master, service, data);
        self.says(&request, expected);
    }

    /// The octets of a new request with the next FCB.
    pub(crate) fn request(&mut self, master: u8, service: Option<u8>, data: &str) -> String {
        let code = match self.frame_count {
            None => 0x6D,
            Some(true) => 0x7D,
            Some(false) => 0x5D,
        };
        self.frame_count = Some(self.frame_count == Some(false));
        telegram(ADDRESS, master, code, service.map(|service| (service, 62)), data)
    }

    /// The answer to a new Slave_Diag of master 2: the six octets of the standard and the toy's.
    pub(crate) fn diagnosis(&mut self) -> String {
        self.diagnosis_for(2)
    }

    pub(crate) fn diagnosis_for(&mut self, master: u8) -> String {
        let request = self.request(master, Some(60), "");
        self.hears(&request);
        let answer = octets(&self.answer());
        assert_eq!(answer[4..9], [0x80 | master, 0x87, 0x08, 62, 60], "{answer:02X?}");
        hex(&answer[9..answer.len() - 2])
    }

    /// Global_Control of `master` to all stations.
    pub(crate) fn global_control(&mut self, master: u8, commands: u8, groups: u8) {
        let data = hex(&[commands, groups]);
        self.says(&telegram(127, master, 0x46, Some((58, 62)), &data), "");
    }

    /// Data_Exchange of master 2, and its inputs; `told` is what that brought the device.
    #[track_caller]
    pub(crate) fn exchanges(&mut self, outputs: &str, inputs: &str, told: &[&str]) {
        self.toy.told.clear();
        self.asks(2, None, outputs, &telegram(2, ADDRESS, 0x08, None, inputs));
        assert_eq!(self.toy.told, told, "told the device");
    }
}

/// The octets of any SD1 or SD2.
pub(crate) fn telegram(
    destination: u8,
    source: u8,
    code: u8,
    saps: Option<(u8, u8)>,
    data: &str,
) -> String {
    let saps = saps.map(|(destination, source)| Saps { destination, source });
    let head = Head { destination, source, function_code: FunctionCode(code), saps };
    format!("{:?}", head.transmission(&octets(data)).expect("a telegram"))
}

//! What is heard on a line without taking part: who asks whom, for what, and what comes back.

use std::collections::BTreeMap;

use codewheel_profibus::function_code::{Function, Reply};
use codewheel_profibus::sap;
use codewheel_profibus::telegram::{Data, Telegram};
use codewheel_station::Instant;
use codewheel_station::rs485::{BaudRate, Input};

use super::settings::HIGHEST_ADDRESS;
use super::telegram::Receiver;
use super::{CycleTimes, Diagnosis, LONGEST_SLOT, StationKind};

/// How many octets are enough to say that none makes a telegram: more than the end of one that began
/// before it was listened to.
const GIBBERISH: u64 = 16;

/// Noise may look like a token once or twice; a master alone with its token sends nothing else.
const CERTAIN_TOKENS: u64 = 3;

/// A master that was heard.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HeardMaster {
    /// How often it handed the token on; 0 for a master that asks without one.
    pub tokens: u64,
    /// The times from one token that it handed on to the next: how long one takes round the ring.
    pub rotation: CycleTimes,
    /// How often it asked somebody.
    pub requests: u64,
    /// How often it looked for a station where none was heard, by its FDL status: other masters (GAP),
    /// or a slave that is not there.
    pub searches: u64,
    /// When it was heard last.
    pub at: Instant,
    token_at: Option<Instant>,
}

impl HeardMaster {
    /// Whether it hands on a token. Of a master that says nothing else it takes a few of them, since
    /// noise may look like one.
    #[must_use]
    pub const fn is_in_ring(&self) -> bool {
        self.tokens >= CERTAIN_TOKENS || (self.tokens > 0 && self.requests > 0)
    }
}

/// Parameters or a configuration on their way to a slave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeardSetting {
    /// The master that sent them.
    pub master: u8,
    /// The user data: Set_Prm from octet 1 on, the identifiers of Chk_Cfg.
    pub octets: Vec<u8>,
    /// Whether the slave confirmed that it got them (SC); what it thinks of them its diagnosis says.
    pub confirmed: bool,
}

/// A slave's exchange of data with a master.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeardExchange {
    /// The master.
    pub master: u8,
    /// The latest inputs, from the slave.
    pub inputs: Vec<u8>,
    /// The latest outputs, to the slave.
    pub outputs: Vec<u8>,
    /// When the latest inputs came.
    pub at: Instant,
    /// Answers heard since this master began.
    pub answers: u64,
    /// The times from one answer to the next.
    pub cycle: CycleTimes,
}

/// A station that answered.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HeardSlave {
    /// What it said of itself when a master asked for its FDL status.
    pub kind: Option<StationKind>,
    /// The latest parameters that it was sent.
    pub parameters: Option<HeardSetting>,
    /// The latest configuration that it was sent.
    pub configuration: Option<HeardSetting>,
    /// The latest diagnosis that it gave to anybody.
    pub diagnosis: Option<Diagnosis>,
    /// Its exchange of data.
    pub exchange: Option<HeardExchange>,
}

/// What a request was, whose answer is due.
#[derive(Clone, Debug)]
struct Asked {
    from: u8,
    to: u8,
    what: What,
    octets: Vec<u8>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    FdlStatus,
    Diagnosis,
    SetParameters,
    CheckConfiguration,
    DataExchange,
    Other,
}

/// What was heard on a line.
#[derive(Debug)]
pub struct Overheard {
    receiver: Receiver,
    asked: Option<Asked>,
    masters: BTreeMap<u8, HeardMaster>,
    slaves: BTreeMap<u8, HeardSlave>,
    octets: u64,
    telegrams: u64,
}

impl Overheard {
    pub(super) fn new(baud_rate: BaudRate) -> Self {
        Self {
            receiver: Receiver::new(baud_rate, LONGEST_SLOT),
            asked: None,
            masters: BTreeMap::new(),
            slaves: BTreeMap::new(),
            octets: 0,
            telegrams: 0,
        }
    }

    /// The masters that were heard, by address.
    pub fn masters(&self) -> impl Iterator<Item = (u8, &HeardMaster)> {
        let is_sure = self.telegrams > 0;
        let masters = self.masters.iter();
        masters
            .filter(move |(_, master)| is_sure || master.tokens >= CERTAIN_TOKENS)
            .map(|(address, master)| (*address, master))
    }

    /// The stations that answered a master, by address.
    pub fn slaves(&self) -> impl Iterator<Item = (u8, &HeardSlave)> {
        self.slaves.iter().map(|(address, slave)| (*address, slave))
    }

    /// The station at `address`, where it answered a master.
    #[must_use]
    pub fn slave(&self, address: u8) -> Option<&HeardSlave> {
        self.slaves.get(&address)
    }

    /// Whether something was heard, and nothing of it could be understood: the bus runs at another
    /// rate, or its two lines are crossed.
    #[must_use]
    pub fn is_gibberish(&self) -> bool {
        self.octets >= GIBBERISH && self.telegrams == 0 && self.masters().next().is_none()
    }

    /// Octets heard, the broken ones among them.
    #[must_use]
    pub const fn octets(&self) -> u64 {
        self.octets
    }

    /// Error-free requests and answers heard; tokens and short confirmations are too short to be
    /// sure of.
    #[must_use]
    pub const fn telegrams(&self) -> u64 {
        self.telegrams
    }

    /// Telegrams that were broken or never finished.
    #[must_use]
    pub const fn broken(&self) -> u64 {
        self.receiver.errors
    }

    /// Takes in what the line brings.
    pub(super) fn hear(&mut self, now: Instant, input: Input<'_>) {
        self.octets += match input {
            Input::Octets(octets) => octets.len() as u64,
            Input::BrokenCharacter => 1,
        };
        self.receiver.push(now, input);
        let mut telegram = Vec::new();
        while self.receiver.next(&mut telegram) {
            match Telegram::decode(&telegram) {
                Ok(Some(Telegram::Token { destination, source })) => {
                    self.token(now, destination, source);
                }
                Ok(Some(Telegram::ShortAcknowledge)) => self.acknowledge(now),
                Ok(Some(Telegram::Data(data))) => {
                    self.telegrams += 1;
                    if data.function_code().is_request() {
                        self.request(now, &data);
                    } else {
                        self.answer(now, &data);
                    }
                }
                Ok(None) | Err(_) => {}
            }
        }
    }

    /// The own master speaks: what comes next answers that.
    pub(super) fn interrupt(&mut self) {
        self.asked = None;
        self.receiver.clear();
    }

    fn master(&mut self, now: Instant, address: u8) -> Option<&mut HeardMaster> {
        if address > HIGHEST_ADDRESS {
            return None;
        }
        let master = self.masters.entry(address).or_default();
        master.at = now;
        Some(master)
    }

    fn token(&mut self, now: Instant, destination: u8, source: u8) {
        self.asked = None;
        if destination > HIGHEST_ADDRESS {
            return;
        }
        if let Some(master) = self.master(now, source) {
            master.tokens += 1;
            if let Some(before) = master.token_at.replace(now) {
                master.rotation.note(now.since(before));
            }
        }
    }

    fn request(&mut self, now: Instant, data: &Data<'_>) {
        let (from, to) = (data.source(), data.destination());
        self.asked = None;
        let function = data.function_code().function();
        let searches = function == Some(Function::FdlStatus) && !self.slaves.contains_key(&to);
        if let Some(master) = self.master(now, from) {
            master.requests += 1;
            master.searches += u64::from(searches);
        }
        let what = match function {
            Some(Function::FdlStatus) => What::FdlStatus,
            Some(Function::SrdLow | Function::SrdHigh) => match data.saps() {
                Ok(None) => What::DataExchange,
                Ok(Some(saps)) => match saps.destination {
                    sap::SLAVE_DIAGNOSIS => What::Diagnosis,
                    sap::SET_PARAMETERS => What::SetParameters,
                    sap::CHECK_CONFIGURATION => What::CheckConfiguration,
                    _ => What::Other,
                },
                Err(_) => What::Other,
            },
            _ => return,
        };
        if to <= HIGHEST_ADDRESS {
            self.asked = Some(Asked { from, to, what, octets: data.data().to_vec() });
        }
    }

    fn acknowledge(&mut self, now: Instant) {
        let Some(asked) = self.asked.take() else { return };
        match asked.what {
            What::DataExchange => self.exchanged(now, asked, &[]),
            What::SetParameters | What::CheckConfiguration => self.was_set(asked, true),
            What::FdlStatus | What::Diagnosis | What::Other => {}
        }
    }

    fn answer(&mut self, now: Instant, data: &Data<'_>) {
        let Some(asked) = self.asked.take() else { return };
        if (asked.to, asked.from) != (data.source(), data.destination()) {
            return;
        }
        let code = data.function_code();
        let Some(reply) = code.answer() else { return };
        let slave = self.slaves.entry(asked.to).or_default();
        match (asked.what, reply) {
            (What::FdlStatus, _) => slave.kind = Some(StationKind::of(code)),
            (What::Diagnosis, Reply::Ok | Reply::DataLow | Reply::DataHigh) => {
                if let Some(diagnosis) = Diagnosis::read(data.data()) {
                    // In the exchange of data nobody else can have it.
                    if let Some(exchange) = &slave.exchange
                        && diagnosis.master != Some(exchange.master)
                    {
                        slave.exchange = None;
                    }
                    slave.diagnosis = Some(diagnosis);
                }
            }
            (What::SetParameters | What::CheckConfiguration, _) => self.was_set(asked, false),
            (What::DataExchange, Reply::Ok | Reply::DataLow | Reply::DataHigh) => {
                self.exchanged(now, asked, data.data());
            }
            (What::DataExchange, Reply::NotActivated) => slave.exchange = None,
            _ => {}
        }
    }

    fn was_set(&mut self, asked: Asked, confirmed: bool) {
        let slave = self.slaves.entry(asked.to).or_default();
        let setting = HeardSetting { master: asked.from, octets: asked.octets, confirmed };
        if asked.what == What::SetParameters {
            slave.parameters = Some(setting);
        } else {
            slave.configuration = Some(setting);
        }
    }

    fn exchanged(&mut self, now: Instant, asked: Asked, inputs: &[u8]) {
        let slave = self.slaves.entry(asked.to).or_default();
        let master = asked.from;
        match slave.exchange.as_mut().filter(|exchange| exchange.master == master) {
            Some(exchange) => {
                exchange.cycle.note(now.since(exchange.at));
                exchange.at = now;
                exchange.answers += 1;
                exchange.outputs = asked.octets;
                exchange.inputs.clear();
                exchange.inputs.extend_from_slice(inputs);
            }
            None => {
                slave.exchange = Some(HeardExchange {
                    master,
                    inputs: inputs.to_vec(),
                    outputs: asked.octets,
                    at: now,
                    answers: 1,
                    cycle: CycleTimes::default(),
                });
            }
        }
    }
}

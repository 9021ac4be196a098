//! A slave written from the printed conversation, and from nothing else of this repository.

use codewheel_station::Instant;
use codewheel_station::rs485::BaudRate;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum State {
    WaitParameters,
    WaitConfiguration,
    DataExchange,
}

#[derive(Clone, Debug)]
pub(crate) struct Scripted {
    pub(crate) address: u8,
    pub(crate) state: State,
    pub(crate) ident_number: u16,
    pub(crate) configuration: Vec<u8>,
    pub(crate) inputs: Vec<u8>,
    pub(crate) outputs: Vec<u8>,
    pub(crate) parameters: Vec<u8>,
    /// Station status 1 while running: bit 3 is Ext_Diag.
    pub(crate) running_status: u8,
    pub(crate) extended: Vec<u8>,
    /// Another master owns it.
    pub(crate) owner: Option<u8>,
    /// It has power.
    pub(crate) present: bool,
    /// So many answers are lost on the line.
    pub(crate) lose: u32,
    /// Answers so to everything.
    pub(crate) always: Option<Vec<u8>>,
    /// Data exchange is answered with high priority until the diagnosis was read.
    pub(crate) pending: bool,
    pub(crate) delay_bits: u32,
    /// So many configurations do not reach it, but noise confirms them.
    pub(crate) deaf_to_configuration: u32,
    pub(crate) requests: Vec<Vec<u8>>,
    pub(crate) due: Option<Instant>,
    faults: u8,
    heard: Vec<u8>,
    quiet_since: Instant,
    answer: Vec<u8>,
    last: Option<(Vec<u8>, Vec<u8>)>,
}

impl Scripted {
    pub(crate) fn new(address: u8) -> Self {
        Self {
            address,
            state: State::WaitParameters,
            ident_number: 0x059B,
            configuration: vec![0xF1],
            inputs: vec![0x00, 0x00, 0x12, 0x34],
            outputs: Vec::new(),
            parameters: Vec::new(),
            running_status: 0,
            extended: Vec::new(),
            owner: None,
            present: true,
            lose: 0,
            always: None,
            pending: false,
            delay_bits: 11,
            deaf_to_configuration: 0,
            requests: Vec::new(),
            due: None,
            faults: 0,
            heard: Vec::new(),
            quiet_since: Instant::ZERO,
            answer: Vec::new(),
            last: None,
        }
    }

    /// As after power was cut and came back.
    pub(crate) fn restart(&mut self) {
        self.state = State::WaitParameters;
        self.faults = 0;
        self.last = None;
    }

    pub(crate) fn hear(&mut self, now: Instant, rate: BaudRate, octet: u8) {
        let pause = (now - rate.characters(1)).since(self.quiet_since);
        if pause >= rate.bits(32) {
            self.heard.clear();
        }
        self.quiet_since = now;
        self.heard.push(octet);
        let length = match self.heard[0] {
            0x10 => 6,
            0xA2 => 14,
            0xDC => 3,
            0x68 if self.heard.len() > 1 => usize::from(self.heard[1]) + 6,
            0x68 => 4,
            _ => 1,
        };
        if self.heard.len() < length {
            return;
        }
        let request = std::mem::take(&mut self.heard);
        if !self.present {
            return;
        }
        if let Some(answer) = self.execute(&request) {
            if self.lose > 0 {
                self.lose -= 1;
            } else {
                self.answer = answer;
                self.due = Some(now + rate.bits(self.delay_bits));
            }
        }
    }

    pub(crate) fn speak(&mut self, now: Instant) -> Option<Vec<u8>> {
        self.due.take_if(|due| *due <= now).map(|_| std::mem::take(&mut self.answer))
    }

    fn execute(&mut self, request: &[u8]) -> Option<Vec<u8>> {
        let head = match request[0] {
            0x10 | 0xA2 => 1,
            0x68 => 4,
            _ => return None,
        };
        let &[to, from, code] = request.get(head..head + 3)? else { return None };
        if to & 0x7F != self.address || code & 0x40 == 0 {
            return None;
        }
        self.requests.push(request.to_vec());
        if code == 0x49 {
            return Some(short(from, self.address, 0x00));
        }
        if let Some(answer) = &self.always {
            return Some(answer.clone());
        }
        if code & 0x10 != 0
            && let Some((_, answer)) = self.last.as_ref().filter(|(last, _)| last == request)
        {
            return Some(answer.clone());
        }
        let sap = (to & 0x80 != 0).then(|| request[head + 3]);
        let data = request.get(head + if sap.is_some() { 5 } else { 3 }..request.len() - 2)?;
        let answer = self.serve(from & 0x7F, sap, data);
        self.last = Some((request.to_vec(), answer.clone()));
        Some(answer)
    }

    fn serve(&mut self, master: u8, sap: Option<u8>, data: &[u8]) -> Vec<u8> {
        let refused = short(master, self.address, 0x03);
        let stranger = self.owner.is_some_and(|owner| owner != master);
        match sap {
            Some(0x3C) => self.diagnosis(master),
            Some(0x3D) if stranger => refused,
            Some(0x3D) => {
                self.parameters = data.to_vec();
                self.owner = None;
                let good = data.len() >= 7 && data[4..6] == self.ident_number.to_be_bytes();
                self.faults = if good { 0 } else { 0x40 };
                if good {
                    self.state = State::WaitConfiguration;
                    self.owner = Some(master);
                }
                vec![0xE5]
            }
            // After refused parameters the configuration is confirmed and not looked at.
            Some(0x3E) if stranger => refused,
            Some(0x3E) if self.deaf_to_configuration > 0 => {
                self.deaf_to_configuration -= 1;
                vec![0xE5]
            }
            Some(0x3E) => {
                if self.state == State::WaitConfiguration {
                    let good = data == self.configuration;
                    self.faults = if good { 0 } else { 0x04 };
                    self.state = if good { State::DataExchange } else { State::WaitParameters };
                }
                vec![0xE5]
            }
            None if self.state == State::DataExchange && !stranger => {
                self.outputs = data.to_vec();
                let code = if self.pending { 0x0A } else { 0x08 };
                let mut body = vec![master, self.address, code];
                body.extend(&self.inputs);
                long(&body)
            }
            _ => refused,
        }
    }

    fn diagnosis(&mut self, master: u8) -> Vec<u8> {
        let ready = self.state != State::WaitParameters;
        let running = self.state == State::DataExchange;
        self.pending &= !running;
        let first = if running { self.running_status } else { 0x02 | self.faults };
        let second = if !ready {
            0x05
        } else if self.parameters[0] & 8 != 0 {
            0x0C
        } else {
            0x04
        };
        let [high, low] = self.ident_number.to_be_bytes();
        let owner = self.owner.unwrap_or(0xFF);
        let mut body = vec![0x80 | master, 0x80 | self.address, 0x08, 0x3E, 0x3C];
        body.extend([first, second, 0x00, owner, high, low]);
        body.extend(&self.extended);
        long(&body)
    }
}

/// SD1.
pub(crate) fn short(to: u8, from: u8, code: u8) -> Vec<u8> {
    let check = to.wrapping_add(from).wrapping_add(code);
    vec![0x10, to, from, code, check, 0x16]
}

/// SD2.
pub(crate) fn long(body: &[u8]) -> Vec<u8> {
    let length = u8::try_from(body.len()).unwrap();
    let mut telegram = vec![0x68, length, length, 0x68];
    telegram.extend(body);
    telegram.push(body.iter().fold(0, |sum: u8, octet| sum.wrapping_add(*octet)));
    telegram.push(0x16);
    telegram
}

//! Requests outside of the cycle, to any station: what a master asks that does not serve it.

use std::collections::VecDeque;
use std::fmt;

use profirust::dp::DpMaster;
use profirust::fdl::{
    DataTelegram, DataTelegramHeader, FdlActiveStation, FdlApplication, FrameCountBit,
    FunctionCode, RequestType, ResponseState, ResponseStatus, Telegram, TelegramTx,
    TelegramTxResponse,
};

use super::Diagnosis;

/// The master's SAP in requests that any master may make.
const MASTER_SAP: u8 = 62;
const CONFIGURATION_SAP: u8 = 59;
const DIAGNOSIS_SAP: u8 = 60;
const PARAMETERS_SAP: u8 = 61;

/// Set_Prm octet 1: the slave is free for other masters.
const UNLOCK: u8 = 0x40;
/// Set_Prm without user parameters.
const PARAMETERS: usize = 7;

/// What a master asks of a station that it need not serve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Acyclic {
    /// FDL status: whether the station is there, and what it is.
    FdlStatus,
    /// Slave_Diag, which any master may read. Not of a slave that this master serves: for those
    /// there is [`Master::request_diagnosis`](super::Master::request_diagnosis).
    Diagnosis,
    /// Get_Cfg, which any master may read.
    Configuration,
    /// Set_Prm with Unlock: the slave leaves the exchange of data and is free for other masters. It
    /// obeys its own master alone.
    Unlock,
}

/// What a station says of itself when it is asked for its FDL status.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StationKind {
    /// A slave.
    Slave,
    /// A master that cannot be admitted to the ring yet.
    MasterNotReady,
    /// A master that waits for being admitted.
    MasterReady,
    /// A master in the ring.
    MasterInRing,
}

/// How a station answered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Its FDL status.
    Station(StationKind),
    /// Its diagnosis.
    Diagnosis(Diagnosis),
    /// The identifiers of its configuration.
    Configuration(Vec<u8>),
    /// It has done it (SC).
    Acknowledged,
    /// It does not do that: RS, or another answer without data.
    Refused,
    /// It did not answer, nor when it was asked again.
    Silence,
}

/// What came of a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answered {
    /// Whom it was for.
    pub address: u8,
    /// What was asked.
    pub request: Acyclic,
    /// How the station answered.
    pub answer: Answer,
}

impl fmt::Display for Acyclic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::FdlStatus => "FDL status",
            Self::Diagnosis => "Slave_Diag",
            Self::Configuration => "Get_Cfg",
            Self::Unlock => "Set_Prm with Unlock",
        })
    }
}

impl Acyclic {
    fn send(self, address: u8, fdl: &FdlActiveStation, tx: TelegramTx<'_>) -> TelegramTxResponse {
        let master = fdl.parameters().address;
        let (service, octets) = match self {
            Self::FdlStatus => return tx.send_fdl_status_request(address, master),
            Self::Diagnosis => (DIAGNOSIS_SAP, 0),
            Self::Configuration => (CONFIGURATION_SAP, 0),
            Self::Unlock => (PARAMETERS_SAP, PARAMETERS),
        };
        let head = DataTelegramHeader {
            da: address,
            sa: master,
            dsap: Some(service),
            ssap: Some(MASTER_SAP),
            // Each is the first of its own: nothing is known of what the slave was asked before.
            fc: FunctionCode::Request { fcb: FrameCountBit::First, req: RequestType::SrdLow },
        };
        tx.send_data_telegram(head, octets, |octets| {
            octets.fill(0);
            if let Some(first) = octets.first_mut() {
                *first = UNLOCK;
            }
        })
    }

    /// What `telegram` answers, which came from the station that was asked; `None` where it is no
    /// answer to this.
    fn answer(self, telegram: &Telegram<'_>) -> Option<Answer> {
        match telegram {
            Telegram::ShortConfirmation(_) => {
                (self == Self::Unlock).then_some(Answer::Acknowledged)
            }
            Telegram::Data(data) => {
                let FunctionCode::Response { state, status } = data.h.fc else { return None };
                match (self, status) {
                    (Self::FdlStatus, _) => Some(Answer::Station(state.into())),
                    (
                        _,
                        ResponseStatus::Ok | ResponseStatus::DataLow | ResponseStatus::DataHigh,
                    ) => self.data(data),
                    _ => Some(Answer::Refused),
                }
            }
            Telegram::Token(_) => None,
        }
    }

    fn data(self, data: &DataTelegram<'_>) -> Option<Answer> {
        let from = |sap| data.h.dsap == Some(MASTER_SAP) && data.h.ssap == Some(sap);
        match self {
            Self::Diagnosis if from(DIAGNOSIS_SAP) => {
                Diagnosis::read(data.pdu).map(Answer::Diagnosis)
            }
            Self::Configuration if from(CONFIGURATION_SAP) => {
                Some(Answer::Configuration(data.pdu.to_vec()))
            }
            _ => None,
        }
    }
}

impl StationKind {
    /// By bits 5 and 4 of an answer (EN 50170-2, FDL).
    pub(super) const fn of(code: codewheel_profibus::function_code::FunctionCode) -> Self {
        match code.0 >> 4 & 3 {
            0 => Self::Slave,
            1 => Self::MasterNotReady,
            2 => Self::MasterReady,
            _ => Self::MasterInRing,
        }
    }
}

impl From<ResponseState> for StationKind {
    fn from(state: ResponseState) -> Self {
        match state {
            ResponseState::Slave => Self::Slave,
            ResponseState::MasterNotReady => Self::MasterNotReady,
            ResponseState::MasterWithoutToken => Self::MasterReady,
            ResponseState::MasterInRing => Self::MasterInRing,
        }
    }
}

/// The requests that wait, the one under way, and what came of the others.
#[derive(Debug)]
pub(super) struct Requests {
    waiting: VecDeque<(u8, Acyclic)>,
    under_way: Option<UnderWay>,
    /// Whether the last telegram was such a request, so that the answer is for it.
    asking: bool,
    /// Sent since the cycle began, and how many may be sent.
    in_a_row: u8,
    most_in_a_row: u8,
    answered: VecDeque<Answered>,
}

#[derive(Clone, Copy, Debug)]
struct UnderWay {
    address: u8,
    request: Acyclic,
    asked: u8,
}

impl Default for Requests {
    fn default() -> Self {
        Self {
            waiting: VecDeque::new(),
            under_way: None,
            asking: false,
            in_a_row: 0,
            most_in_a_row: 1,
            answered: VecDeque::new(),
        }
    }
}

impl Requests {
    pub(super) const fn set_most_in_a_row(&mut self, most: u8) {
        self.most_in_a_row = most;
    }

    pub(super) fn push(&mut self, address: u8, request: Acyclic) {
        self.waiting.push_back((address, request));
    }

    pub(super) fn take(&mut self) -> Option<Answered> {
        self.answered.pop_front()
    }

    /// Whether none waits, and none is under way.
    pub(super) fn is_done(&self) -> bool {
        self.waiting.is_empty() && self.under_way.is_none()
    }

    /// Forgets what waits; what is under way is not repeated.
    pub(super) fn clear(&mut self) {
        self.waiting.clear();
        self.under_way = None;
    }

    /// Whose answer is due, where the last telegram was such a request.
    pub(super) fn asks(&self) -> Option<u8> {
        self.under_way.filter(|_| self.asking).map(|under_way| under_way.address)
    }

    /// Whether `telegram`, which came from the station that was asked, answers what it was asked.
    pub(super) fn fits(&self, telegram: &Telegram<'_>) -> bool {
        self.under_way.is_some_and(|under_way| under_way.request.answer(telegram).is_some())
    }

    /// The next one to be sent; `None` where none is, or it is the turn of the cycle.
    fn next(&mut self, fdl: &FdlActiveStation) -> Option<(u8, Acyclic)> {
        if self.in_a_row >= self.most_in_a_row {
            return None;
        }
        if let Some(under_way) = self.under_way
            && under_way.asked > fdl.parameters().max_retry_limit
        {
            self.finish(Answer::Silence);
        }
        if self.under_way.is_none() {
            let (address, request) = self.waiting.pop_front()?;
            self.under_way = Some(UnderWay { address, request, asked: 0 });
        }
        let under_way = self.under_way.as_mut()?;
        under_way.asked = under_way.asked.saturating_add(1);
        self.in_a_row += 1;
        self.asking = true;
        Some((under_way.address, under_way.request))
    }

    fn finish(&mut self, answer: Answer) {
        self.asking = false;
        if let Some(UnderWay { address, request, .. }) = self.under_way.take() {
            self.answered.push_back(Answered { address, request, answer });
        }
    }
}

/// The cycle through the slaves and the requests between two cycles, as one to profirust.
pub(super) struct Applications<'a> {
    /// `None` for a master that serves no slaves: profirust's DP master never ends a cycle without.
    pub(super) dp: Option<&'a mut DpMaster<'static>>,
    pub(super) requests: &'a mut Requests,
}

impl FdlApplication for Applications<'_> {
    fn transmit_telegram(
        &mut self,
        now: profirust::time::Instant,
        fdl: &FdlActiveStation,
        tx: TelegramTx<'_>,
        high_prio_only: bool,
    ) -> Option<TelegramTxResponse> {
        self.requests.asking = false;
        if !high_prio_only && let Some((address, request)) = self.requests.next(fdl) {
            return Some(request.send(address, fdl, tx));
        }
        let sent = match &mut self.dp {
            Some(dp) => dp.transmit_telegram(now, fdl, tx, high_prio_only),
            None => None,
        };
        if sent.is_none() {
            self.requests.in_a_row = 0;
        }
        sent
    }

    fn receive_reply(
        &mut self,
        now: profirust::time::Instant,
        fdl: &FdlActiveStation,
        address: u8,
        telegram: Telegram<'_>,
    ) {
        if self.requests.asking {
            let request = self.requests.under_way.map(|under_way| under_way.request);
            if let Some(answer) = request.and_then(|request| request.answer(&telegram)) {
                self.requests.finish(answer);
            }
        } else if let Some(dp) = &mut self.dp {
            dp.receive_reply(now, fdl, address, telegram);
        }
    }

    fn handle_timeout(
        &mut self,
        now: profirust::time::Instant,
        fdl: &FdlActiveStation,
        address: u8,
    ) {
        if self.requests.asking {
            let retries = fdl.parameters().max_retry_limit;
            if self.requests.under_way.is_some_and(|under_way| under_way.asked > retries) {
                self.requests.finish(Answer::Silence);
            }
            self.requests.asking = false;
        } else if let Some(dp) = &mut self.dp {
            dp.handle_timeout(now, fdl, address);
        }
    }
}

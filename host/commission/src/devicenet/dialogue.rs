//! Questions and answers through a seat. Every wait ends.

use std::io;

use codewheel_devicenet::explicit::{Error, Path, Service};
use codewheel_devicenet::scanner::{
    ANSWER_TIME, NotAdded, NotTaken, PollSettings, Response, SET_TIME, SlaveSettings, SlaveState,
    Ticket,
};
use codewheel_devicenet::{Fault, MacId, Scanner};
use codewheel_link::LinkError;
use codewheel_station::{Duration, Instant};

use super::console::Console;
use super::troubles;
use crate::{Kind, Owner, Seat, Trouble};

/// How long going on line may take: the check of the MAC ID takes two seconds.
const ON_LINE_TIME: Duration = Duration::from_secs(5);
/// How long a slave may take to be allocated. One that is checking its own MAC ID is left alone for
/// 1.1 s first, and one that held connections of an earlier life of ours loses them before.
const ALLOCATION_TIME: Duration = Duration::from_millis(4_500);
/// How long one that answers may take to be configured: five answers, each as slow as may be.
const CONFIGURATION_TIME: Duration = Duration::from_secs(14);
/// How long releasing a slave may take: four releases, thrice each, where it is gone.
const RELEASE_TIME: Duration = Duration::from_secs(8);
/// How long an exchange may take besides the patience for its answer: many fragments, and the
/// explicit connection allocated anew.
const EXCHANGE_TIME: Duration = Duration::from_secs(35);

/// What a device answered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// It did it; the data of its response.
    Done(Vec<u8>),
    /// It refused.
    Refused(Error),
    /// The response is longer than there is room for.
    TooLong,
}

/// Whether a turn failed because an end is wanted.
fn is_interruption(error: &LinkError) -> bool {
    matches!(error, LinkError::System(error) if error.kind() == io::ErrorKind::Interrupted)
}

/// A seat, and what people should hear of what happened on its port.
#[derive(Debug)]
pub(super) struct Dialogue<S> {
    seat: S,
    notices: Vec<String>,
    outages: u32,
}

impl<S: Seat<Station = Console>> Dialogue<S> {
    pub(super) fn new(mut seat: S) -> Self {
        let outages = seat.station().outages();
        Self { seat, notices: Vec::new(), outages }
    }

    pub(super) fn now(&self) -> Instant {
        self.seat.now()
    }

    pub(super) fn console(&mut self) -> &mut Console {
        self.seat.station()
    }

    pub(super) fn take_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notices)
    }

    /// Has people hear something.
    pub(super) fn notice(&mut self, notice: String) {
        self.notices.push(notice);
    }

    /// Lets time pass until `done` gives something; `None` where it does not within `patience`.
    pub(super) fn wait<T>(
        &mut self,
        tried: &str,
        patience: Duration,
        mut done: impl FnMut(&mut Console, Instant) -> Option<T>,
    ) -> Result<Option<T>, Trouble> {
        let until = self.now() + patience;
        loop {
            let now = self.now();
            if let Some(result) = done(self.seat.station(), now) {
                return Ok(Some(result));
            }
            if now >= until {
                return Ok(None);
            }
            self.turn(tried, until)?;
        }
    }

    fn turn(&mut self, tried: &str, until: Instant) -> Result<(), Trouble> {
        match self.seat.turn(until) {
            Ok(notices) => self.notices.extend(notices.iter().map(ToString::to_string)),
            Err(error) if is_interruption(&error) => {
                return Err(Trouble::new(Kind::Bus, tried, "an end was wanted before", ""));
            }
            Err(error) => {
                let came = format!("the bus is lost: {error}");
                return Err(Trouble::new(
                    Kind::Bus,
                    tried,
                    came,
                    "see that it is back, then try again",
                ));
            }
        }
        let console = self.seat.station();
        let (outages, own) = (console.outages(), console.mac());
        if outages != self.outages {
            self.outages = outages;
            let fault = console.fault().unwrap_or(Fault::BusOff);
            return Err(troubles::fault(tried, fault, own));
        }
        Ok(())
    }

    /// Listens until the bus was heard for `span` without a break; what was heard before counts.
    pub(super) fn listen(
        &mut self,
        tried: &str,
        span: Duration,
        progress: impl FnMut(u8),
    ) -> Result<(), Trouble> {
        let now = self.now();
        let heard = self.console().overheard().span(now);
        let left = Duration::from_nanos(span.as_nanos().saturating_sub(heard.as_nanos()));
        self.listen_for(tried, left, progress)
    }

    /// Listens for `span` from now on.
    pub(super) fn listen_for(
        &mut self,
        tried: &str,
        span: Duration,
        mut progress: impl FnMut(u8),
    ) -> Result<(), Trouble> {
        let begun = self.now();
        let mut told = None;
        self.wait(tried, span, |_, now| {
            let percent = now.since(begun).as_nanos().saturating_mul(100) / span.as_nanos().max(1);
            let percent = percent.min(100) as u8;
            if told != Some(percent) {
                told = Some(percent);
                progress(percent);
            }
            None::<()>
        })?;
        // An adapter that was lost before hears nothing.
        let console = self.console();
        match console.fault() {
            // That our address is taken keeps us from speaking alone.
            None | Some(Fault::DuplicateMac) => Ok(()),
            Some(fault) => Err(troubles::fault(tried, fault, console.mac())),
        }
    }

    /// Goes on line at `own`, unless the console is there already.
    pub(super) fn go_on_line(&mut self, tried: &str, own: MacId) -> Result<(), Trouble> {
        let now = self.now();
        let console = self.console();
        let is_there = console.mac() == Some(own) && console.fault().is_none();
        if !is_there {
            if console.overheard().node(own).sent_at.is_some() {
                return Err(troubles::duplicate(tried, Some(own)));
            }
            console.speak(now, own);
        }
        let on_line = self.wait(tried, ON_LINE_TIME, |console, _| {
            let scanner = console.scanner()?;
            match scanner.faulted() {
                Some(fault) => Some(Err(fault)),
                None => scanner.is_on_line().then_some(Ok(())),
            }
        })?;
        match on_line {
            Some(Ok(())) => Ok(()),
            Some(Err(fault)) => {
                self.console().fall_silent();
                Err(troubles::fault(tried, fault, Some(own)))
            }
            None => {
                let was_heard = self.console().overheard().frames() != 0;
                self.console().fall_silent();
                Err(if was_heard { troubles::not_on_line(tried) } else { troubles::silence(tried) })
            }
        }
    }

    /// Says that `mac` belongs to another master, as far as is known to whom.
    pub(super) fn owned(&mut self, tried: &str, mac: MacId, owner: Owner) -> Trouble {
        let console = self.console();
        let own = console.mac();
        let candidates: Vec<MacId> = console
            .overheard()
            .candidates()
            .filter(|candidate| *candidate != mac && Some(*candidate) != own)
            .collect();
        troubles::owned(tried, mac, owner, &candidates)
    }

    /// Has the slave allocated as `settings` say, and configured.
    ///
    /// One that belongs to another master, by what was heard or by its own word, is refused.
    pub(super) fn allocate(&mut self, tried: &str, settings: SlaveSettings) -> Result<(), Trouble> {
        let mac = settings.mac;
        let now = self.now();
        if let Some(owner) = self.console().owner(now, mac) {
            return Err(self.owned(tried, mac, owner));
        }
        let mut added = self.add(settings);
        if added == Some(Err(NotAdded::AddressInUse)) && self.console().mac() != Some(mac) {
            // A session before was dropped without a release.
            self.release(tried, mac)?;
            added = self.add(settings);
        }
        match added {
            Some(Ok(())) => {}
            Some(Err(NotAdded::AddressInUse | NotAdded::Full)) => {
                let came = format!("MAC ID {mac} is our own");
                return Err(Trouble::new(Kind::Usage, tried, came, "give another address"));
            }
            None => return Err(troubles::not_on_line(tried)),
        }
        self.expect_running(tried, mac).inspect_err(|_| self.abandon(tried, mac))
    }

    /// Waits until a slave exchanges what it was added for.
    fn expect_running(&mut self, tried: &str, mac: MacId) -> Result<(), Trouble> {
        let last_sign = self.now() + ALLOCATION_TIME;
        let outcome = self.wait(tried, CONFIGURATION_TIME, |console, now| {
            match console.scanner()?.slave(mac)?.state {
                SlaveState::Running => Some(Some(Ok(()))),
                SlaveState::Refused(refusal) => Some(Some(Err(refusal))),
                SlaveState::Absent => (now >= last_sign).then_some(None),
                SlaveState::Configuring => None,
            }
        });
        Err(match outcome.map(Option::flatten) {
            Ok(Some(Ok(()))) => return Ok(()),
            Ok(Some(Err(refusal))) if troubles::is_ownership(refusal) => {
                let now = self.now();
                let owner = self.console().overheard().node(mac).master;
                let owner = owner.filter(|(_, at)| now.since(*at) < Duration::from_secs(60));
                let owner = owner.map_or(Owner::Somebody, |(mac, _)| Owner::Master(mac.value()));
                self.owned(tried, mac, owner)
            }
            Ok(Some(Err(refusal))) => troubles::not_allocated(tried, refusal),
            Ok(None) => troubles::nobody(tried, mac),
            Err(trouble) => trouble,
        })
    }

    /// Has a slave with an explicit connection polled besides. One that refuses keeps the explicit
    /// connection alone.
    pub(super) fn begin_polling(
        &mut self,
        tried: &str,
        mac: MacId,
        poll: PollSettings,
    ) -> Result<(), Trouble> {
        self.change_polling(tried, mac, |scanner| match scanner.begin_polling(mac, poll) {
            // It is polled: an end was wanted while that began.
            Err(NotTaken::Busy) => Ok(()),
            result => result,
        })?;
        let begun = self.expect_running(tried, mac);
        if begun.as_ref().is_err_and(|trouble| trouble.kind != Kind::Bus) {
            let _ = self.release(tried, mac);
            let _ = self.allocate(tried, SlaveSettings::explicit(mac));
        }
        begun
    }

    /// Ends the polls of a slave, which keeps its explicit connection.
    pub(super) fn end_polling(&mut self, tried: &str, mac: MacId) -> Result<(), Trouble> {
        self.change_polling(tried, mac, |scanner| scanner.end_polling(mac))?;
        self.expect_running(tried, mac)
    }

    fn change_polling(
        &mut self,
        tried: &str,
        mac: MacId,
        mut change: impl FnMut(&mut Scanner) -> Result<(), NotTaken>,
    ) -> Result<(), Trouble> {
        let changed = self.wait(tried, ALLOCATION_TIME, |console, _| {
            let Some(scanner) = console.scanner_mut() else { return Some(Err(NotTaken::OffLine)) };
            match change(scanner) {
                // It was lost and is being brought back.
                Err(NotTaken::NotRunning | NotTaken::OffLine) if scanner.faulted().is_none() => {
                    None
                }
                result => Some(result),
            }
        })?;
        match changed {
            Some(Ok(())) => Ok(()),
            Some(Err(NotTaken::UnknownSlave)) => Err(troubles::not_open(tried, mac)),
            Some(Err(_)) | None => Err(self.no_answer(tried, mac)),
        }
    }

    fn add(&mut self, settings: SlaveSettings) -> Option<Result<(), NotAdded>> {
        self.console().scanner_mut().map(|scanner| scanner.add(settings))
    }

    /// Releases the slave, if it was allocated.
    pub(super) fn release(&mut self, tried: &str, mac: MacId) -> Result<(), Trouble> {
        if let Some(scanner) = self.console().scanner_mut() {
            scanner.remove(mac);
        }
        let gone = self.wait(tried, RELEASE_TIME, |console, _| {
            let scanner = console.scanner();
            scanner.is_none_or(|scanner| scanner.slave(mac).is_none()).then_some(())
        })?;
        gone.ok_or_else(|| troubles::gone(tried, mac))
    }

    /// Releases the slave after something went wrong, which is what people must hear.
    pub(super) fn abandon(&mut self, tried: &str, mac: MacId) {
        let _ = self.release(tried, mac);
    }

    /// Asks the explicit request `body` of a slave that was allocated.
    pub(super) fn ask(
        &mut self,
        tried: &str,
        mac: MacId,
        body: &[u8],
        patience: Duration,
    ) -> Result<Answer, Trouble> {
        let ticket = self.hand_in(tried, mac, body, patience)?;
        let limit = patience + EXCHANGE_TIME;
        let answer = self.wait(tried, limit, |console, _| {
            console.scanner_mut()?.response(ticket, |response| match response {
                Response::Done(data) => Some(Answer::Done(data.to_vec())),
                Response::Refused(error) => Some(Answer::Refused(error)),
                Response::TooLong => Some(Answer::TooLong),
                Response::NoAnswer => None,
            })
        });
        if let Ok(Some(Some(answer))) = answer {
            return Ok(answer);
        }
        // A ticket that nobody asks for keeps the slave from being asked anew.
        if let Some(scanner) = self.console().scanner_mut() {
            scanner.cancel(ticket);
        }
        Err(answer.err().unwrap_or_else(|| self.no_answer(tried, mac)))
    }

    fn hand_in(
        &mut self,
        tried: &str,
        mac: MacId,
        body: &[u8],
        patience: Duration,
    ) -> Result<Ticket, Trouble> {
        let handed = self.wait(tried, ALLOCATION_TIME, |console, _| {
            let Some(scanner) = console.scanner_mut() else { return Some(Err(NotTaken::OffLine)) };
            match scanner.request(mac, body, patience) {
                // It was lost and is being brought back; so is our controller after a bus-off.
                Err(NotTaken::NotRunning | NotTaken::Busy | NotTaken::OffLine)
                    if matches!(scanner.faulted(), None | Some(Fault::BusOff)) =>
                {
                    None
                }
                result => Some(result),
            }
        })?;
        match handed {
            Some(Ok(ticket)) => Ok(ticket),
            Some(Err(NotTaken::Length)) => Err(Trouble::new(
                Kind::Usage,
                tried,
                format!("a request of {} octets is longer than 64", body.len()),
                "give fewer octets",
            )),
            Some(Err(NotTaken::UnknownSlave)) => Err(troubles::not_open(tried, mac)),
            Some(Err(_)) | None => Err(self.no_answer(tried, mac)),
        }
    }

    /// Why there is no answer: the console itself may be at fault, or another master was quicker.
    pub(super) fn no_answer(&mut self, tried: &str, mac: MacId) -> Trouble {
        let console = self.console();
        if let Some(fault) = console.fault() {
            return troubles::fault(tried, fault, console.mac());
        }
        let state = console.scanner().and_then(|scanner| Some(scanner.slave(mac)?.state));
        match state {
            Some(SlaveState::Refused(refusal)) if troubles::is_ownership(refusal) => {
                let owner = console.overheard().node(mac).master;
                let owner = owner.map_or(Owner::Somebody, |(mac, _)| Owner::Master(mac.value()));
                self.owned(tried, mac, owner)
            }
            Some(SlaveState::Refused(refusal)) => troubles::not_allocated(tried, refusal),
            _ => troubles::gone(tried, mac),
        }
    }

    /// Get_Attribute_Single.
    pub(super) fn get(&mut self, tried: &str, mac: MacId, path: Path) -> Result<Answer, Trouble> {
        let Path { class, instance, attribute } = path;
        let body = [Service::GET_ATTRIBUTE_SINGLE.0, class, instance, attribute];
        self.ask(tried, mac, &body, ANSWER_TIME)
    }

    /// Set_Attribute_Single.
    pub(super) fn set(
        &mut self,
        tried: &str,
        mac: MacId,
        path: Path,
        data: &[u8],
    ) -> Result<Answer, Trouble> {
        let Path { class, instance, attribute } = path;
        let mut body = vec![Service::SET_ATTRIBUTE_SINGLE.0, class, instance, attribute];
        body.extend_from_slice(data);
        self.ask(tried, mac, &body, SET_TIME)
    }
}

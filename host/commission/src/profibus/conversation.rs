//! How a console behaves on a bus: it listens, joins, asks and leaves.

use codewheel_station::rs485::{BaudRate, Node};
use codewheel_station::{Duration, Instant};

use super::{
    Acyclic, Answer, Console, HIGHEST_ADDRESS, HeardMaster, Master, MasterSettings, ScanSettings,
    patient_slot,
};
use crate::{Kind, Progress, Seat, Trouble};

/// How long it is listened at least, and the bits after which every slave of a full bus was asked
/// once: 32 slaves take some 12 000.
const LISTENING: Duration = Duration::from_secs(1);
const LISTENING_BITS: u32 = 20_000;
/// How long the ring may take to admit another master: each searches its GAP now and then, one
/// address a rotation.
const ADMISSION: Duration = Duration::from_secs(10);
const ADMISSION_BITS: u32 = 400_000;
/// How long one station may take for something, the other stations' cycle in between.
const PATIENCE: Duration = Duration::from_secs(3);
const PATIENCE_BITS: u32 = 50_000;
/// After which time without us slaves let go. A person may have stopped this program for a moment;
/// what it serves loses nothing by it.
const WATCHDOG: Duration = Duration::from_secs(5);
/// How many stations are asked with one token by a master alone.
const IN_A_ROW: u8 = 8;
/// How long it is listened at least for a token where masters ask and none was heard yet: who serves
/// many slaves, or goes through them several times with one token, hands it on late.
const TOKEN: Duration = Duration::from_secs(5);
const TOKEN_BITS: u32 = 100_000;
/// How long a slave that exchanges data may say nothing until it counts as gone, besides some cycles.
const SILENCE: Duration = Duration::from_millis(1_900);
const SILENCE_BITS: u32 = 20_000;
const SILENT_CYCLES: u64 = 4;
/// A token on the line.
const TOKEN_CHARACTERS: u32 = 3;
/// How often progress is told while nothing happens.
const STEP: Duration = Duration::from_millis(100);

/// A seat with a console, and what people may want to hear of it.
#[derive(Debug)]
pub(super) struct Conversation<S> {
    pub(super) seat: S,
    pub(super) settings: ScanSettings,
    /// When it began to listen. What was heard before may be over.
    pub(super) since: Instant,
    notices: Vec<String>,
}

/// How long to listen before anybody speaks.
fn listening(rate: BaudRate) -> Duration {
    LISTENING + rate.bits(LISTENING_BITS)
}

impl<S: Seat<Station = Console>> Conversation<S> {
    pub(super) fn new(seat: S, settings: ScanSettings) -> Self {
        Self { since: seat.now(), seat, settings, notices: Vec::new() }
    }

    pub(super) fn console(&mut self) -> &mut Console {
        self.seat.station()
    }

    pub(super) fn rate(&mut self) -> BaudRate {
        self.console().baud_rate()
    }

    /// Until when one station may take for something that begins now.
    pub(super) fn patience(&mut self) -> Instant {
        let rate = self.rate();
        self.seat.now() + PATIENCE + rate.bits(PATIENCE_BITS)
    }

    /// Until when a slave that exchanged data up to now, once in a `cycle`, may say nothing: 2 s and
    /// four cycles from 187.5k on, 4 s at 9.6k.
    pub(super) fn silence(&mut self, cycle: Duration) -> Instant {
        let rate = self.rate();
        let cycles = cycle.as_nanos().saturating_mul(SILENT_CYCLES);
        self.seat.now() + SILENCE + rate.bits(SILENCE_BITS) + Duration::from_nanos(cycles)
    }

    pub(super) fn take_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notices)
    }

    pub(super) fn note(&mut self, notice: String) {
        self.notices.push(notice);
    }

    /// Lets time pass until `give` gives something; `None` where `until` comes first.
    pub(super) fn wait<T>(
        &mut self,
        until: Instant,
        mut give: impl FnMut(&mut Console, Instant) -> Option<T>,
    ) -> Result<Option<T>, Trouble> {
        loop {
            let now = self.seat.now();
            if let Some(given) = give(self.seat.station(), now) {
                return Ok(Some(given));
            }
            if now >= until {
                return Ok(None);
            }
            let notices = self.seat.turn(until).map_err(|error| {
                Trouble::new(Kind::Bus, "go on with the bus", error.to_string(), "")
            })?;
            self.notices.extend(notices.iter().map(ToString::to_string));
        }
    }

    /// Listens without a word, and tells how far it is.
    pub(super) fn listen(&mut self, progress: &mut dyn FnMut(Progress)) -> Result<(), Trouble> {
        let whole = listening(self.rate());
        let end = self.seat.now() + whole;
        loop {
            let left = end.since(self.seat.now());
            progress(Progress {
                doing: "listening".to_owned(),
                percent: percent(whole.as_nanos() - left.as_nanos(), whole.as_nanos()),
            });
            if left == Duration::ZERO {
                return Ok(());
            }
            let until = end.min(self.seat.now() + STEP);
            self.wait(until, |_, _| None::<()>)?;
        }
    }

    /// Other masters that were heard since it listens, by address.
    pub(super) fn masters(&mut self) -> Vec<u8> {
        let (own, since) = (self.settings.address, self.since);
        let masters = self.console().overheard().masters();
        let is_there =
            |(address, master): &(u8, &HeardMaster)| *address != own && master.at >= since;
        masters.filter(is_there).map(|(address, _)| address).collect()
    }

    /// Listens on where masters ask and none has handed on a token yet. Whoever looks for other masters
    /// has one, and is listened to for as long as the ring may take to admit another.
    ///
    /// A master that holds its token longer than that, or says nothing while it is listened, is not
    /// known as one of a ring: nobody joins it, which is the safe side.
    pub(super) fn listen_for_a_token(
        &mut self,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<(), Trouble> {
        let rate = self.rate();
        let mut percent_told = None;
        while !self.masters().is_empty() && !self.is_ring_heard() {
            let limit = if self.is_master_sought() {
                ADMISSION + rate.bits(ADMISSION_BITS)
            } else {
                TOKEN + rate.bits(TOKEN_BITS)
            };
            let (now, end) = (self.seat.now(), self.since + limit);
            if now >= end {
                break;
            }
            let percent = percent(now.since(self.since).as_nanos(), limit.as_nanos());
            if percent_told.replace(percent) != Some(percent) {
                progress(Progress { doing: "listening for a token".to_owned(), percent });
            }
            self.wait(end.min(now + STEP), |_, _| None::<()>)?;
        }
        Ok(())
    }

    /// Whether a master that was heard since it listens hands on a token.
    pub(super) fn is_ring_heard(&mut self) -> bool {
        self.is_any_master(HeardMaster::is_in_ring)
    }

    /// Whether a master that was heard since it listens looks for others.
    fn is_master_sought(&mut self) -> bool {
        self.is_any_master(|master| master.searches > 0)
    }

    fn is_any_master(&mut self, is_so: impl Fn(&HeardMaster) -> bool) -> bool {
        let there = self.masters();
        let overheard = self.console().overheard();
        overheard.masters().any(|(address, master)| there.contains(&address) && is_so(master))
    }

    /// The masters that were heard, in words: `master 2 is on the bus`.
    pub(super) fn masters_in_words(&mut self) -> String {
        match self.masters().as_slice() {
            [one] => format!("master {one} is on the bus"),
            others => format!("masters {} are on the bus", list(others)),
        }
    }

    /// What is said where masters ask and no token goes round.
    pub(super) fn no_token(&mut self) -> String {
        let tenths = self.seat.now().since(self.since).as_nanos() / 100_000_000;
        format!("no token was heard in {}.{} s", tenths / 10, tenths % 10)
    }

    /// Why nobody can take turns with the masters that were heard; `None` where a token goes round, or
    /// no master is there.
    pub(super) fn ring_trouble(&mut self, tried: &str) -> Option<Trouble> {
        if self.masters().is_empty() || self.is_ring_heard() {
            return None;
        }
        let came = format!("{}, and {}", self.masters_in_words(), self.no_token());
        let remedy = "nobody can take turns where no token goes round: listen alone, or take that \
                      master off the bus";
        Some(Trouble::new(Kind::Bus, tried, came, remedy))
    }

    /// Why the own address cannot be used, after listening.
    pub(super) fn address_trouble(&mut self, tried: &str) -> Option<Trouble> {
        let own = self.settings.address;
        if own > HIGHEST_ADDRESS {
            let came = format!("master address {own} does not exist");
            return Some(Trouble::new(Kind::Usage, tried, came, "station addresses are 0 to 125"));
        }
        let overheard = self.console().overheard();
        let is_taken = overheard.masters().any(|(address, _)| address == own)
            || overheard.slave(own).is_some();
        is_taken.then(|| {
            Trouble::new(
                Kind::Bus,
                tried,
                format!("a station on the bus has address {own} already"),
                "give this master another address",
            )
        })
    }

    /// What no rate of ours can understand.
    pub(super) fn gibberish_trouble(&mut self, tried: &str) -> Option<Trouble> {
        let rate = self.rate();
        let overheard = self.console().overheard();
        overheard.is_gibberish().then(|| {
            Trouble::new(
                Kind::Bus,
                tried,
                gibberish(overheard.octets(), rate),
                "try another rate; if none fits, the two lines may be crossed",
            )
        })
    }

    /// Becomes a master and takes part in the ring, or makes one.
    pub(super) fn join(&mut self, tried: &str) -> Result<(), Trouble> {
        let others = self.masters();
        let rate = self.rate();
        let settings = MasterSettings {
            slot_bits: Some(self.settings.slot_bits.unwrap_or_else(|| patient_slot(rate))),
            watchdog: Some(WATCHDOG),
            ..MasterSettings::new(self.settings.address, rate)
        };
        let usage =
            |error: super::SettingsError| Trouble::new(Kind::Usage, tried, error.to_string(), "");
        let own = settings.address;
        let lost = u32::from(settings.slot()).saturating_mul(6 + 2 * u32::from(own));
        self.console().speak(settings).map_err(usage)?;
        let limit = ADMISSION + rate.bits(ADMISSION_BITS) + rate.bits(lost);
        let until = self.seat.now() + limit;
        let is_in = |console: &mut Console, _| {
            console.master().is_some_and(Master::is_in_ring).then_some(())
        };
        let is_in = self.wait(until, is_in);
        if !matches!(is_in, Ok(Some(()))) {
            self.abandon();
        }
        if is_in?.is_none() {
            let came = match others.as_slice() {
                [] => "the bus is never silent, and no master hands the token on".to_owned(),
                [one] => format!("master {one} does not admit master {own} to its ring"),
                _ => format!("masters {} do not admit master {own} to their ring", list(&others)),
            };
            let remedy = if own == 0 {
                "it may look for others rarely or not at all: see its HSA and its GAP factor"
            } else {
                "give this master a lower address: others are looked for below HSA alone"
            };
            return Err(Trouble::new(Kind::TimeOut, tried, came, remedy));
        }
        if others.is_empty()
            && let Some(master) = self.console().master_mut()
        {
            master.ask_in_a_row(IN_A_ROW);
        }
        Ok(())
    }

    /// Asks one station and waits for what it says.
    pub(super) fn ask(
        &mut self,
        tried: &str,
        address: u8,
        request: Acyclic,
    ) -> Result<Answer, Trouble> {
        let until = self.patience();
        let Some(master) = self.console().master_mut() else { return Ok(Answer::Silence) };
        master
            .ask(address, request)
            .map_err(|error| Trouble::new(Kind::Usage, tried, error.to_string(), ""))?;
        let answer = self.wait(until, |console, _| {
            let answered = console.master_mut()?.take_answer()?;
            (answered.address == address && answered.request == request).then_some(answered.answer)
        })?;
        Ok(answer.unwrap_or(Answer::Silence))
    }

    /// Leaves the bus, whatever went wrong before: that is what there is to hear of.
    pub(super) fn abandon(&mut self) {
        let _ = self.leave();
    }

    /// Hands the token on and falls silent, once the token is out.
    pub(super) fn leave(&mut self) -> Result<(), Trouble> {
        let until = self.patience();
        self.console().leave();
        self.wait(until, |console, _| console.master().is_none().then_some(()))?;
        let out = self.rate().characters(TOKEN_CHARACTERS);
        let until = self.seat.now() + out;
        self.wait(until, |_, _| None::<()>)?;
        Ok(())
    }
}

/// How much of a hundred `done` is of `whole`.
pub(super) fn percent(done: u64, whole: u64) -> u8 {
    let percent = done.saturating_mul(100).checked_div(whole).unwrap_or(100);
    u8::try_from(percent.min(100)).unwrap_or(100)
}

/// What is said of octets that make no telegram.
pub(super) fn gibberish(octets: u64, rate: BaudRate) -> String {
    format!(
        "of {octets} octets heard none makes a telegram at {rate}: the bus runs at another rate"
    )
}

/// Addresses as people write them: `2, 4 and 9`.
pub(super) fn list(addresses: &[u8]) -> String {
    let mut text = String::new();
    for (place, address) in addresses.iter().enumerate() {
        let before = match place {
            0 => "",
            _ if place + 1 == addresses.len() => " and ",
            _ => ", ",
        };
        text.push_str(before);
        text.push_str(&address.to_string());
    }
    text
}

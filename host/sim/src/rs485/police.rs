//! The rules of the line, and who breaks them (EN 50170-2).

use codewheel_station::rs485::BaudRate;

use super::telegram::Telegram;

/// Bits that the line is idle before a request: T_SYN.
const SYNCHRONIZATION: u32 = 33;
/// The shortest station delay, min T_SDR, in bits.
const LEAST_STATION_DELAY: u32 = 11;
/// A master that lost the token waits at least this many slot times (T_TO = 6·T_SL + 2·n·T_SL).
const TIME_OUT_SLOTS: u32 = 6;
/// Instants are whole nanoseconds, and each may be rounded up.
const ROUNDING: u64 = 1;
/// What a station with a microsecond clock is granted.
pub(super) const MICROSECOND_CLOCK: u64 = 2_000;

/// A station that begins to speak.
pub(super) struct Speaker<'a> {
    pub(super) slot: usize,
    pub(super) name: &'a str,
    pub(super) octets: &'a [u8],
    pub(super) rate: BaudRate,
    pub(super) begin: u64,
    /// How far its clock may be wrong.
    pub(super) grant: u64,
    /// Whether it begins within a character of another station.
    pub(super) interrupts: bool,
}

/// What is known of the line from what has been said.
#[derive(Debug, Default)]
pub(super) struct Police {
    /// The end of the last character; `None` while nothing has been said.
    idle_since: Option<u64>,
    asked: Option<Asked>,
    master: Option<Master>,
    /// Who has said something that was not a whole telegram, and when that ended.
    unfinished: Option<(usize, u64)>,
}

#[derive(Debug)]
struct Asked {
    address: u8,
    by: u8,
    end: u64,
    /// The name of the station that answers.
    answering: Option<String>,
}

/// Who may send requests: the master with the token, or the one that spoke where none was ever
/// seen.
#[derive(Debug)]
struct Master {
    address: u8,
    /// Who handed it the token, and may do so again until the new master has spoken.
    handed_by: Option<u8>,
}

impl Police {
    /// Judges a station that begins to speak: the rules it breaks, and whether it had the right to
    /// command if that is what it does.
    pub(super) fn begins(&mut self, speaker: &Speaker<'_>) -> (Vec<String>, bool) {
        let mut broken = Vec::new();
        let mut rightful = true;
        match Telegram::read(speaker.octets) {
            None => broken.push(self.no_telegram(speaker)),
            Some(Telegram::Acknowledge) => broken.extend(self.answer(speaker, None)),
            Some(Telegram::Answer { to, from }) => {
                broken.extend(self.answer(speaker, Some((to, from))));
            }
            Some(Telegram::Request { from, .. }) => {
                broken.extend(self.request(speaker));
                let unentitled = self.unentitled(speaker, from, false);
                rightful = unentitled.is_none();
                broken.extend(unentitled);
            }
            Some(Telegram::Token { from, .. }) => {
                broken.extend(self.request(speaker));
                let unentitled = self.unentitled(speaker, from, true);
                rightful = unentitled.is_none();
                broken.extend(unentitled);
            }
        }
        (broken, rightful)
    }

    /// A character has ended.
    pub(super) fn character_ended(&mut self, end: u64) {
        self.idle_since = Some(end);
    }

    /// A telegram has ended. `carried` is what the line carried, `None` where a character was broken
    /// or a pause came between.
    pub(super) fn ended(&mut self, slot: usize, end: u64, carried: Option<&[u8]>, rightful: bool) {
        self.asked = None;
        self.unfinished = None;
        match carried.map(Telegram::read) {
            Some(None) => self.unfinished = Some((slot, end)),
            Some(Some(Telegram::Request { to, from, asks })) => {
                if asks {
                    self.asked = Some(Asked { address: to, by: from, end, answering: None });
                }
                if rightful {
                    self.master = Some(Master { address: from, handed_by: None });
                }
            }
            Some(Some(Telegram::Token { to, from })) if rightful => {
                self.master = Some(Master { address: to, handed_by: Some(from) });
            }
            Some(Some(_)) | None => {}
        }
    }

    fn no_telegram(&self, speaker: &Speaker<'_>) -> String {
        let whole = hexadecimal(speaker.octets);
        if let Some((slot, end)) = self.unfinished {
            let pause = speaker.begin.saturating_sub(end);
            let inside = ROUNDING < pause && pause < nanos(speaker.rate, SYNCHRONIZATION);
            if slot == speaker.slot && inside {
                let bits = in_bits(speaker.rate, pause);
                return format!("pauses for {bits} bits inside a telegram, before {whole}");
            }
        }
        format!("sends {whole}, which is no whole telegram")
    }

    fn answer(&mut self, speaker: &Speaker<'_>, route: Option<(u8, u8)>) -> Option<String> {
        let octets = hexadecimal(speaker.octets);
        let Some(asked) = self.asked.as_mut() else {
            return Some(format!("answers {octets} without having been asked"));
        };
        let Asked { address, by, end, .. } = *asked;
        if let Some(first) = &asked.answering {
            return Some(format!(
                "answers the request to address {address} while {first} answers it: each address \
                 belongs to one station"
            ));
        }
        if let Some((to, from)) = route.filter(|&route| route != (by, address)) {
            return Some(format!(
                "answers {octets} as address {from} to {to}, but {by} has asked {address}"
            ));
        }
        asked.answering = Some(speaker.name.to_owned());
        let (delay, slack) = (speaker.begin.saturating_sub(end), ROUNDING + speaker.grant);
        let bits = in_bits(speaker.rate, delay);
        if delay + slack < nanos(speaker.rate, LEAST_STATION_DELAY) {
            return Some(format!(
                "answers {bits} bits after the request: min T_SDR is {LEAST_STATION_DELAY}"
            ));
        }
        let longest = speaker.rate.longest_station_delay();
        (delay > nanos(speaker.rate, longest) + slack).then(|| {
            format!(
                "answers {bits} bits after the request: max T_SDR is {longest} at {}",
                speaker.rate
            )
        })
    }

    /// How long the line has been idle; `None` where nothing has been said yet.
    fn idle(&self, speaker: &Speaker<'_>) -> Option<u64> {
        if speaker.interrupts {
            return Some(0);
        }
        self.idle_since.map(|since| speaker.begin.saturating_sub(since))
    }

    fn request(&self, speaker: &Speaker<'_>) -> Option<String> {
        let idle = self.idle(speaker)?;
        let slack = ROUNDING + speaker.grant;
        (idle + slack < nanos(speaker.rate, SYNCHRONIZATION)).then(|| {
            let bits = in_bits(speaker.rate, idle);
            let octets = hexadecimal(speaker.octets);
            format!(
                "begins {octets} after {bits} idle bits: {SYNCHRONIZATION} precede a request or a \
                 token"
            )
        })
    }

    /// Nobody holds a token for ever: after a silence that no living master keeps, anybody may
    /// speak. How long that is depends on the slot time, which the line does not know, but which is
    /// no shorter than max T_SDR.
    fn unentitled(&self, speaker: &Speaker<'_>, from: u8, token: bool) -> Option<String> {
        let Master { address, handed_by } = self.master.as_ref()?;
        let long = nanos(speaker.rate, TIME_OUT_SLOTS * speaker.rate.longest_station_delay());
        let silent = self.idle(speaker)? + ROUNDING + speaker.grant >= long;
        let entitled = *address == from || silent || token && *handed_by == Some(from);
        (!entitled).then(|| {
            let octets = hexadecimal(speaker.octets);
            format!("sends {octets} as master {from}, while master {address} has the line")
        })
    }
}

fn nanos(rate: BaudRate, bits: u32) -> u64 {
    rate.bits(bits).as_nanos()
}

/// How many whole bits last so long.
fn in_bits(rate: BaudRate, nanos: u64) -> u128 {
    u128::from(nanos + ROUNDING) * u128::from(rate.bits_per_second()) / 1_000_000_000
}

fn hexadecimal(octets: &[u8]) -> String {
    let octets: Vec<String> = octets.iter().map(|octet| format!("{octet:02X}")).collect();
    octets.join(" ")
}

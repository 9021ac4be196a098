//! Watching an encoder as its master: polls for the position, and now and then a question for the
//! flags where polls do not bring them.

use codewheel_devicenet::MacId;
use codewheel_devicenet::explicit::{Path, class};
use codewheel_devicenet::scanner::PollSettings;
use codewheel_station::{Duration, Instant};

use super::console::Console;
use super::dialogue::{Answer, Dialogue};
use super::eavesdropper::{no_position, of_octets};
use super::troubles;
use crate::{Sample, Seat, Trouble};

/// How long a position may take: the scanner gives a slave up after 800 ms, and brings it back.
const PATIENCE: Duration = Duration::from_secs(6);
/// How the encoder is polled.
const POLL: PollSettings = PollSettings { expected_packet_rate: 200, assembly: None };
/// How old flags may become that polls do not bring.
const FLAGS_AGE: Duration = Duration::from_millis(500);
/// The assembly of position and flags, and its data.
const POSITION_AND_FLAGS: Path = Path { class: class::ASSEMBLY, instance: 2, attribute: 3 };

/// The poll connection to a slave, while it is watched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watch {
    /// When the newest position came that was given.
    seen: Option<Instant>,
    /// Positions up to this moment may be from before a change.
    changed: Option<Instant>,
    /// The flags of an explicit message, alarm and warning, and when they came.
    flags: Option<(Instant, Option<bool>, Option<bool>)>,
}

impl Watch {
    /// Allocates the poll connection besides the explicit one, which stays: a slave that was released
    /// in between could be taken by another master.
    ///
    /// Which assembly is polled stays as the device has kept it: to choose the one with flags would
    /// write its memory.
    pub(super) fn begin<S: Seat<Station = Console>>(
        dialogue: &mut Dialogue<S>,
        tried: &str,
        mac: MacId,
    ) -> Result<Self, Trouble> {
        dialogue.begin_polling(tried, mac, POLL)?;
        Ok(Self { seen: None, changed: None, flags: None })
    }

    /// Goes back to the explicit connection alone.
    pub(super) fn end<S: Seat<Station = Console>>(
        dialogue: &mut Dialogue<S>,
        tried: &str,
        mac: MacId,
    ) -> Result<(), Trouble> {
        dialogue.end_polling(tried, mac)
    }

    /// Something was changed until `now`: positions that came before are not given any more.
    pub(super) const fn change(&mut self, now: Instant) {
        self.changed = Some(now);
    }

    /// The next position.
    pub(super) fn sample<S: Seat<Station = Console>>(
        &mut self,
        dialogue: &mut Dialogue<S>,
        tried: &str,
        mac: MacId,
    ) -> Result<Sample, Trouble> {
        let (seen, changed) = (self.seen, self.changed);
        let newer = dialogue.wait(tried, PATIENCE, |console, _| {
            let slave = console.scanner()?.slave(mac)?;
            let at = slave.input_at.filter(|at| Some(*at) > seen && Some(*at) > changed)?;
            Some((at, slave.input.to_vec()))
        })?;
        let Some((at, octets)) = newer else { return Err(dialogue.no_answer(tried, mac)) };
        let cycle = seen.map(|seen| at.since(seen).as_nanos());
        self.seen = Some(at);
        let Some(mut sample) = of_octets(at, &octets, cycle) else {
            return Err(no_position(tried, octets.len()));
        };
        if sample.alarm.is_none() {
            (sample.alarm, sample.warning) = self.flags(dialogue, tried, mac)?;
        }
        Ok(sample)
    }

    fn flags<S: Seat<Station = Console>>(
        &mut self,
        dialogue: &mut Dialogue<S>,
        tried: &str,
        mac: MacId,
    ) -> Result<(Option<bool>, Option<bool>), Trouble> {
        let now = dialogue.now();
        if let Some((at, alarm, warning)) = self.flags
            && now.since(at) < FLAGS_AGE
        {
            return Ok((alarm, warning));
        }
        let flags = match dialogue.get(tried, mac, POSITION_AND_FLAGS)? {
            Answer::Done(octets) => of_octets(now, &octets, None),
            Answer::Refused(_) | Answer::TooLong => None,
        };
        let (alarm, warning) = flags.map_or((None, None), |it| (it.alarm, it.warning));
        self.flags = Some((dialogue.now(), alarm, warning));
        Ok((alarm, warning))
    }
}

/// The position and the flags of this moment, by an explicit message.
pub(super) fn ask<S: Seat<Station = Console>>(
    dialogue: &mut Dialogue<S>,
    tried: &str,
    mac: MacId,
) -> Result<Sample, Trouble> {
    match dialogue.get(tried, mac, POSITION_AND_FLAGS)? {
        Answer::Done(octets) => {
            of_octets(dialogue.now(), &octets, None).ok_or_else(|| no_position(tried, octets.len()))
        }
        Answer::Refused(error) => Err(troubles::refused(tried, error)),
        Answer::TooLong => Err(no_position(tried, 256)),
    }
}

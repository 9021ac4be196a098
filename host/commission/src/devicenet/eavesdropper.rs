//! The positions of an encoder that another master asks, without taking part.

use codewheel_devicenet::MacId;
use codewheel_station::{Duration, Instant};

use super::console::Console;
use super::dialogue::Dialogue;
use super::overheard::Production;
use crate::{Kind, Owner, Sample, Seat, Trouble};

/// How long the next production may take.
const PATIENCE: Duration = Duration::from_secs(10);

/// Assembly 2, octet 4.
const ALARM_FLAG: u8 = 1 << 0;
const WARNING_FLAG: u8 = 1 << 1;

/// Hears what an encoder produces for its own master, and sends nothing.
///
/// Four octets are taken for a position, five for a position and flags: assemblies 1 and 2 of our
/// encoders (AMG manual §6). Nobody on the bus says so; see that the device is one of ours.
#[derive(Debug)]
pub struct Eavesdropper<S> {
    dialogue: Dialogue<S>,
    mac: MacId,
    heard_at: Instant,
}

impl<S: Seat<Station = Console>> Eavesdropper<S> {
    /// Listens to the encoder at `mac`. Whether it produces shows with the first
    /// [`sample`](Self::sample).
    pub fn new(seat: S, mac: MacId) -> Self {
        let heard_at = seat.now();
        Self { dialogue: Dialogue::new(seat), mac, heard_at }
    }

    /// Its address.
    #[must_use]
    pub const fn address(&self) -> u8 {
        self.mac.value()
    }

    /// The seat's time now.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.dialogue.now()
    }

    /// To whom it belongs, by what was heard so far; `None` where nothing says that it belongs to
    /// anybody.
    pub fn owner(&mut self) -> Option<Owner> {
        let (now, mac) = (self.dialogue.now(), self.mac);
        self.dialogue.console().owner(now, mac)
    }

    /// The next position: waits for one that is newer than that of the call before.
    ///
    /// # Errors
    /// [`Trouble`]: nothing was produced for ten seconds, or something else than a position.
    pub fn sample(&mut self) -> Result<Sample, Trouble> {
        let (mac, heard_at) = (self.mac, self.heard_at);
        let tried = format!("watch the encoder at MAC ID {mac}");
        let newer = self.dialogue.wait(&tried, PATIENCE, |console, _| {
            let heard = console.overheard().node(mac);
            let production = heard.production.filter(|it| it.at > heard_at)?;
            let pauses = if heard.polls.count > 1 { heard.polls } else { heard.productions };
            Some((production, (pauses.count > 1).then(|| pauses.last.as_nanos())))
        })?;
        let Some((production, cycle)) = newer else {
            return Err(Trouble::new(
                Kind::TimeOut,
                tried,
                "it produced nothing for ten seconds",
                "see that its master polls it; where nobody does, watch it as its master",
            ));
        };
        self.heard_at = production.at;
        let sample = of_production(&production, cycle);
        sample.ok_or_else(|| no_position(&tried, production.octets().len()))
    }

    /// What happened on the port meanwhile, for people.
    pub fn take_notices(&mut self) -> Vec<String> {
        self.dialogue.take_notices()
    }
}

/// It produces something else.
pub(super) fn no_position(tried: &str, octets: usize) -> Trouble {
    Trouble::new(
        Kind::Refused,
        tried,
        format!("it produces {octets} octets: neither a position (4) nor one with flags (5)"),
        "see with a scan what it is",
    )
}

/// The position that a production carries; `None` where its length is that of none.
pub(super) fn of_production(production: &Production, cycle: Option<u64>) -> Option<Sample> {
    of_octets(production.at, production.octets(), cycle)
}

/// The position in the octets of assembly 1 or 2.
pub(super) fn of_octets(at: Instant, octets: &[u8], cycle: Option<u64>) -> Option<Sample> {
    let (position, flags) = match *octets {
        [a, b, c, d] => ([a, b, c, d], None),
        [a, b, c, d, flags] => ([a, b, c, d], Some(flags)),
        _ => return None,
    };
    Some(Sample {
        at,
        position: u32::from_le_bytes(position),
        alarm: flags.map(|flags| flags & ALARM_FLAG != 0),
        warning: flags.map(|flags| flags & WARNING_FLAG != 0),
        cycle,
    })
}

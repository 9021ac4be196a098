//! An encoder that another master asks, watched without a word.

use codewheel_station::Instant;

use super::conversation::{Conversation, list};
use super::identity::Told;
use super::{Console, CycleTimes, HeardSlave, Overheard, ScanSettings};
use crate::{Identity, Kind, Progress, Sample, Seat, Trouble};

/// Watches the exchange of data of one slave with its master, and sends nothing, ever.
#[derive(Debug)]
pub struct Eavesdropper<S> {
    conversation: Conversation<S>,
    address: u8,
    last: Instant,
}

impl<S: Seat<Station = Console>> Eavesdropper<S> {
    /// Listens whether a master exchanges data with the slave at `address`.
    ///
    /// # Errors
    /// [`Trouble`]: nobody does, or the bus cannot be understood.
    pub fn open(seat: S, address: u8, progress: &mut dyn FnMut(Progress)) -> Result<Self, Trouble> {
        let tried = format!("watch the slave at address {address}");
        let mut conversation = Conversation::new(seat, ScanSettings::default());
        conversation.listen(progress)?;
        if let Some(trouble) = conversation.gibberish_trouble(&tried) {
            return Err(trouble);
        }
        let since = conversation.since;
        let masters = conversation.masters();
        let slave = conversation.console().overheard().slave(address);
        let exchange = slave.and_then(|slave| slave.exchange.as_ref());
        if exchange.is_some_and(|exchange| exchange.at >= since) {
            return Ok(Self { conversation, address, last: since });
        }
        let came = match masters.as_slice() {
            [] => "no master is on the bus".to_owned(),
            [one] => format!("master {one} is on the bus and exchanges no data with it"),
            _ => format!("masters {} are on the bus and exchange no data with it", list(&masters)),
        };
        let remedy = "open a session with it, which needs a master of its own";
        Err(Trouble::new(Kind::Bus, tried, came, remedy))
    }

    /// What was overheard of the slave.
    pub fn heard(&mut self) -> Option<&HeardSlave> {
        let address = self.address;
        self.conversation.console().overheard().slave(address)
    }

    /// Who the slave is, where its diagnosis was overheard.
    pub fn identify(&mut self) -> Option<Identity> {
        self.heard()?.diagnosis.as_ref().map(super::Diagnosis::identity)
    }

    /// The next position that the slave gives its master.
    ///
    /// # Errors
    /// [`Trouble`]: none comes any more.
    pub fn sample(&mut self) -> Result<Sample, Trouble> {
        let (address, last) = (self.address, self.last);
        let cycles = cycles(self.conversation.console().overheard(), address);
        let until = self.conversation.silence(cycles.mean());
        let newer = |console: &mut Console, _| {
            let slave = console.overheard().slave(address)?;
            sample_of(slave).filter(|sample| sample.at > last)
        };
        let sample = self.conversation.wait(until, newer)?.ok_or_else(|| {
            Trouble::new(
                Kind::TimeOut,
                format!("watch the slave at address {address}"),
                "its master asks it no more",
                "look whether master and slave are on the bus: scan",
            )
        })?;
        self.last = sample.at;
        Ok(sample)
    }

    /// What happened on the port meanwhile, for people.
    pub fn take_notices(&mut self) -> Vec<String> {
        self.conversation.take_notices()
    }
}

/// The position in the latest inputs of a slave that somebody else serves.
pub(super) fn sample_of(slave: &HeardSlave) -> Option<Sample> {
    let exchange = slave.exchange.as_ref()?;
    let told = slave.diagnosis.as_ref().map(|diagnosis| Told { diagnosis });
    Some(Sample {
        at: exchange.at,
        position: position(&exchange.inputs)?,
        alarm: told.and_then(Told::alarm),
        warning: told.and_then(Told::warning),
        cycle: (exchange.cycle.count > 0).then(|| exchange.cycle.last.as_nanos()),
    })
}

/// The cycle in which a slave is asked that somebody else serves; nothing before it was asked twice.
pub(super) fn cycles(overheard: &Overheard, address: u8) -> CycleTimes {
    let exchange = overheard.slave(address).and_then(|slave| slave.exchange.as_ref());
    exchange.map(|exchange| exchange.cycle).unwrap_or_default()
}

/// The position in two or four octets, the high one first; of two it is the low word.
pub(super) fn position(inputs: &[u8]) -> Option<u32> {
    match inputs {
        [high, low] => Some(u16::from_be_bytes([*high, *low]).into()),
        octets => Some(u32::from_be_bytes(octets.try_into().ok()?)),
    }
}

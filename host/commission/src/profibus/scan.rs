//! Who is on a bus.

use std::collections::BTreeMap;

use codewheel_device::product::Bus;
use codewheel_station::Duration;

use super::conversation::{Conversation, gibberish, percent};
use super::identity::Told;
use super::{
    Acyclic, Answer, Answered, Console, Diagnosis, HIGHEST_ADDRESS, HeardSlave, Overheard,
    StationKind,
};
use crate::{Found, Identity, Kind, Owner, Progress, Role, Seat, Survey, Trouble};

/// How a bus is scanned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanSettings {
    /// The station address of the master that asks, 0 … 125. Nobody on the bus may have it.
    pub address: u8,
    /// Whether to take part in a ring of other masters. It costs them up to two slot times in each
    /// rotation of the token, while it is looked for stations that are not there.
    pub join: bool,
    /// The slot time in bits; `None` for [`patient_slot`](super::patient_slot), which ports of a PC
    /// need.
    pub slot_bits: Option<u16>,
}

impl Default for ScanSettings {
    /// Master 0, the address of programming devices, which does not join others.
    fn default() -> Self {
        Self { address: 0, join: false, slot_bits: None }
    }
}

/// Looks who is on the bus.
///
/// It listens first, a second or longer where the bus is slow. Where it hears a master and is not
/// told to [`join`](ScanSettings::join), it sends nothing: the survey is what was overheard. Otherwise
/// it asks every address for its FDL status and every slave for its diagnosis, which disturbs no
/// exchange of data, and is gone again from the ring.
///
/// Where masters ask and none hands on a token, it listens for 5 s and 100 000 bits, 15 s at 9.6k; 10 s
/// and 400 000 bits where one looks for others. A master without token cannot be joined: its pauses
/// are no lost token. One that holds its token longer, or says nothing for a second, is not known for
/// what it is; listen longer before, where there may be such.
///
/// # Errors
/// [`Trouble`]: the bus is lost, nobody is there, the own address is taken, no token goes round that
/// could be shared, or the ring does not admit another master.
pub fn scan(
    seat: &mut impl Seat<Station = Console>,
    settings: ScanSettings,
    progress: &mut dyn FnMut(Progress),
) -> Result<Survey, Trouble> {
    let mut conversation = Conversation::new(seat, settings);
    conversation.listen(progress)?;
    conversation.listen_for_a_token(progress)?;
    let mut remarks = Vec::new();
    let mut asked = BTreeMap::new();
    let masters = conversation.masters();
    let rate = conversation.rate();
    let overheard = conversation.console().overheard();
    let is_gibberish = overheard.is_gibberish();
    if is_gibberish {
        remarks.push(format!(
            "{}; nothing was asked, since that would disturb it: try another rate",
            gibberish(overheard.octets(), rate)
        ));
    } else if overheard.broken() > 0 {
        let (broken, telegrams) = (overheard.broken(), overheard.telegrams());
        remarks.push(format!(
            "{broken} telegrams were broken, {telegrams} were not: look at termination and wiring"
        ));
    }
    if !masters.is_empty() && !settings.join {
        let are = conversation.masters_in_words();
        let they = if masters.len() == 1 { "it" } else { "them" };
        let further = if conversation.is_ring_heard() {
            format!("to take turns with {they} and ask every address, join the ring (--join)")
        } else {
            format!("{}, so nobody can take turns with {they}", conversation.no_token())
        };
        remarks.push(format!("{are}, so nothing was asked: this is what was overheard; {further}"));
    } else if !is_gibberish {
        asked = ask_all(&mut conversation, progress)?;
        let console = conversation.console();
        if asked.is_empty() && console.overheard().octets() == 0 {
            let came =
                format!("nobody was heard at {rate}, and none of the 125 other addresses answered");
            let remedy = "look at supply, wiring, termination and rate";
            return Err(Trouble::new(Kind::Bus, "scan the bus", came, remedy));
        }
    }
    remarks.append(&mut conversation.take_notices());
    let nodes = nodes(conversation.console().overheard(), &asked, settings.address);
    Ok(Survey { bus: Bus::Profibus, nodes, remarks })
}

/// How often in a scan a slave that has just answered is asked for its diagnosis again.
const AGAIN: u32 = 32;

/// What a station said when it was asked.
#[derive(Clone, Debug)]
struct Said {
    kind: StationKind,
    diagnosis: Option<Diagnosis>,
}

/// Asks every address.
fn ask_all<S: Seat<Station = Console>>(
    conversation: &mut Conversation<S>,
    progress: &mut dyn FnMut(Progress),
) -> Result<BTreeMap<u8, Said>, Trouble> {
    let tried = "scan the bus";
    if let Some(trouble) = conversation.address_trouble(tried) {
        return Err(trouble);
    }
    if let Some(trouble) = conversation.ring_trouble(tried) {
        return Err(trouble);
    }
    conversation.join(tried)?;
    let asked = ask_each(conversation, progress);
    let left = conversation.leave();
    let (all, done, open) = asked?;
    left?;
    if done == open {
        return Ok(all);
    }
    let came = format!("the token did not come back after {done} of {open} requests");
    let remedy = "try again; on a busy line try another master address";
    Err(Trouble::new(Kind::TimeOut, tried, came, remedy))
}

/// Asks every address while it has the token; what they said, and how many of how many requests were
/// answered or given up.
fn ask_each<S: Seat<Station = Console>>(
    conversation: &mut Conversation<S>,
    progress: &mut dyn FnMut(Progress),
) -> Result<(BTreeMap<u8, Said>, u64, u64), Trouble> {
    let own = conversation.settings.address;
    let addresses = (0..=HIGHEST_ADDRESS).filter(|address| *address != own);
    let mut open = 0;
    if let Some(master) = conversation.console().master_mut() {
        for address in addresses {
            // They are all possible.
            open += u64::from(master.ask(address, Acyclic::FdlStatus).is_ok());
        }
    }
    let (mut done, mut again) = (0, AGAIN);
    let mut all: BTreeMap<u8, Said> = BTreeMap::new();
    while done < open {
        let until = conversation.patience();
        let answer = |console: &mut Console, _| console.master_mut()?.take_answer();
        let Some(answered) = conversation.wait(until, answer)? else { break };
        done += 1;
        let Answered { address, request, answer } = answered;
        match answer {
            // It was there a moment ago: on a PC that is busy an answer may come after its slot.
            Answer::Silence if request == Acyclic::Diagnosis && again > 0 => {
                again -= 1;
                if let Some(master) = conversation.console().master_mut() {
                    open += u64::from(master.ask(address, request).is_ok());
                }
            }
            Answer::Station(kind) => {
                all.insert(address, Said { kind, diagnosis: None });
                if kind == StationKind::Slave
                    && let Some(master) = conversation.console().master_mut()
                {
                    open += u64::from(master.ask(address, Acyclic::Diagnosis).is_ok());
                }
            }
            Answer::Diagnosis(diagnosis) => {
                if let Some(said) = all.get_mut(&address) {
                    said.diagnosis = Some(diagnosis);
                }
            }
            _ => {}
        }
        progress(Progress {
            doing: format!("asked address {address}"),
            percent: percent(done, open),
        });
    }
    Ok((all, done, open))
}

/// Everybody who was heard, or answered.
fn nodes(overheard: &Overheard, asked: &BTreeMap<u8, Said>, own: u8) -> Vec<Found> {
    let mut nodes = BTreeMap::new();
    for (address, slave) in overheard.slaves() {
        let kind = asked.get(&address).map(|said| said.kind).or(slave.kind);
        nodes.insert(address, found_slave(address, kind, Some(slave), None));
    }
    for (address, said) in asked {
        let heard = overheard.slave(*address);
        nodes.insert(
            *address,
            found_slave(*address, Some(said.kind), heard, said.diagnosis.as_ref()),
        );
    }
    for (address, master) in overheard.masters() {
        let rotation = master.rotation;
        let state = match (master.tokens, rotation.count) {
            (0, _) if master.searches > 0 => "looks for others, no token was heard".to_owned(),
            (0, _) => "asks without a token".to_owned(),
            (_, 0) => "in the ring".to_owned(),
            _ => format!(
                "in the ring, a token takes {} ms, {} ms at most",
                milliseconds(rotation.mean()),
                milliseconds(rotation.longest)
            ),
        };
        nodes.insert(
            address,
            Found { address, role: Role::Master, identity: None, owner: None, lamp: None, state },
        );
    }
    nodes.remove(&own);
    nodes.into_values().collect()
}

fn found_slave(
    address: u8,
    kind: Option<StationKind>,
    heard: Option<&HeardSlave>,
    diagnosis: Option<&Diagnosis>,
) -> Found {
    let role = match kind {
        Some(StationKind::Slave) | None => Role::Slave,
        Some(_) => Role::Master,
    };
    if role == Role::Master {
        let state =
            if kind == Some(StationKind::MasterInRing) { "in the ring" } else { "not in the ring" };
        let state = state.to_owned();
        return Found { address, role, identity: None, owner: None, lamp: None, state };
    }
    let diagnosis = diagnosis.or_else(|| heard?.diagnosis.as_ref());
    let exchange = heard.and_then(|heard| heard.exchange.as_ref());
    let mut state = match (diagnosis, exchange) {
        (Some(diagnosis), None) => diagnosis.state().to_owned(),
        (_, Some(exchange)) => match exchange.cycle.count {
            0 => "exchanges data".to_owned(),
            _ => format!("exchanges data, {} ms cycle", milliseconds(exchange.cycle.mean())),
        },
        (None, None) => "answers".to_owned(),
    };
    if let Some(in_force) = diagnosis.and_then(|diagnosis| Told { diagnosis }.in_force()) {
        state.push_str("; ");
        state.push_str(&in_force);
    }
    // What was overheard of an exchange is later than the diagnosis before it.
    let owner = exchange
        .map(|exchange| Owner::Master(exchange.master))
        .or_else(|| diagnosis.map(Diagnosis::owner));
    Found {
        address,
        role,
        identity: diagnosis.map(Diagnosis::identity).or_else(|| heard.and_then(parameterized)),
        owner,
        lamp: diagnosis.and_then(Diagnosis::lamp),
        state,
    }
}

/// Who a slave is by the parameters that it took from its master.
fn parameterized(heard: &HeardSlave) -> Option<Identity> {
    let octets = heard.parameters.as_ref().filter(|sent| sent.confirmed)?.octets.get(4..6)?;
    let product_code = u16::from_be_bytes(octets.try_into().ok()?);
    Some(Identity { product_code, ..Identity::default() })
}

/// Milliseconds with two decimals.
fn milliseconds(time: Duration) -> String {
    let hundredths = time.as_nanos() / 10_000;
    format!("{}.{:02}", hundredths / 100, hundredths % 100)
}

//! Who is on the bus: overheard, then asked.

use codewheel_device::product::Bus;
use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::{LiveList, Presence, Probing, ScanProgress, SlaveSettings};
use codewheel_station::{Duration, Instant};

use super::console::Console;
use super::dialogue::Dialogue;
use super::identity;
use super::overheard::Heard;
use super::{LISTEN_TIME, OWN_MAC, troubles};
use crate::{Found, Kind, Owner, Progress, Role, Seat, Survey, Trouble};

/// How long the live list may take: the scanner gives it up after ten seconds.
const LIVE_LIST_TIME: Duration = Duration::from_secs(12);

/// Identity attribute 5, bit 2, and bits 8 to 11.
const CONFIGURED: u16 = 1 << 2;
const FAULTS: [(u16, &str); 4] = [
    (1 << 8, "minor recoverable fault"),
    (1 << 9, "minor unrecoverable fault"),
    (1 << 10, "major recoverable fault"),
    (1 << 11, "major unrecoverable fault"),
];
const MAJOR_FAULTS: u16 = 1 << 10 | 1 << 11;

/// How to scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanSettings {
    /// Our own MAC ID; default [`OWN_MAC`].
    pub mac: MacId,
    /// Sends addresses that stayed silent a duplicate MAC ID check as well, so that masters answer,
    /// too. A node that checks its MAC ID at that moment goes to communication fault. Default: no.
    pub forced: bool,
    /// How long to listen first; at least, and by default, [`LISTEN_TIME`].
    pub listen: Duration,
}

impl Default for ScanSettings {
    fn default() -> Self {
        Self { mac: OWN_MAC, forced: false, listen: LISTEN_TIME }
    }
}

/// Listens for `span`, and sends nothing.
///
/// # Errors
/// [`Trouble`] where the bus is lost. A bus on which nobody says anything is a survey without
/// nodes: encoders that nobody asks are silent.
pub fn listen<S: Seat<Station = Console>>(
    seat: &mut S,
    span: Duration,
    progress: &mut dyn FnMut(Progress),
) -> Result<Survey, Trouble> {
    let mut dialogue = Dialogue::new(seat);
    dialogue.listen_for("listen to the bus", span, |percent| {
        progress(Progress { doing: "listening".to_owned(), percent });
    })?;
    let now = dialogue.now();
    let console = dialogue.console();
    let overheard = console.overheard();
    let own = console.mac();
    let nodes: Vec<Found> = overheard
        .nodes()
        .filter(|(mac, _)| Some(*mac) != own)
        .map(|(mac, heard)| found(now, mac, heard))
        .collect();
    let mut remarks = remarks(console);
    if nodes.is_empty() {
        remarks.push("nobody said anything; slaves that nobody asks are silent".to_owned());
    }
    Ok(Survey { bus: Bus::DeviceNet, nodes, remarks })
}

/// Finds out who is on the bus: listens, asks all 64 addresses for a sign of life, then each slave
/// that belongs to nobody who it is.
///
/// It takes some six seconds and a tenth for each slave. Slaves of other masters are named with
/// their owner and what was overheard of them, and left alone.
///
/// # Errors
/// [`Trouble`] where the bus cannot be used: it is lost, nobody acknowledges, nobody answers, or our
/// own address is taken.
pub fn scan<S: Seat<Station = Console>>(
    seat: &mut S,
    settings: ScanSettings,
    progress: &mut dyn FnMut(Progress),
) -> Result<Survey, Trouble> {
    const TRIED: &str = "scan the bus";
    let mut told = None;
    let mut tell = |doing: String, from: u8, to: u8, percent: u8| {
        let percent = u16::from(from) + u16::from(to - from) * u16::from(percent) / 100;
        let now = Progress { doing, percent: percent.min(100) as u8 };
        if told.as_ref() != Some(&now) {
            progress(now.clone());
            told = Some(now);
        }
    };
    let mut dialogue = Dialogue::new(seat);
    dialogue.listen(TRIED, settings.listen.max(LISTEN_TIME), |percent| {
        tell("listening".to_owned(), 0, 20, percent);
    })?;
    tell(format!("checking that MAC ID {} is free", settings.mac), 20, 20, 0);
    dialogue.go_on_line(TRIED, settings.mac)?;
    let probing = if settings.forced { Probing::Forced } else { Probing::Gentle };
    let list = live_list(&mut dialogue, TRIED, probing, |percent| {
        tell("looking for nodes".to_owned(), 40, 60, percent);
    })?;

    let mut nodes: Vec<Found> = Vec::new();
    let present: Vec<(MacId, Presence)> = (0..64)
        .filter_map(MacId::new)
        .zip(list.nodes)
        .filter(|(mac, presence)| {
            let was_heard = dialogue.console().overheard().nodes().any(|(heard, _)| heard == *mac);
            *mac != settings.mac && (was_heard || *presence != Presence::Silent)
        })
        .collect();
    for (place, (mac, presence)) in present.iter().enumerate() {
        let percent = (place * 100 / present.len()) as u8;
        tell(format!("asking MAC ID {mac}"), 60, 100, percent);
        nodes.push(look_at(&mut dialogue, *mac, *presence)?);
    }
    if nodes.is_empty() {
        return Err(Trouble::new(
            Kind::Bus,
            TRIED,
            "nobody was heard, and none of 64 addresses answered",
            "check that the nodes have their 24 V, and that the bit rate is that of their switches",
        ));
    }
    tell("done".to_owned(), 100, 100, 100);
    Ok(Survey { bus: Bus::DeviceNet, nodes, remarks: remarks(dialogue.console()) })
}

fn live_list<S: Seat<Station = Console>>(
    dialogue: &mut Dialogue<S>,
    tried: &str,
    probing: Probing,
    mut progress: impl FnMut(u8),
) -> Result<LiveList, Trouble> {
    let now = dialogue.now();
    let begun = dialogue.console().scanner_mut().map(|scanner| scanner.scan(now, probing));
    if begun != Some(Ok(())) {
        return Err(troubles::not_on_line(tried));
    }
    let list = dialogue.wait(tried, LIVE_LIST_TIME, |console, _| {
        let list = console.scanner()?.live_list();
        match list.progress {
            ScanProgress::Complete | ScanProgress::Aborted => return Some(list),
            ScanProgress::Probing { percent } => progress(percent),
            ScanProgress::Listening | ScanProgress::NotBegun => progress(0),
        }
        None
    })?;
    match list {
        Some(list) if list.progress == ScanProgress::Complete => Ok(list),
        _ => {
            let console = dialogue.console();
            Err(match console.fault() {
                Some(fault) => troubles::fault(tried, fault, console.mac()),
                None => troubles::not_on_line(tried),
            })
        }
    }
}

/// Looks at one node: asks who it is where it belongs to nobody.
fn look_at<S: Seat<Station = Console>>(
    dialogue: &mut Dialogue<S>,
    mac: MacId,
    presence: Presence,
) -> Result<Found, Trouble> {
    let now = dialogue.now();
    let heard = dialogue.console().overheard().node(mac);
    let mut node = found(now, mac, &heard);
    let is_slave = heard.role() == Role::Slave;
    let is_asked = presence == Presence::Answers && is_slave && heard.owner(now).is_none();
    if presence == Presence::Checking {
        node.state = "checks its MAC ID".to_owned();
        node.lamp = Some("off");
    } else if presence == Presence::Answers && node.role == Role::Unknown {
        // A forced scan finds it: it defends its address, and is no Group 2 Only Server.
        node.state = "on-line, and no slave; perhaps a master".to_owned();
    }
    if !is_asked {
        return Ok(node);
    }
    let tried = format!("ask MAC ID {mac} who it is");
    let asked = dialogue
        .allocate(&tried, SlaveSettings::explicit(mac))
        .and_then(|()| identity::identify(dialogue, &tried, mac));
    // Whatever has come of it: a node that went away meanwhile is no reason to stop.
    let released = match dialogue.release(&tried, mac) {
        Err(trouble) if trouble.kind == Kind::Bus => Err(trouble),
        _ => Ok(()),
    };
    match asked {
        Ok(known) => {
            node.role = Role::Slave;
            node.owner = Some(Owner::Nobody);
            node.lamp = Some(lamp_of_free(known.status));
            node.state = state_of_free(known.status);
            node.identity = Some(known.identity);
        }
        Err(trouble) if trouble.kind == Kind::Bus => return Err(trouble),
        Err(trouble) if trouble.kind == Kind::Refused => {
            node.role = Role::Slave;
            let master = dialogue.console().overheard().node(mac).master;
            let owner = master.map_or(Owner::Somebody, |(mac, _)| Owner::Master(mac.value()));
            node.owner = Some(owner);
            node.state = trouble.came;
        }
        Err(_) => node.state = "is on-line, and does not take an explicit connection".to_owned(),
    }
    released.map(|()| node)
}

/// What was overheard of a node.
fn found(now: Instant, mac: MacId, heard: &Heard) -> Found {
    let owner = heard.owner(now);
    let is_polled = heard.polls.count != 0;
    let role = match heard.role() {
        Role::Unknown if is_polled => Role::Slave,
        role => role,
    };
    let (lamp, state) = if role == Role::Master {
        (None, "asks others".to_owned())
    } else if heard.productions.goes_on(now) {
        (Some("green"), exchange(heard))
    } else if heard.polls.goes_on(now) {
        (None, "is polled, and does not answer".to_owned())
    } else if heard.productions.count != 0 && owner.is_some() {
        // The explicit connection holds the connection set, and the I/O connection has ended.
        (Some("red flashing"), "its I/O connection has timed out".to_owned())
    } else if owner.is_some() {
        (Some("green"), "is asked by its master".to_owned())
    } else if heard.sent_at.is_none() && heard.checked_at.is_some() {
        (Some("off"), "checks its MAC ID".to_owned())
    } else if heard.heartbeat.is_some() {
        (None, "sends heartbeats".to_owned())
    } else {
        (None, "was heard".to_owned())
    };
    Found { address: mac.value(), role, identity: None, owner, lamp, state }
}

/// How an owned slave exchanges data: `exchanges data, 10.02 ms cycle, 4 octets`.
fn exchange(heard: &Heard) -> String {
    let pauses = if heard.polls.count > 1 { heard.polls } else { heard.productions };
    let octets = heard.production.map_or(0, |production| production.octets().len());
    let millis = |span: Duration| {
        let micros = span.as_nanos() / 1_000;
        format!("{}.{:02} ms", micros / 1_000, micros % 1_000 / 10)
    };
    if pauses.count < 2 {
        return format!("exchanges data, {octets} octets");
    }
    format!(
        "exchanges data, {} cycle ({} to {}), {octets} octets",
        millis(pauses.last),
        millis(pauses.shortest),
        millis(pauses.longest)
    )
}

/// The lamp of a slave that is on-line and belongs to nobody (AMG manual §9.2).
const fn lamp_of_free(status: Option<u16>) -> &'static str {
    match status {
        Some(status) if status & MAJOR_FAULTS != 0 => "red",
        _ => "green flashing",
    }
}

fn state_of_free(status: Option<u16>) -> String {
    let mut state = "on-line, free".to_owned();
    if let Some(status) = status {
        if status & CONFIGURED != 0 {
            state.push_str(", configured");
        }
        for (bit, name) in FAULTS {
            if status & bit != 0 {
                state.push_str(", ");
                state.push_str(name);
            }
        }
    }
    state
}

/// What to tell of an address that two nodes want.
pub(super) fn contested(mac: MacId) -> String {
    format!(
        "two nodes have MAC ID {mac}: the one that came later is red and silent; give it another \
         address and switch it on anew"
    )
}

/// What people should know besides the nodes.
fn remarks(console: &Console) -> Vec<String> {
    let overheard = console.overheard();
    let mut remarks: Vec<String> = overheard
        .nodes()
        .filter(|(_, heard)| heard.contested_at.is_some())
        .map(|(mac, _)| contested(mac))
        .collect();
    let strays = overheard
        .nodes()
        .filter(|(_, heard)| heard.polls.count != 0 && heard.answered_at.is_none())
        .map(|(mac, _)| mac);
    remarks.extend(strays.map(|mac| format!("somebody polls MAC ID {mac}, which does not answer")));
    remarks
}

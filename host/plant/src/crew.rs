//! Who is on a bus, whatever the bus is: devices, masters, what is done to them and what they show.

use std::collections::BTreeMap;

use codewheel_device::Product;
use codewheel_station::{Instant, Station};

use crate::device::Device;
use crate::fault::{Action, Agenda, Lever};
use crate::field_bus::{FieldBus, PlannedMaster, Switches, Talker, Told};
use crate::manned::Manned;
use crate::report::{Report, What};
use crate::snapshot::{
    BusSnapshot, DeviceSnapshot, DeviceState, LampState, MasterSnapshot, ShaftState, SlaveSnapshot,
    SwitchPositions,
};
use crate::{Cause, Command, Done, ObjectGroup, Refusal, Ticket};

/// A station of a plant. A master is many times larger than an encoder, so both are boxed.
#[derive(Debug)]
pub enum Member<B: FieldBus> {
    /// A device.
    Device(Box<Device<B>>),
    /// A master.
    Master(Box<B::Master>),
}

impl<B: FieldBus> Member<B> {
    pub(crate) const fn device(&self) -> Option<&Device<B>> {
        match self {
            Self::Device(device) => Some(device),
            Self::Master(_) => None,
        }
    }

    const fn device_mut(&mut self) -> Option<&mut Device<B>> {
        match self {
            Self::Device(device) => Some(device),
            Self::Master(_) => None,
        }
    }

    pub(crate) const fn master(&self) -> Option<&B::Master> {
        match self {
            Self::Device(_) => None,
            Self::Master(master) => Some(master),
        }
    }
}

impl<B: FieldBus> Station for Member<B> {
    type Input<'a> = B::Input<'a>;
    type Output = B::Output;

    fn handle(&mut self, now: Instant, input: B::Input<'_>) {
        match self {
            Self::Device(device) => device.handle(now, input),
            Self::Master(master) => master.handle(now, input),
        }
    }

    fn advance(&mut self, now: Instant) {
        match self {
            Self::Device(device) => device.advance(now),
            Self::Master(master) => master.advance(now),
        }
    }

    fn transmit(&mut self, now: Instant) -> Option<B::Output> {
        match self {
            Self::Device(device) => device.transmit(now),
            Self::Master(master) => master.transmit(now),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        match self {
            Self::Device(device) => device.deadline(),
            Self::Master(master) => master.deadline(),
        }
    }
}

/// What stations can be plugged into. Each has a place, devices first, then masters.
pub trait Medium<B: FieldBus> {
    /// Plugs a station in and switches it on.
    fn plug_in(&mut self, place: usize, station: Member<B>);
    /// Switches a station off and unplugs it.
    fn unplug(&mut self, place: usize) -> Option<Member<B>>;
    /// The station on a place.
    fn station(&self, place: usize) -> Option<&Member<B>>;
    /// The station on a place, to be changed.
    fn station_mut(&mut self, place: usize) -> Option<&mut Member<B>>;
    /// Lets the controller of a station leave the bus for a while.
    fn bus_off(&mut self, place: usize, now: Instant);
    /// Destroys what a station sends, or no more.
    fn set_corruption(&mut self, place: usize, probability: Option<f64>);
}

/// Who is on a bus.
#[derive(Debug)]
pub(crate) struct Crew<B: FieldBus> {
    name: String,
    bit_rate: B::Rate,
    devices: Vec<Hand<B>>,
    masters: Vec<Chief<B>>,
    agenda: Agenda,
    /// Of the bus itself.
    reports: Vec<Report>,
    seen_at: Instant,
}

/// A device of the crew.
#[derive(Debug)]
struct Hand<B: FieldBus> {
    name: String,
    address: u8,
    product: &'static Product,
    /// The device while it has no power.
    unplugged: Option<Member<B>>,
    /// The first master that serves it, and its address.
    master: Option<(usize, u8)>,
}

/// A master of the crew.
#[derive(Debug)]
struct Chief<B: FieldBus> {
    plan: B::MasterPlan,
    /// The answers it had counted at the snapshot before, by the address of the slave.
    answers: BTreeMap<u8, u64>,
}

impl<B: FieldBus> Crew<B> {
    /// Switches everything on, at time zero.
    pub(crate) fn power_up(manned: Manned<B>, medium: &mut impl Medium<B>) -> Self {
        let Manned { plan, devices, masters } = manned;
        let agenda = Agenda::new(plan.devices.iter().map(|device| device.faults.as_slice()));
        let mut hands = Vec::new();
        for (place, (planned, mut device)) in plan.devices.iter().zip(devices).enumerate() {
            device.power_up(Instant::ZERO);
            medium.plug_in(place, Member::Device(device));
            let master = planned.switches.address().and_then(|address| {
                let serves = |master: &B::MasterPlan| master.serves(address);
                Some((plan.masters.iter().position(serves)?, address))
            });
            hands.push(Hand {
                name: planned.name.clone(),
                address: planned.switches.position(),
                product: planned.product,
                unplugged: None,
                master,
            });
        }
        for (place, master) in masters.into_iter().enumerate() {
            medium.plug_in(hands.len() + place, Member::Master(master));
        }
        let chief = |plan| Chief { plan, answers: BTreeMap::new() };
        Self {
            name: plan.name,
            bit_rate: plan.bit_rate,
            devices: hands,
            masters: plan.masters.into_iter().map(chief).collect(),
            agenda,
            reports: Vec::new(),
            seen_at: Instant::ZERO,
        }
    }

    /// When something will be done to a device next.
    pub(crate) fn next_fault(&self) -> Option<Instant> {
        self.agenda.next_at()
    }

    /// Does what is due to the devices.
    pub(crate) fn pull_levers(&mut self, now: Instant, medium: &mut impl Medium<B>) {
        while let Some((place, action)) = self.agenda.take_due(now) {
            self.pull(now, place, action, medium);
        }
    }

    fn pull(&mut self, now: Instant, place: usize, action: Action, medium: &mut impl Medium<B>) {
        let Some(hand) = self.devices.get_mut(place) else { return };
        match action {
            Action::Begin(Lever::PowerCut(_)) => {
                hand.unplugged = medium.unplug(place);
                if let Some(device) = hand.unplugged.as_mut().and_then(Member::device_mut) {
                    device.power_cut(now);
                }
            }
            Action::End(Lever::PowerCut(_)) => {
                if let Some(mut member) = hand.unplugged.take() {
                    if let Some(device) = member.device_mut() {
                        device.power_up(now);
                    }
                    medium.plug_in(place, member);
                }
            }
            Action::Begin(Lever::BusOff) => medium.bus_off(place, now),
            Action::Begin(Lever::BadTransceiver { probability, .. }) => {
                medium.set_corruption(place, Some(probability));
            }
            Action::End(Lever::BadTransceiver { .. }) => medium.set_corruption(place, None),
            Action::Begin(_) | Action::End(_) => {}
        }
        if let Some(device) = self.device_mut(place, medium) {
            device.suffer(now, action);
            let what = match action {
                Action::Begin(lever) => What::FaultBegins(lever.to_string()),
                Action::End(lever) => What::FaultEnds(lever.to_string()),
            };
            device.report(now, what);
        }
    }

    /// Notes what happened on the bus itself.
    pub(crate) fn report(&mut self, at: Instant, what: What) {
        self.reports.push(Report { at, what });
    }

    /// Hears what the masters have to tell.
    fn listen(&mut self, medium: &mut impl Medium<B>) {
        for (place, chief) in (self.devices.len()..).zip(&self.masters) {
            let Some(Member::Master(master)) = medium.station_mut(place) else { continue };
            while let Some(Told { at, text, trouble }) = master.take_event() {
                let what = What::Master { name: chief.plan.name().to_owned(), text, trouble };
                self.reports.push(Report { at, what });
            }
        }
    }

    /// What the bus and its devices have reported, in order.
    pub(crate) fn take_reports(&mut self, medium: &mut impl Medium<B>) -> Vec<Report> {
        self.listen(medium);
        let mut reports = std::mem::take(&mut self.reports);
        for place in 0..self.devices.len() {
            if let Some(device) = self.device_mut(place, medium) {
                reports.append(&mut device.take_reports());
            }
        }
        reports.sort_by_key(|report| report.at);
        reports
    }

    /// A device, with power or without.
    fn device_mut<'a>(
        &'a mut self,
        place: usize,
        medium: &'a mut impl Medium<B>,
    ) -> Option<&'a mut Device<B>> {
        let member = match &mut self.devices.get_mut(place)?.unplugged {
            Some(member) => Some(member),
            None => medium.station_mut(place),
        };
        member?.device_mut()
    }

    /// The bus now.
    pub(crate) fn snapshot(
        &mut self,
        at: Instant,
        uri: String,
        load: Option<f64>,
        medium: &mut impl Medium<B>,
    ) -> BusSnapshot {
        self.listen(medium);
        let masters = self.master_snapshots(at, medium);
        let mut devices = Vec::with_capacity(self.devices.len());
        for (place, hand) in self.devices.iter_mut().enumerate() {
            let master = hand.master.and_then(|(master, address)| {
                let slaves = &masters.get(master)?.as_ref()?.slaves;
                slaves.iter().find(|(of, _)| *of == address).map(|(_, slave)| *slave)
            });
            let member = match &mut hand.unplugged {
                Some(member) => Some(member),
                None => medium.station_mut(place),
            };
            let device = member.and_then(Member::device_mut);
            let (snapshot, reports) = device.map_or_else(Default::default, |device| {
                (device.snapshot(at), device.take_reports())
            });
            devices.push(DeviceSnapshot {
                name: hand.name.clone(),
                address: hand.address,
                product: hand.product,
                device: snapshot,
                master,
                served_by: None,
                state: DeviceState {
                    power: snapshot.is_some(),
                    shaft: ShaftState { code: None, motion: "".into(), turning: false },
                    measured: None,
                    lamp: LampState { colour: "off", pattern: "off", lit: false, text: "off" },
                    connection: "absent",
                    master: None,
                    memory: None,
                    switches: SwitchPositions::default(),
                    switches_at_power_up: SwitchPositions::default(),
                    faults: Vec::new(),
                },
                reports,
            });
        }
        devices.sort_by_key(|device| device.address);
        BusSnapshot {
            name: self.name.clone(),
            bus: B::BUS,
            uri,
            bit_rate: self.bit_rate.to_string(),
            at,
            load,
            masters: masters.into_iter().flatten().collect(),
            devices,
            reports: std::mem::take(&mut self.reports),
        }
    }

    /// The masters now, each on its place.
    fn master_snapshots(
        &mut self,
        at: Instant,
        medium: &impl Medium<B>,
    ) -> Vec<Option<MasterSnapshot>> {
        let window = at.since(self.seen_at).as_nanos() as f64 / 1e9;
        self.seen_at = at;
        let count = self.devices.len();
        let snapshot = |(place, chief): (usize, &mut Chief<B>)| {
            let master = medium.station(count + place)?.master()?;
            let cycle = master.cycle_times();
            let slaves = chief.plan.slaves().filter_map(|address| {
                let seen = master.slave(address)?;
                let before = chief.answers.insert(address, seen.answers).unwrap_or(0);
                let fresh = seen.answers.saturating_sub(before) as f64;
                let slave = SlaveSnapshot {
                    state: seen.state,
                    position: seen.position,
                    answers_per_second: if window > 0.0 { fresh / window } else { 0.0 },
                    cycle,
                    diagnosis: seen.diagnosis,
                };
                Some((address, slave))
            });
            Some(MasterSnapshot {
                slaves: slaves.collect(),
                name: chief.plan.name().to_owned(),
                address: chief.plan.address(),
                on_line: master.is_on_line(),
                cycle,
            })
        };
        self.masters.iter_mut().enumerate().map(snapshot).collect()
    }

    /// Does something to the device that the plan calls `name`.
    pub(crate) fn command(
        &mut self,
        _now: Instant,
        _name: &str,
        _command: &Command,
        _medium: &mut impl Medium<B>,
    ) -> Ticket {
        Ticket(0)
    }

    /// What became of a command.
    pub(crate) fn take_answer(
        &mut self,
        _now: Instant,
        _ticket: Ticket,
        _medium: &mut impl Medium<B>,
    ) -> Option<Result<Done, Refusal>> {
        Some(Err(Refusal::new(Cause::Impossible, "this plant cannot do that yet")))
    }

    /// What can be read of a device and set.
    pub(crate) fn objects(
        &mut self,
        _now: Instant,
        _name: &str,
        _medium: &mut impl Medium<B>,
    ) -> Result<Vec<ObjectGroup>, Refusal> {
        Err(Refusal::new(Cause::Impossible, "this plant cannot tell its objects yet"))
    }

    /// Waits until all memories have taken everything.
    pub(crate) fn finish_memories(&mut self, now: Instant, medium: &mut impl Medium<B>) {
        for place in 0..self.devices.len() {
            if medium.station(place).and_then(Member::device).is_some()
                && let Some(device) = medium.station_mut(place).and_then(Member::device_mut)
            {
                device.finish_memory(now);
            }
        }
    }
}

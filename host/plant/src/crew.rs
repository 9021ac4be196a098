//! Who is on a bus, whatever the bus is: devices, masters, what is done to them and what they show.

mod commands;
mod shaft;

use std::collections::BTreeMap;

use codewheel_device::Product;
use codewheel_station::{Duration, Instant, Station};

use self::commands::Desk;
use crate::device::Device;
use crate::fault::{Action, Agenda, Lever};
use crate::field_bus::{FieldBus, PlannedMaster, Talker, Told};
use crate::manned::Manned;
use crate::report::{Report, What};
use crate::snapshot::{BusSnapshot, DeviceSnapshot, MasterSnapshot, SlaveSnapshot};

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
    /// Calls a place so, and says whether there is a terminating resistor, from the next plugging in
    /// on.
    fn label(&mut self, place: usize, label: String, termination: bool) {
        let _ = (place, label, termination);
    }
    /// Switches the terminating resistor of a station.
    fn set_terminated(&mut self, place: usize, terminated: bool) {
        let _ = (place, terminated);
    }
    /// What is wrong with the wiring, where that can be told.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }
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
    desk: Desk,
    /// Of the bus itself.
    reports: Vec<Report>,
    /// When rates were told last, and how long they are averaged at least.
    seen_at: Instant,
    window: Duration,
}

/// A device of the crew.
#[derive(Debug)]
struct Hand<B: FieldBus> {
    name: String,
    product: &'static Product,
    /// The device while it has no power.
    unplugged: Option<Member<B>>,
    /// Its power is cut by a fault.
    cut: bool,
    /// Somebody has switched it off.
    switched_off: bool,
    bad_transceiver: bool,
}

/// A master of the crew.
#[derive(Debug)]
struct Chief<B: FieldBus> {
    plan: B::MasterPlan,
    /// What was counted of each slave, by its address.
    counted: BTreeMap<u8, Counted>,
}

/// The answers of a slave.
#[derive(Clone, Copy, Debug, Default)]
struct Counted {
    /// At the beginning of the window that goes on.
    answers: u64,
    /// In the window before.
    per_second: f64,
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
            hands.push(Hand {
                name: planned.name.clone(),
                product: planned.product,
                unplugged: None,
                cut: false,
                switched_off: false,
                bad_transceiver: false,
            });
        }
        for (place, master) in masters.into_iter().enumerate() {
            medium.plug_in(hands.len() + place, Member::Master(master));
        }
        let chief = |plan| Chief { plan, counted: BTreeMap::new() };
        Self {
            name: plan.name,
            bit_rate: plan.bit_rate,
            devices: hands,
            masters: plan.masters.into_iter().map(chief).collect(),
            agenda,
            desk: Desk::default(),
            reports: Vec::new(),
            seen_at: Instant::ZERO,
            window: Duration::ZERO,
        }
    }

    /// Averages rates over so long a time at least, however often snapshots are made.
    pub(crate) const fn set_window(&mut self, window: Duration) {
        self.window = window;
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
                hand.cut = true;
                self.cut_power(now, place, medium);
            }
            Action::End(Lever::PowerCut(_)) => {
                // Somebody may have given it power meanwhile, or wants it to have none.
                hand.cut = false;
                if !hand.switched_off {
                    self.give_power(now, place, medium);
                }
            }
            Action::Begin(Lever::BusOff) => medium.bus_off(place, now),
            Action::Begin(Lever::BadTransceiver { probability, .. }) => {
                hand.bad_transceiver = true;
                medium.set_corruption(place, Some(probability));
            }
            Action::End(Lever::BadTransceiver { .. }) => {
                hand.bad_transceiver = false;
                medium.set_corruption(place, None);
            }
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

    /// Plugs those in anew that have another address after a reset over the bus.
    pub(crate) fn follow_switches(&mut self, medium: &mut impl Medium<B>) {
        for place in 0..self.devices.len() {
            if !medium.station(place).and_then(Member::device).is_some_and(Device::has_moved) {
                continue;
            }
            let Some(mut member) = medium.unplug(place) else { continue };
            if let Some(device) = member.device_mut() {
                device.settle();
                medium.label(place, device.label(), device.switches().termination);
            }
            medium.plug_in(place, member);
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
    fn device<'a>(&'a self, place: usize, medium: &'a impl Medium<B>) -> Option<&'a Device<B>> {
        let member = match &self.devices.get(place)?.unplugged {
            Some(member) => Some(member),
            None => medium.station(place),
        };
        member?.device()
    }

    /// A device, with power or without, to be changed.
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
        for place in 0..self.devices.len() {
            let served = self.master_of(place, medium);
            let master = served.and_then(|(master, address)| {
                let slaves = &masters.get(master)?.as_ref()?.slaves;
                slaves.iter().find(|(of, _)| *of == address).map(|(_, slave)| *slave)
            });
            let served_by = served.and_then(|(master, _)| self.masters.get(master));
            let served_by = served_by.map(|chief| chief.plan.name().to_owned());
            let faults = self.faults(place, medium);
            let Some(device) = self.device(place, medium) else { continue };
            let snapshot = device.snapshot(at);
            let state = device.state(at, snapshot.as_ref(), master.as_ref(), faults);
            let [tens, units] = device.switches_at_power_up().rotary;
            let reports = self.device_mut(place, medium).map(Device::take_reports);
            let Some(hand) = self.devices.get(place) else { continue };
            devices.push(DeviceSnapshot {
                name: hand.name.clone(),
                address: tens * 10 + units,
                product: hand.product,
                device: snapshot,
                master,
                served_by,
                state,
                reports: reports.unwrap_or_default(),
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
        let window = at.since(self.seen_at);
        let is_over = window >= self.window && window > Duration::ZERO;
        if is_over {
            self.seen_at = at;
        }
        let count = self.devices.len();
        let snapshot = |(place, chief): (usize, &mut Chief<B>)| {
            let master = medium.station(count + place)?.master()?;
            let cycle = master.cycle_times();
            let slaves = chief.plan.slaves().filter_map(|address| {
                let seen = master.slave(address)?;
                let counted = chief.counted.entry(address).or_default();
                if is_over {
                    let fresh = seen.answers.saturating_sub(counted.answers) as f64;
                    let per_second = fresh * 1e9 / window.as_nanos() as f64;
                    *counted = Counted { answers: seen.answers, per_second };
                }
                let slave = SlaveSnapshot {
                    state: seen.state,
                    position: seen.position,
                    answers_per_second: counted.per_second,
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

//! Who is on a bus, whatever the bus is: devices, masters, what is done to them and what they show.

use codewheel_device::{Product, Snapshot};
use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::{
    ChangeSettings, CycleTimes, DeviceIdentity, PollSettings, Scanner, ScannerIdentity,
    SlaveSettings, SlaveState,
};
use codewheel_link::BusUri;
use codewheel_station::can::{BitRate, Filter, Frame, Input};
use codewheel_station::{Instant, Station};

use crate::device::Device;
use crate::fault::{Action, Agenda, Lever};
use crate::keeper::Keeper;
use crate::report::{Report, What};
use crate::{BusPlan, Exchange, MasterPlan, MemoryError, SlavePlan};

/// A bus at one moment.
#[derive(Clone, Debug)]
pub struct BusSnapshot {
    /// Its name.
    pub name: String,
    /// Where it is, with the port it really got.
    pub uri: String,
    /// Its bit rate.
    pub bit_rate: BitRate,
    /// When, from the start of the plant.
    pub at: Instant,
    /// The share of the time since the snapshot before in which the wire was not idle, 0 … 1;
    /// `None` where nobody can tell.
    pub load: Option<f64>,
    /// Its masters.
    pub masters: Vec<MasterSnapshot>,
    /// Its devices, by address.
    pub devices: Vec<DeviceSnapshot>,
    /// What happened on the bus itself since the snapshot before.
    pub reports: Vec<Report>,
}

/// A master at one moment.
#[derive(Clone, Debug)]
pub struct MasterSnapshot {
    /// What messages call it.
    pub name: String,
    /// Its address.
    pub mac: MacId,
    /// Whether it is on-line.
    pub on_line: bool,
    /// Its poll cycles.
    pub cycle: CycleTimes,
}

/// A device at one moment, seen from both sides of the bus.
#[derive(Clone, Debug)]
pub struct DeviceSnapshot {
    /// What messages call it.
    pub name: String,
    /// What its address switches say, 0 … 99.
    pub address: u8,
    /// The product.
    pub product: &'static Product,
    /// The device itself; `None` while it has no power.
    pub device: Option<Snapshot>,
    /// Where it stands with the first master that has it in its scan list.
    pub master: Option<SlaveSnapshot>,
    /// What happened to it since the snapshot before.
    pub reports: Vec<Report>,
}

/// A device as its master sees it.
#[derive(Clone, Debug)]
pub struct SlaveSnapshot {
    /// Where it stands.
    pub state: SlaveState,
    /// The position as the master got it last; `None` before the first answer.
    pub position: Option<u32>,
    /// Answers a second since the snapshot before.
    pub answers_per_second: f64,
    /// The poll cycles of this master.
    pub cycle: CycleTimes,
}

/// A station of a plant. A scanner is many times larger than an encoder, so both are boxed.
#[derive(Debug)]
pub(crate) enum Member {
    Device(Box<Device>),
    Scanner(Box<Scanner>),
}

impl Member {
    pub(crate) fn filters(&self) -> Vec<Filter> {
        match self {
            Self::Device(device) => device.filters(),
            Self::Scanner(scanner) => scanner.filters().to_vec(),
        }
    }

    const fn device(&self) -> Option<&Device> {
        match self {
            Self::Device(device) => Some(device),
            Self::Scanner(_) => None,
        }
    }

    const fn device_mut(&mut self) -> Option<&mut Device> {
        match self {
            Self::Device(device) => Some(device),
            Self::Scanner(_) => None,
        }
    }

    const fn scanner(&self) -> Option<&Scanner> {
        match self {
            Self::Device(_) => None,
            Self::Scanner(scanner) => Some(scanner),
        }
    }
}

impl Station for Member {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        match self {
            Self::Device(device) => device.handle(now, input),
            Self::Scanner(scanner) => scanner.handle(now, input),
        }
    }

    fn advance(&mut self, now: Instant) {
        match self {
            Self::Device(device) => device.advance(now),
            Self::Scanner(scanner) => scanner.advance(now),
        }
    }

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        match self {
            Self::Device(device) => device.transmit(now),
            Self::Scanner(scanner) => scanner.transmit(now),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        match self {
            Self::Device(device) => device.deadline(),
            Self::Scanner(scanner) => scanner.deadline(),
        }
    }
}

/// What stations can be plugged into. Each has a place, devices first, then masters.
pub(crate) trait Medium {
    /// Plugs a station in and switches it on.
    fn plug_in(&mut self, place: usize, station: Member);
    /// Switches a station off and unplugs it.
    fn unplug(&mut self, place: usize) -> Option<Member>;
    fn station(&self, place: usize) -> Option<&Member>;
    fn station_mut(&mut self, place: usize) -> Option<&mut Member>;
    /// Lets the controller of a station leave the bus for a while.
    fn bus_off(&mut self, place: usize, now: Instant);
    /// Destroys what a station sends, or no more.
    fn set_corruption(&mut self, place: usize, probability: Option<f64>);
}

/// Who is on a bus.
#[derive(Debug)]
pub(crate) struct Crew {
    name: String,
    bit_rate: BitRate,
    devices: Vec<Hand>,
    masters: Vec<MasterPlan>,
    agenda: Agenda,
    /// Of the bus itself.
    reports: Vec<Report>,
    seen_at: Instant,
}

/// A device of the crew.
#[derive(Debug)]
struct Hand {
    name: String,
    address: u8,
    product: &'static Product,
    /// The device while it has no power.
    unplugged: Option<Member>,
    /// The first master that has it in its scan list.
    master: Option<(usize, MacId)>,
    /// Its answers at the snapshot before.
    answers: u64,
}

/// A plan, and the memories of its devices, opened.
#[derive(Debug)]
pub(crate) struct Manned {
    pub(crate) plan: BusPlan,
    memories: Vec<Keeper>,
    reports: Vec<(usize, What)>,
}

impl Manned {
    /// Opens the memories of all devices.
    pub(crate) fn open(plan: BusPlan) -> Result<Self, MemoryError> {
        let mut memories = Vec::new();
        let mut reports = Vec::new();
        for (place, device) in plan.devices.iter().enumerate() {
            let (keeper, aside) = Keeper::open(device.memory.as_deref(), device.product)?;
            memories.push(keeper);
            reports.extend(aside.map(|path| (place, What::SetAside(path))));
        }
        Ok(Self { plan, memories, reports })
    }

    /// Writes memory files in threads.
    pub(crate) fn in_threads(mut self, waker: &codewheel_link::Waker) -> Self {
        let memories = self.memories.drain(..);
        self.memories = memories.map(|keeper| keeper.in_thread(waker.clone())).collect();
        self
    }
}

impl Crew {
    /// Switches everything on, at time zero.
    pub(crate) fn power_up(manned: Manned, medium: &mut impl Medium) -> Self {
        let Manned { plan, memories, reports } = manned;
        let BusPlan { name, bit_rate, seed, devices, masters, .. } = plan;
        let agenda = Agenda::new(devices.iter().map(|device| device.faults.as_slice()));
        let mut hands = Vec::new();
        for (place, (plan, keeper)) in devices.iter().zip(memories).enumerate() {
            let mut device = Box::new(Device::new(plan, keeper, seed_at(seed, place)));
            for (_, what) in reports.iter().filter(|(of, _)| *of == place) {
                device.report(Instant::ZERO, what.clone());
            }
            device.power_up(Instant::ZERO);
            medium.plug_in(place, Member::Device(device));
            let mac = plan.switches.mac();
            let master = mac.and_then(|mac| {
                let has_it =
                    |master: &MasterPlan| master.slaves.iter().any(|slave| slave.mac == mac);
                Some((masters.iter().position(has_it)?, mac))
            });
            hands.push(Hand {
                name: plan.name.clone(),
                address: plan.switches.address(),
                product: plan.product,
                unplugged: None,
                master,
                answers: 0,
            });
        }
        for (place, plan) in masters.iter().enumerate() {
            let member = Member::Scanner(Box::new(scanner(plan, place)));
            medium.plug_in(hands.len() + place, member);
        }
        Self {
            name,
            bit_rate,
            devices: hands,
            masters,
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
    pub(crate) fn pull_levers(&mut self, now: Instant, medium: &mut impl Medium) {
        while let Some((place, action)) = self.agenda.take_due(now) {
            self.pull(now, place, action, medium);
        }
    }

    fn pull(&mut self, now: Instant, place: usize, action: Action, medium: &mut impl Medium) {
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
            device.suffer(action);
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

    /// What the bus and its devices have reported, in order.
    pub(crate) fn take_reports(&mut self, medium: &mut impl Medium) -> Vec<Report> {
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
        medium: &'a mut impl Medium,
    ) -> Option<&'a mut Device> {
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
        medium: &mut impl Medium,
    ) -> BusSnapshot {
        let window = at.since(self.seen_at).as_nanos() as f64 / 1e9;
        self.seen_at = at;
        let count = self.devices.len();
        let mut devices = Vec::with_capacity(count);
        for (place, hand) in self.devices.iter_mut().enumerate() {
            let master = hand.master.and_then(|(master, mac)| {
                let scanner = medium.station(count + master)?.scanner()?;
                let slave = scanner.slave(mac)?;
                let answers = slave.responses + slave.changes;
                let fresh = answers.saturating_sub(hand.answers);
                hand.answers = answers;
                Some(SlaveSnapshot {
                    state: slave.state,
                    position: slave.latest().and_then(|(_, input)| position(input)),
                    answers_per_second: if window > 0.0 { fresh as f64 / window } else { 0.0 },
                    cycle: scanner.cycle_times(),
                })
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
                reports,
            });
        }
        devices.sort_by_key(|device| device.address);
        let masters = self.masters.iter().enumerate().filter_map(|(place, plan)| {
            let scanner = medium.station(count + place)?.scanner()?;
            Some(MasterSnapshot {
                name: plan.name.clone(),
                mac: plan.mac,
                on_line: scanner.is_on_line(),
                cycle: scanner.cycle_times(),
            })
        });
        BusSnapshot {
            name: self.name.clone(),
            uri,
            bit_rate: self.bit_rate,
            at,
            load,
            masters: masters.collect(),
            devices,
            reports: std::mem::take(&mut self.reports),
        }
    }

    /// Waits until all memories have taken everything.
    pub(crate) fn finish_memories(&mut self, now: Instant, medium: &mut impl Medium) {
        for place in 0..self.devices.len() {
            if medium.station(place).and_then(Member::device).is_some()
                && let Some(device) = medium.station_mut(place).and_then(Member::device_mut)
            {
                device.finish_memory(now);
            }
        }
    }
}

/// What chance on one place is drawn from: near seeds and near places have nothing in common.
pub(crate) fn seed_at(seed: u32, place: usize) -> u64 {
    (u64::from(seed) << 32 | place as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
}

fn slave_settings(slave: &SlavePlan) -> SlaveSettings {
    let SlavePlan { mac, exchange, expected_packet_rate, assembly, identity } = *slave;
    let identity = identity.map(|(vendor, product_code)| DeviceIdentity { vendor, product_code });
    let mut settings = SlaveSettings { identity, ..SlaveSettings::explicit(mac) };
    match exchange {
        Exchange::Poll => settings.poll = Some(PollSettings { expected_packet_rate, assembly }),
        Exchange::Change { trigger, acknowledged, production_inhibit } => {
            settings.change = Some(ChangeSettings {
                trigger,
                acknowledged,
                expected_packet_rate,
                production_inhibit,
                assembly,
            });
        }
        Exchange::Explicit => {}
    }
    settings
}

fn scanner(plan: &MasterPlan, place: usize) -> Scanner {
    // No vendor has the code FFFF.
    let identity = ScannerIdentity { vendor: 0xFFFF, serial: place as u32 + 1 };
    let mut scanner = Scanner::new(plan.mac, identity, plan.interval);
    scanner.set_interscan_delay(plan.interscan_delay);
    for slave in &plan.slaves {
        // A plan has no address twice, so there are never too many.
        let _ = scanner.add(slave_settings(slave));
    }
    scanner
}

/// The position in a poll response.
fn position(input: &[u8]) -> Option<u32> {
    input.first_chunk().map(|octets| u32::from_le_bytes(*octets))
}

/// Whether a bus is simulated.
pub(crate) const fn is_virtual(uri: &BusUri) -> bool {
    matches!(uri, BusUri::Virtual(_))
}

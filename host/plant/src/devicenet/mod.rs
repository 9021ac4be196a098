//! DeviceNet in a plant.

mod changes;
mod composite;
mod objects;
mod plan;
mod scanner;

use std::sync::Arc;

use codewheel_capture::{self as capture, Direction};
use codewheel_device::{DeviceNetEncoder, Event, Factory, Snapshot, product};
use codewheel_devicenet::scanner::Scanner;
use codewheel_encoder::{Kept, Start};
use codewheel_link::{BusUri, CanPort, Clock, LinkError, Loop, Notice, Tap, Waker};
use codewheel_sim::can::{self, Faults, NodeId, Statistics, Wire};
use codewheel_sim::{Drops, Troubled};
use codewheel_station::can::{BitRate, Filter, Frame, Input};
use codewheel_station::{Duration, Instant};

use self::composite::Composite;
use crate::crew::{Medium, Member};
use crate::ears::Ears;
use crate::field_bus::{Begun, Change, FieldBus, Line, Outfit, Powered, Shared, Switches};
use crate::recording::Frames;
use crate::sensor::PlantSensor;
use crate::{
    BusPlan, DipSwitch, MemoryError, ObjectGroup, Refusal, RotarySwitch, StartError,
    SwitchPositions,
};

pub use plan::{Exchange, MasterPlan, SlavePlan};

/// DeviceNet, as the type parameter of plans and buses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceNet {}

impl FieldBus for DeviceNet {
    const BUS: product::Bus = product::Bus::DeviceNet;

    type Rate = BitRate;
    type Cable = ();
    type Faults = Faults;
    type Switches = codewheel_device::Switches;
    type Options = ();
    type MasterPlan = MasterPlan;

    type Input<'a> = Input<'a>;
    type Output = Frame;
    type Encoder = Troubled<DeviceNetEncoder<PlantSensor>>;
    type Master = Scanner;
    type Line = Wire<Member<Self>>;
    type Stations = Stations;
    type Port = Box<dyn CanPort>;
    type Loop = Loop;

    const ROTARY: [RotarySwitch; 2] = [
        RotarySwitch { label: "1", meaning: "tens of the MAC ID", delivered: 0 },
        RotarySwitch { label: "2", meaning: "units of the MAC ID", delivered: 0 },
    ];
    const DIP: &'static [DipSwitch] = &[
        DipSwitch { label: "1", meaning: "not used", delivered: false },
        DipSwitch {
            label: "2",
            meaning: "bit rate: 2 and 3 OFF OFF 125k, OFF ON 250k, ON OFF 500k",
            delivered: false,
        },
        DipSwitch {
            label: "3",
            meaning: "bit rate: 2 and 3 OFF OFF 125k, OFF ON 250k, ON OFF 500k",
            delivered: false,
        },
    ];

    fn bit_rates() -> Vec<String> {
        BitRate::ALL.iter().map(ToString::to_string).collect()
    }

    fn rate_apart(switches: &Self::Switches, rate: BitRate) -> Option<BitRate> {
        Some(switches.bit_rate()).filter(|switched| *switched != rate)
    }

    /// They are the device's own.
    fn settings_fixed(_: bool) -> Option<&'static str> {
        None
    }

    fn objects(
        outfit: &Outfit<Self>,
        encoder: Option<&Self::Encoder>,
        _: Option<(&Scanner, u8)>,
    ) -> Vec<ObjectGroup> {
        objects::objects(outfit, encoder.map(Troubled::station))
    }

    fn make_master(plan: &MasterPlan, place: usize) -> Result<Scanner, StartError> {
        Ok(scanner::scanner(plan, place))
    }

    fn open(uri: &BusUri, rate: BitRate) -> Result<Box<dyn CanPort>, LinkError> {
        codewheel_link::open(uri, rate)
    }

    fn describe(port: &Box<dyn CanPort>) -> String {
        port.describe()
    }

    fn waker(port: &Box<dyn CanPort>) -> Waker {
        port.waker()
    }

    fn drive(clock: Clock) -> Loop {
        Loop::new(clock)
    }

    fn captured(plan: &BusPlan<Self>) -> capture::Bus {
        capture::Bus::devicenet(&plan.name, plan.bit_rate)
    }

    fn listen(drive: &mut Loop, ears: Option<Arc<Ears>>, _: BitRate) {
        drive.set_tap(ears.map(|ears| Box::new(Frames(ears)) as Box<dyn Tap>));
    }
}

impl Switches for codewheel_device::Switches {
    fn position(&self) -> u8 {
        Self::address(self)
    }

    fn address(&self) -> Option<u8> {
        self.mac().map(codewheel_devicenet::MacId::value)
    }

    fn termination(&self) -> bool {
        self.termination
    }

    fn positions(&self) -> SwitchPositions {
        let Self { rotary_1, rotary_2, dip_2, dip_3, termination } = *self;
        let dip = vec![false, dip_2, dip_3];
        SwitchPositions { rotary: [rotary_1, rotary_2], dip, termination }
    }

    fn at(positions: &SwitchPositions) -> Self {
        let [rotary_1, rotary_2] = positions.rotary;
        let dip = |number: usize| positions.dip.get(number - 1).copied().unwrap_or_default();
        let termination = positions.termination;
        Self { rotary_1, rotary_2, dip_2: dip(2), dip_3: dip(3), termination }
    }
}

impl Powered<DeviceNet> for Troubled<DeviceNetEncoder<PlantSensor>> {
    fn power_up(
        now: Instant,
        outfit: &Outfit<DeviceNet>,
        memory: &Start,
        sensor: PlantSensor,
        seed: u64,
    ) -> Self {
        let Outfit { product, switches, serial, .. } = outfit;
        let factory = Factory::with_serial(*serial);
        let encoder = DeviceNetEncoder::power_up(now, product, factory, *switches, memory, sensor);
        Self::new(encoder, seed)
    }

    fn sensor(&self) -> &PlantSensor {
        self.station().sensor()
    }

    fn sensor_mut(&mut self) -> &mut PlantSensor {
        self.station_mut().sensor_mut()
    }

    fn take_event(&mut self) -> Option<(Instant, Event)> {
        self.station_mut().take_event()
    }

    fn keep(&mut self, now: Instant) -> Option<Kept> {
        self.station_mut().keep(now)
    }

    fn kept(&mut self, now: Instant, result: Result<(), &MemoryError>) {
        self.station_mut().kept(now, result);
    }

    fn snapshot(&self, now: Instant) -> Snapshot {
        self.station().snapshot(now)
    }

    fn set_switches(&mut self, switches: codewheel_device::Switches) {
        self.station_mut().set_switches(switches);
    }

    fn change(&mut self, now: Instant, change: Change<'_>) -> Result<Begun, Refusal> {
        changes::change(self.station_mut(), now, change)
    }

    fn is_saving(&self) -> bool {
        self.station().is_saving()
    }

    fn drops(&self) -> Option<Drops> {
        Self::drops(self)
    }

    fn set_drops(&mut self, drops: Option<Drops>) {
        Self::set_drops(self, drops);
    }

    fn set_delay(&mut self, delay: Duration) {
        Self::set_delay(self, delay);
    }
}

/// The frames a station wants to see.
fn filters(station: &Member<DeviceNet>) -> Vec<Filter> {
    match station {
        Member::Device(device) => {
            device.powered().map(|encoder| encoder.station().filter()).into_iter().collect()
        }
        Member::Master(scanner) => scanner.filters().to_vec(),
    }
}

impl Line<DeviceNet> for Wire<Member<DeviceNet>> {
    type Id = NodeId;
    type Event = can::Event;
    type Statistics = Statistics;

    fn new(plan: &BusPlan<DeviceNet>, seed: u64) -> Self {
        let mut wire = Self::new(plan.bit_rate, seed);
        wire.set_faults(plan.faults);
        wire
    }

    fn attach(&mut self, name: String, station: Member<DeviceNet>, terminated: bool) -> NodeId {
        let filters = filters(&station);
        Self::attach(self, name, station, &filters, terminated)
    }

    fn detach(&mut self, id: NodeId) -> Option<Member<DeviceNet>> {
        Self::detach(self, id)
    }

    fn node(&self, id: NodeId) -> Option<&Member<DeviceNet>> {
        Self::node(self, id)
    }

    fn node_mut(&mut self, id: NodeId) -> Option<&mut Member<DeviceNet>> {
        Self::node_mut(self, id)
    }

    fn bus_off(&mut self, id: NodeId) {
        Self::bus_off(self, id, &mut |_| {});
    }

    fn set_terminated(&mut self, id: NodeId, terminated: bool) {
        Self::set_terminated(self, id, terminated);
    }

    fn set_corruption_at(&mut self, id: NodeId, probability: Option<f64>) {
        Self::set_corruption_at(self, id, probability);
    }

    fn run_until(&mut self, until: Instant, observer: &mut impl FnMut(&can::Event)) {
        Self::run_until(self, until, observer);
    }

    fn record(event: &can::Event, ears: &Ears) {
        if let can::Event::Frame { at, frame, .. } = event {
            ears.frame(*at, frame, Direction::Received);
        }
    }

    fn now(&self) -> Instant {
        Self::now(self)
    }

    fn statistics(&self) -> Statistics {
        Self::statistics(self)
    }

    fn load(newer: &Statistics, older: &Statistics) -> f64 {
        newer.bus_load_since(older)
    }

    fn warnings(&self) -> Vec<String> {
        Self::warnings(self)
    }
}

/// How many bits a controller stays off the bus, at least: 128 times 11.
const BUS_OFF_BITS: u64 = 128 * 11;

/// Stations that share a CAN port.
#[derive(Debug)]
pub struct Stations {
    composite: Composite<Member<DeviceNet>>,
    bus_off_time: Duration,
}

impl Shared<DeviceNet> for Stations {
    fn new(rate: BitRate) -> Self {
        let bus_off_time = Duration::from_nanos(BUS_OFF_BITS * rate.bit_nanos());
        Self { composite: Composite::new(), bus_off_time }
    }

    fn turn(
        &mut self,
        drive: &mut Loop,
        port: &mut Box<dyn CanPort>,
        until: Option<Instant>,
    ) -> Result<Vec<Notice>, LinkError> {
        Ok(drive.turn(&mut self.composite, &mut **port, until)?.notices)
    }
}

impl Medium<DeviceNet> for Stations {
    fn plug_in(&mut self, place: usize, station: Member<DeviceNet>) {
        self.composite.put(place, station);
    }

    fn unplug(&mut self, place: usize) -> Option<Member<DeviceNet>> {
        self.composite.take(place)
    }

    fn station(&self, place: usize) -> Option<&Member<DeviceNet>> {
        self.composite.station(place)
    }

    fn station_mut(&mut self, place: usize) -> Option<&mut Member<DeviceNet>> {
        self.composite.station_mut(place)
    }

    fn bus_off(&mut self, place: usize, now: Instant) {
        self.composite.bus_off(place, now, now + self.bus_off_time);
    }

    fn set_corruption(&mut self, _: usize, _: Option<f64>) {
        // A plan has this for virtual buses only.
    }
}

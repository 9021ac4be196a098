//! PROFIBUS-DP in a plant.

mod changes;
mod composite;
mod dp_master;
mod objects;
mod plan;
mod presets;

use std::sync::Arc;

use codewheel_capture::{self as capture, Condition, Direction};
use codewheel_device::profibus::Factory;
use codewheel_device::{Event, ProfibusEncoder, Snapshot, product};
use codewheel_encoder::{Kept, Start};
use codewheel_link::{
    BusUri, Clock, LinkError, Notice, Rs485Loop, Rs485Port, Rs485Tap, Waker, open_rs485,
};
use codewheel_profibus::{Baud, Timing};
use codewheel_sim::rs485::{self, Attachment, Faults, Hearing, NodeId, Statistics, Wire};
use codewheel_sim::{Drops, Troubled};
use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Duration, Instant};

use self::composite::Composite;
use self::dp_master::DpMaster;
use crate::check::baud_rate;
use crate::crew::{Medium, Member};
use crate::ears::Ears;
use crate::field_bus::{Begun, Change, FieldBus, Line, Outfit, Powered, Shared, Switches};
use crate::recording::Telegrams;
use crate::sensor::PlantSensor;
use crate::{
    BusPlan, Cause, DipSwitch, MemoryError, ObjectGroup, Refusal, RotarySwitch, StartError,
    SwitchPositions,
};

pub use plan::{DeviceOptions, DpMasterPlan, DpSlavePlan, PresetPlan};

/// PROFIBUS-DP, as the type parameter of plans and buses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profibus {}

impl Profibus {
    /// The rate that `text` names: `19.2k`, `1.5M`, or in bits per second, `19200`.
    #[must_use]
    pub fn rate(text: &str) -> Option<BaudRate> {
        baud_rate(text)
    }
}

/// The cable of a PROFIBUS.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cable {
    /// How long it is; `None`: nobody said.
    pub metres: Option<u32>,
}

impl FieldBus for Profibus {
    const BUS: product::Bus = product::Bus::Profibus;

    type Rate = BaudRate;
    type Cable = Cable;
    type Faults = Faults;
    type Switches = codewheel_device::profibus::Switches;
    type Options = DeviceOptions;
    type MasterPlan = DpMasterPlan;

    type Input<'a> = Input<'a>;
    type Output = Transmission;
    type Encoder = Troubled<ProfibusEncoder<PlantSensor>>;
    type Master = DpMaster;
    type Line = Wire<Member<Self>>;
    type Stations = Stations;
    type Port = Box<dyn Rs485Port>;
    type Loop = Rs485Loop;

    const ROTARY: [RotarySwitch; 2] = [
        RotarySwitch { label: "1", meaning: "tens of the station address", delivered: 0 },
        RotarySwitch { label: "2", meaning: "units of the station address", delivered: 0 },
    ];
    const DIP: &'static [DipSwitch] = &[];

    fn bit_rates() -> Vec<String> {
        BaudRate::ALL.iter().map(ToString::to_string).collect()
    }

    fn rate_apart(_: &Self::Switches, _: BaudRate) -> Option<BaudRate> {
        None
    }

    fn settings_fixed(is_served: bool) -> Option<&'static str> {
        (!is_served).then_some(objects::NOT_SERVED)
    }

    fn objects(
        outfit: &Outfit<Self>,
        encoder: Option<&Self::Encoder>,
        master: Option<(&DpMaster, u8)>,
    ) -> Vec<ObjectGroup> {
        let told = master.and_then(|(master, address)| master.user_parameters(address));
        objects::objects(outfit, encoder.map(Troubled::station), told)
    }

    fn make_master(plan: &DpMasterPlan, _: usize) -> Result<DpMaster, StartError> {
        Ok(DpMaster::new(plan)?)
    }

    fn open(uri: &BusUri, rate: BaudRate) -> Result<Box<dyn Rs485Port>, LinkError> {
        open_rs485(uri, rate)
    }

    fn describe(port: &Box<dyn Rs485Port>) -> String {
        port.describe()
    }

    fn waker(port: &Box<dyn Rs485Port>) -> Waker {
        port.waker()
    }

    fn drive(clock: Clock) -> Rs485Loop {
        Rs485Loop::new(clock)
    }

    fn captured(plan: &BusPlan<Self>) -> capture::Bus {
        let bus = capture::Bus::profibus(&plan.name, plan.bit_rate);
        // Who searches the rate has not been told it, and neither has anybody else.
        let searches = plan.masters.is_empty()
            && plan.devices.iter().any(|device| device.options.auto_baud)
            && matches!(plan.uri, BusUri::Rs485Device(_));
        let bits_per_second = bus.bits_per_second.filter(|_| !searches);
        capture::Bus { bits_per_second, ..bus }
    }

    fn listen(drive: &mut Rs485Loop, ears: Option<Arc<Ears>>, rate: BaudRate) {
        let tap = |ears| Box::new(Telegrams::new(ears, rate)) as Box<dyn Rs485Tap>;
        drive.set_tap(ears.map(tap));
    }
}

impl Switches for codewheel_device::profibus::Switches {
    fn position(&self) -> u8 {
        Self::address(self)
    }

    fn address(&self) -> Option<u8> {
        Some(Self::address(self))
    }

    fn termination(&self) -> bool {
        self.termination
    }

    fn positions(&self) -> SwitchPositions {
        let Self { rotary_1, rotary_2, termination } = *self;
        SwitchPositions { rotary: [rotary_1, rotary_2], dip: Vec::new(), termination }
    }

    fn at(positions: &SwitchPositions) -> Self {
        let [rotary_1, rotary_2] = positions.rotary;
        Self { rotary_1, rotary_2, termination: positions.termination }
    }
}

impl Powered<Profibus> for Troubled<ProfibusEncoder<PlantSensor>> {
    fn power_up(
        now: Instant,
        outfit: &Outfit<Profibus>,
        memory: &Start,
        sensor: PlantSensor,
        seed: u64,
    ) -> Self {
        let Outfit { product, switches, options, rate, simulated, serial, .. } = outfit;
        let factory = Factory {
            model: outfit.model(),
            serial: *serial,
            baud: if options.auto_baud { Baud::Search } else { Baud::Fixed(*rate) },
            timing: if *simulated { Timing::Exact } else { Timing::Coarse },
        };
        let encoder = ProfibusEncoder::power_up(now, product, factory, *switches, memory, sensor);
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

    fn set_switches(&mut self, switches: codewheel_device::profibus::Switches) {
        self.station_mut().set_switches(switches);
    }

    /// Only its master can, and this plant has none that serves it.
    fn change(&mut self, _: Instant, change: Change<'_>) -> Result<Begun, Refusal> {
        let what = match change {
            Change::Preset(_) => "a preset comes",
            _ => "parameters come",
        };
        let text = format!(
            "nothing was changed: on PROFIBUS {what} from the master, and no master of this plant \
             serves the device at this address; change it there"
        );
        Err(Refusal::new(Cause::Impossible, text))
    }

    /// Nobody asks for it on this bus.
    fn is_saving(&self) -> bool {
        false
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

impl Node for Member<Profibus> {
    fn baud_rate(&self) -> BaudRate {
        match self {
            Self::Device(device) => device.powered().map_or(BaudRate::Mbit12, Node::baud_rate),
            Self::Master(master) => master.baud_rate(),
        }
    }
}

impl Line<Profibus> for Wire<Member<Profibus>> {
    type Id = NodeId;
    type Event = rs485::Event;
    type Statistics = Statistics;

    fn new(plan: &BusPlan<Profibus>, seed: u64) -> Self {
        let mut wire = Self::new(seed);
        wire.set_faults(plan.faults);
        if let Some(metres) = plan.cable.metres {
            wire.set_cable_length(metres);
        }
        wire
    }

    fn attach(&mut self, name: String, station: Member<Profibus>, terminated: bool) -> NodeId {
        // A master looks at how far a telegram has come, and its clock counts microseconds.
        let is_master = station.master().is_some();
        let hearing = if is_master { Hearing::Characters } else { Hearing::Telegrams };
        let attachment = Attachment {
            terminated,
            microsecond_clock: is_master,
            hearing,
            ..Attachment::default()
        };
        Self::attach(self, name, station, attachment)
    }

    fn detach(&mut self, id: NodeId) -> Option<Member<Profibus>> {
        Self::detach(self, id)
    }

    fn node(&self, id: NodeId) -> Option<&Member<Profibus>> {
        Self::node(self, id)
    }

    fn node_mut(&mut self, id: NodeId) -> Option<&mut Member<Profibus>> {
        Self::node_mut(self, id)
    }

    fn bus_off(&mut self, _: NodeId) {
        // A plan has this for CAN only: an RS-485 station has no controller that gives up.
    }

    fn set_terminated(&mut self, id: NodeId, terminated: bool) {
        Self::set_terminated(self, id, terminated);
    }

    fn set_corruption_at(&mut self, id: NodeId, probability: Option<f64>) {
        Self::set_corruption_at(self, id, probability);
    }

    fn run_until(&mut self, until: Instant, observer: &mut impl FnMut(&rs485::Event)) {
        Self::run_until(self, until, observer);
    }

    fn record(event: &rs485::Event, ears: &Ears) {
        if let rs485::Event::Telegram { octets, end, intact, .. } = event {
            let condition = if *intact { Condition::Intact } else { Condition::Broken };
            ears.telegram(*end, octets.octets(), condition, Direction::Received);
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

/// Stations that share an RS-485 port.
#[derive(Debug)]
pub struct Stations(Composite<Member<Profibus>>);

impl Shared<Profibus> for Stations {
    fn new(rate: BaudRate) -> Self {
        Self(Composite::new(rate))
    }

    fn turn(
        &mut self,
        drive: &mut Rs485Loop,
        port: &mut Box<dyn Rs485Port>,
        until: Option<Instant>,
    ) -> Result<Vec<Notice>, LinkError> {
        Ok(drive.turn(&mut self.0, &mut **port, until)?.notices)
    }
}

impl Medium<Profibus> for Stations {
    fn plug_in(&mut self, place: usize, station: Member<Profibus>) {
        self.0.put(place, station);
    }

    fn unplug(&mut self, place: usize) -> Option<Member<Profibus>> {
        self.0.take(place)
    }

    fn station(&self, place: usize) -> Option<&Member<Profibus>> {
        self.0.station(place)
    }

    fn station_mut(&mut self, place: usize) -> Option<&mut Member<Profibus>> {
        self.0.station_mut(place)
    }

    fn bus_off(&mut self, _: usize, _: Instant) {
        // A plan has this for CAN only.
    }

    fn set_corruption(&mut self, _: usize, _: Option<f64>) {
        // A plan has this for virtual buses only.
    }
}

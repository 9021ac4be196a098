//! What sets one field bus apart from another in a plant; everything else is written once.
//!
//! A plant knows two field buses, [`DeviceNet`] and [`Profibus`]. Their stations share nothing but
//! [`Station`]: the one takes frames, the other octets. Yet a plant does the same with both: it
//! switches devices on with what their memory holds, pulls the levers of their faults, lets masters
//! talk to them, steps a wire in virtual time or turns a port, and shows what came of it. So all of
//! that has the field bus as a type parameter, and [`FieldBus`] says what the parameter stands for:
//!
//! | written once, for any field bus | what a field bus brings |
//! |---|---|
//! | [`BusPlan`], [`DevicePlan`](crate::DevicePlan) | rate, cable, switches, options of a device, plan of a master |
//! | `Device`: power, memory, trouble, reports | [`Powered`]: the encoder of that bus, made anew at each power-up |
//! | `Crew`: who is on the bus, its agenda of faults, its snapshots | [`Talker`]: the master of that bus |
//! | [`VirtualBus`](crate::VirtualBus) | [`Line`]: its simulated wire |
//! | [`PortBus`](crate::PortBus) | [`Shared`]: how stations share one port; the port and its loop |
//!
//! A [`Plant`](crate::Plant) holds its buses as [`AnyBusPlan`](crate::AnyBusPlan) and starts a
//! thread for each; from there on nothing asks any more which field bus it is.
//!
//! [`DeviceNet`]: crate::DeviceNet
//! [`Profibus`]: crate::Profibus

use std::fmt;
use std::sync::Arc;

use codewheel_capture as capture;
use codewheel_device::{Product, Snapshot, product};
use codewheel_encoder::{Block, Kept, Model, Start};
use codewheel_link::{BusUri, Clock, LinkError, Notice, Waker};
use codewheel_sim::Drops;
use codewheel_station::{Duration, Instant, Station};

use crate::crew::{Medium, Member};
use crate::ears::Ears;
use crate::sensor::{PlantSensor, SensorPlan};
use crate::snapshot::{CycleTimes, SlaveState, SwitchPositions};
use crate::{
    BusPlan, DipSwitch, MemoryError, ObjectGroup, Refusal, RotarySwitch, StartError, Value,
};

/// A station that speaks on the field bus `B`.
pub trait Speaks<B: FieldBus>:
    for<'a> Station<Input<'a> = B::Input<'a>, Output = B::Output> + fmt::Debug + Send
{
}

impl<B: FieldBus, S> Speaks<B> for S where
    S: for<'a> Station<Input<'a> = B::Input<'a>, Output = B::Output> + fmt::Debug + Send
{
}

/// A field bus that plants know: [`DeviceNet`](crate::DeviceNet) or
/// [`Profibus`](crate::Profibus). Others cannot be added from outside.
pub trait FieldBus: Copy + fmt::Debug + PartialEq + Send + Sized + 'static {
    /// Its name.
    const BUS: product::Bus;

    /// A bit rate.
    type Rate: Copy + fmt::Debug + fmt::Display + PartialEq + Send;
    /// What a plan says of the cable.
    type Cable: Copy + fmt::Debug + Default + PartialEq + Send;
    /// How often a virtual wire fails.
    type Faults: Copy + fmt::Debug + Default + PartialEq + Send;
    /// The switches of a device.
    type Switches: Switches;
    /// What else a device is told at power-up.
    type Options: Copy + fmt::Debug + Default + PartialEq + Send;
    /// The plan of a master.
    type MasterPlan: PlannedMaster;

    /// What the medium brings to a station.
    type Input<'a>;
    /// What a station gives to the medium.
    type Output;
    /// A device that has power.
    type Encoder: Powered<Self>;
    /// A master.
    type Master: Talker<Self>;
    /// The wire in virtual time.
    type Line: Line<Self>;
    /// Stations that share a port.
    type Stations: Shared<Self>;
    /// A real port.
    type Port: fmt::Debug + Send;
    /// The loop that turns a port.
    type Loop: fmt::Debug + Send;

    /// The rotary switches of a bus cover.
    const ROTARY: [RotarySwitch; 2];

    /// The DIP switches of a bus cover, without the terminating resistor.
    const DIP: &'static [DipSwitch];

    /// The rates that a device of it can have, as people write them.
    fn bit_rates() -> Vec<String>;

    /// The rate that the switches of a device set, where it is not that of its bus: it hears nobody,
    /// and nobody hears it.
    fn rate_apart(switches: &Self::Switches, rate: Self::Rate) -> Option<Self::Rate>;

    /// Why the settings of a device cannot be written, where a master of this plant serves it or not.
    fn settings_fixed(is_served: bool) -> Option<&'static str>;

    /// What can be read of a device and set, while it has power; its master, where one of this plant
    /// serves it at an address.
    fn objects(
        outfit: &Outfit<Self>,
        encoder: Option<&Self::Encoder>,
        master: Option<(&Self::Master, u8)>,
    ) -> Vec<ObjectGroup>;

    /// The master of a plan, which has the place `place` among the masters of its bus.
    ///
    /// # Errors
    /// [`StartError`] where it cannot be what the plan says.
    fn make_master(plan: &Self::MasterPlan, place: usize) -> Result<Self::Master, StartError>;

    /// Joins the bus that `uri` names.
    fn open(uri: &BusUri, rate: Self::Rate) -> Result<Self::Port, LinkError>;

    /// The port as a bus URI, with the TCP port it really got.
    fn describe(port: &Self::Port) -> String;

    /// What ends a wait of the port.
    fn waker(port: &Self::Port) -> Waker;

    /// A loop in the time of `clock`.
    fn drive(clock: Clock) -> Self::Loop;

    /// The bus of a plan, as captures name it.
    fn captured(plan: &BusPlan<Self>) -> capture::Bus;

    /// Hears what the loop moves over a port at `rate`, or no more.
    fn listen(drive: &mut Self::Loop, ears: Option<Arc<Ears>>, rate: Self::Rate);
}

/// Where the switches of a device stand.
pub trait Switches: Copy + fmt::Debug + PartialEq + Send {
    /// What the rotary switches say, 0 … 99.
    fn position(&self) -> u8;

    /// The address; `None` where the bus has no such address.
    fn address(&self) -> Option<u8>;

    /// Whether the terminating resistor is on.
    fn termination(&self) -> bool;

    /// Each of them; a DIP switch that means nothing is OFF.
    fn positions(&self) -> SwitchPositions;

    /// The switches in these positions.
    fn at(positions: &SwitchPositions) -> Self;
}

/// A change of the settings of a device.
#[derive(Clone, Copy, Debug)]
pub enum Change<'a> {
    /// One of them is written.
    Write(&'a str, &'a Value),
    /// The position of now becomes this.
    Preset(u32),
    /// Those in force are kept.
    Save,
    /// Those that are kept come into force.
    Restore,
    /// Those of a new device come into force.
    Reset,
}

/// How far a change has come.
#[derive(Clone, Debug, PartialEq)]
pub enum Begun {
    /// It is done, as this sentence says.
    Done(String),
    /// These settings are on their way into memory.
    Saving(Block),
    /// The master makes the device ready anew; then it is done, as this sentence says.
    Parameterizing(String),
    /// The master gives the preset with this number, which has this value.
    Presetting(u64, u32),
}

/// What every plan of a master says.
pub trait PlannedMaster: Clone + fmt::Debug + PartialEq + Send {
    /// What the wire calls a master: `scanner`.
    const KIND: &'static str;

    /// What messages call it.
    fn name(&self) -> &str;

    /// Its address.
    fn address(&self) -> u8;

    /// Whether its terminating resistor is on.
    fn termination(&self) -> bool;

    /// The addresses of the slaves it serves.
    fn slaves(&self) -> impl Iterator<Item = u8>;

    /// Whether it serves the device at `address`.
    fn serves(&self, address: u8) -> bool {
        self.slaves().any(|slave| slave == address)
    }
}

/// All that a device is switched on with, besides its memory.
#[derive(Clone, Debug)]
pub struct Outfit<B: FieldBus> {
    pub(crate) product: &'static Product,
    pub(crate) switches: B::Switches,
    pub(crate) options: B::Options,
    pub(crate) sensor: SensorPlan,
    pub(crate) rate: B::Rate,
    /// Whether the wire is simulated, so that everybody knows of bit times.
    pub(crate) simulated: bool,
    pub(crate) serial: u32,
}

impl<B: FieldBus> Outfit<B> {
    /// What it measures with.
    pub(crate) fn model(&self) -> Model {
        let geometry = self.sensor.geometry().unwrap_or(self.product.encoder.geometry);
        Model { geometry, ..self.product.encoder }
    }
}

/// A device with power, in the trouble it has with its bus.
pub trait Powered<B: FieldBus>: Speaks<B> {
    /// Switches a device on. What trouble there will be is drawn from `seed`.
    fn power_up(
        now: Instant,
        outfit: &Outfit<B>,
        memory: &Start,
        sensor: PlantSensor,
        seed: u64,
    ) -> Self;

    /// The sensor.
    fn sensor(&self) -> &PlantSensor;

    /// The sensor, to be changed; the device looks at it at its next `advance`.
    fn sensor_mut(&mut self) -> &mut PlantSensor;

    /// The oldest event that has not been fetched.
    fn take_event(&mut self) -> Option<(Instant, codewheel_device::Event)>;

    /// The record to write, if there is one.
    fn keep(&mut self, now: Instant) -> Option<Kept>;

    /// The write of that record has ended.
    fn kept(&mut self, now: Instant, result: Result<(), &MemoryError>);

    /// What the device shows of itself.
    fn snapshot(&self, now: Instant) -> Snapshot;

    /// Turns its switches.
    fn set_switches(&mut self, switches: B::Switches);

    /// Changes its settings, where they are its own.
    ///
    /// # Errors
    /// [`Refusal`]; nothing is changed.
    fn change(&mut self, now: Instant, change: Change<'_>) -> Result<Begun, Refusal>;

    /// Whether settings are on their way into memory because somebody asked for it.
    fn is_saving(&self) -> bool;

    /// Which of its outputs are dropped, with what is left of their count.
    fn drops(&self) -> Option<Drops>;

    /// Drops outputs from now on, or no more.
    fn set_drops(&mut self, drops: Option<Drops>);

    /// Holds each output back from now on.
    fn set_delay(&mut self, delay: Duration);
}

/// A slave as its master sees it now.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    pub(crate) state: SlaveState,
    pub(crate) position: Option<u32>,
    /// Counted since the master began.
    pub(crate) answers: u64,
    pub(crate) diagnosis: Option<crate::Diagnosis>,
}

/// A master.
pub trait Talker<B: FieldBus>: Speaks<B> {
    /// How it sees the slave at `address`; `None` where it does not serve it.
    fn slave(&self, address: u8) -> Option<Seen>;

    /// Whether it takes part.
    fn is_on_line(&self) -> bool;

    /// Its cycles.
    fn cycle_times(&self) -> CycleTimes;

    /// What it has to tell.
    fn take_event(&mut self) -> Option<Told> {
        None
    }

    /// Changes the settings of the slave at `address`, which measures with `model`; `None` where they
    /// are the slave's own.
    fn change(
        &mut self,
        now: Instant,
        address: u8,
        model: Model,
        change: Change<'_>,
    ) -> Option<Result<Begun, Refusal>> {
        let _ = (now, address, model, change);
        None
    }

    /// What became of a change; `None` as long as it is under way.
    fn ended(&self, address: u8, begun: &Begun) -> Option<Result<(), Refusal>> {
        let _ = (address, begun);
        None
    }

    /// Gives up a change that is under way.
    fn give_up(&mut self, address: u8, begun: &Begun) {
        let _ = (address, begun);
    }
}

/// Something that a master tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Told {
    pub(crate) at: Instant,
    pub(crate) text: String,
    pub(crate) trouble: bool,
}

/// A wire in virtual time.
pub trait Line<B: FieldBus>: Sized + fmt::Debug + Send {
    /// A station on it.
    type Id: Copy + fmt::Debug + Send;
    /// What an observer sees.
    type Event;
    /// What it counts.
    type Statistics: Copy + fmt::Debug + Send;

    /// The wire of a plan; what goes wrong on it is drawn from `seed`.
    fn new(plan: &BusPlan<B>, seed: u64) -> Self;
    /// Plugs a station in.
    fn attach(&mut self, name: String, station: Member<B>, terminated: bool) -> Self::Id;
    /// Unplugs it.
    fn detach(&mut self, id: Self::Id) -> Option<Member<B>>;
    /// The station.
    fn node(&self, id: Self::Id) -> Option<&Member<B>>;
    /// The station, to be changed.
    fn node_mut(&mut self, id: Self::Id) -> Option<&mut Member<B>>;
    /// Lets the controller of a station leave the bus, where there is one.
    fn bus_off(&mut self, id: Self::Id);
    /// Switches the terminating resistor of a station.
    fn set_terminated(&mut self, id: Self::Id, terminated: bool);
    /// Destroys what a station sends, or no more.
    fn set_corruption_at(&mut self, id: Self::Id, probability: Option<f64>);
    /// Moves time on.
    fn run_until(&mut self, until: Instant, observer: &mut impl FnMut(&Self::Event));
    /// Hears an event, where it is something that the wire carried.
    fn record(event: &Self::Event, ears: &Ears);
    /// The virtual time.
    fn now(&self) -> Instant;
    /// What has been counted.
    fn statistics(&self) -> Self::Statistics;
    /// The share of the time between two counts in which the wire was not idle.
    fn load(newer: &Self::Statistics, older: &Self::Statistics) -> f64;
    /// What is wrong with how it is wired.
    fn warnings(&self) -> Vec<String>;
}

/// Stations that share one port.
pub trait Shared<B: FieldBus>: Medium<B> + fmt::Debug + Send {
    /// None yet, at `rate`.
    fn new(rate: B::Rate) -> Self;

    /// One turn of the stations and the port; gives what the port has to tell.
    fn turn(
        &mut self,
        drive: &mut B::Loop,
        port: &mut B::Port,
        until: Option<Instant>,
    ) -> Result<Vec<Notice>, LinkError>;
}

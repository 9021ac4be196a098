//! What a device brings to the stack: its identity, its assemblies, its own objects.

use codewheel_station::can::BitRate;
use codewheel_station::{Instant, Writer};

use crate::explicit::{Error, Path, Service};
use crate::{Event, ProducedPath};

/// Who the device is (Identity object, class 01).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Attribute 1, vendor code.
    pub vendor: u16,
    /// Attribute 2, device type.
    pub device_type: u16,
    /// Attribute 3, product code.
    pub product_code: u16,
    /// Attribute 4, major revision, 1 … 127.
    pub major_revision: u8,
    /// Attribute 4, minor revision, 1 … 255.
    pub minor_revision: u8,
    /// Attribute 6, serial number; unique among all devices of the vendor.
    pub serial: u32,
    /// Attribute 7, product name, at most 32 characters.
    pub product_name: &'static str,
}

/// A class the device implements, as its class attributes tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Class {
    /// Class attribute 1, revision.
    pub revision: u16,
    /// Class attribute 2, the highest instance number.
    pub max_instance: u16,
}

/// When a request is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// At once, with what was written to the output.
    Now,
    /// After [`Server::complete`](crate::Server::complete). Until then further explicit requests
    /// get general status 10.
    Later,
}

/// The kinds of reset of the Identity object (service 05).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// Type 0: as if the power had been cycled.
    PowerCycle,
    /// Type 1: back to the defaults, then as if the power had been cycled.
    Defaults,
}

/// The positions of the switches that set address and bit rate, as read now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SwitchPositions {
    /// The address switches, 0 … 99.
    pub mac: u8,
    /// The bit rate switches.
    pub bit_rate: BitRate,
}

/// What the network part of a device keeps through a power cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NetworkSettings {
    /// DeviceNet object attribute 3, bus-off interrupt: false = stay off, true = reset the
    /// controller and check the MAC ID again.
    pub bus_off_interrupt: bool,
    /// Identity attribute 10, heartbeat interval in seconds; 0 = no heartbeat.
    pub heartbeat_interval: u8,
    /// Connection instance 2 attribute 14, where poll responses come from.
    pub poll_path: ProducedPath,
    /// Connection instance 4 attribute 14, where change of state and cyclic data come from.
    pub change_path: ProducedPath,
}

/// The device behind a [`Server`](crate::Server), lent to it for one call at a time.
///
/// Nothing here may panic: all arguments come from a peer.
pub trait Application {
    /// Who the device is.
    fn identity(&self) -> Identity;

    /// The bits of the Identity object's status word (attribute 5) that the device knows: 2
    /// configured, 8 … 11 faults. The stack adds bit 0, owned.
    fn status(&self) -> u16 {
        0
    }

    /// Identity attribute 9; changes when kept settings change.
    fn configuration_consistency(&self) -> u16 {
        0
    }

    /// Where the switches stand now; DeviceNet attributes 6 … 9.
    fn switches(&self) -> SwitchPositions;

    /// The octets of assembly `instance`, or `None` where there is no such assembly.
    fn assembly_size(&self, instance: u8) -> Option<usize>;

    /// Writes assembly `instance` as of `now` and returns its size. Called when the frame is
    /// built, for an `instance` that [`assembly_size`](Application::assembly_size) knows.
    fn produce(&mut self, now: Instant, instance: u8, octets: &mut [u8; 8]) -> usize;

    /// The highest instance number of the assemblies, class 04 attribute 2.
    fn highest_assembly(&self) -> u8;

    /// Whether assembly `instance` has changed enough since its last
    /// [`change_produced`](Application::change_produced) that a change of state connection shall
    /// produce it. Asked often while such a connection is established.
    fn has_changed(&mut self, instance: u8) -> bool {
        let _ = instance;
        false
    }

    /// Assembly `instance` was produced by the change of state or cyclic connection just now:
    /// changes count from here.
    fn change_produced(&mut self, instance: u8) {
        let _ = instance;
    }

    /// The class `class`, or `None` where the device has none. The stack's own classes 01 … 05 and
    /// 2B are not asked for.
    fn class(&self, class: u8) -> Option<Class>;

    /// Writes the value of an attribute (Get_Attribute_Single).
    ///
    /// # Errors
    /// What the refusal says to the peer; 16 for an unknown instance, 14 for an unknown attribute.
    fn get(&mut self, now: Instant, path: Path, out: &mut Writer<'_>) -> Result<(), Error>;

    /// Changes an attribute (Set_Attribute_Single).
    ///
    /// # Errors
    /// What the refusal says to the peer. A refused write has changed nothing.
    fn set(&mut self, now: Instant, path: Path, data: &[u8]) -> Result<Done, Error>;

    /// Any other service on one of the device's own classes.
    ///
    /// # Errors
    /// What the refusal says to the peer; 16 for an unknown instance, 08 for an unknown service.
    fn serve(
        &mut self,
        now: Instant,
        request: Request<'_>,
        out: &mut Writer<'_>,
    ) -> Result<Done, Error>;

    /// Prepares a reset of the Identity object. The power cycle itself is asked for by
    /// [`Server::power_cycle_due`](crate::Server::power_cycle_due) once the answer is on the wire.
    ///
    /// # Errors
    /// What the refusal says to the peer.
    fn reset(&mut self, now: Instant, reset: Reset) -> Result<Done, Error>;

    /// Keeps the network settings in non-volatile memory, at once.
    fn keep(&mut self, now: Instant, settings: NetworkSettings);

    /// Something happened that a person may want to see.
    fn notice(&mut self, now: Instant, event: Event) {
        let _ = (now, event);
    }
}

/// A service on an object, as [`Application::serve`] gets it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request<'a> {
    /// The service code.
    pub service: Service,
    /// The class.
    pub class: u8,
    /// The instance; 0 is the class itself.
    pub instance: u8,
    /// Everything behind the instance.
    pub data: &'a [u8],
}

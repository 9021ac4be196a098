//! Where a station sits: on a real port, or on a simulated wire.

use codewheel_link::{CanPort, LinkError, Loop, Notice, Rs485Loop, Rs485Port};
use codewheel_station::rs485::Node;
use codewheel_station::{Instant, Station, can};

/// A station together with what drives it.
///
/// All that people do with a bus goes through a seat, turn by turn, so that it runs the same on a
/// real port and, in tests, on a wire in virtual time.
pub trait Seat {
    /// The station.
    type Station;

    /// The time of the station.
    fn now(&self) -> Instant;

    /// The station, to be asked and told. It is served in the next [`turn`](Self::turn).
    fn station(&mut self) -> &mut Self::Station;

    /// Lets time pass: until `until`, or until something has arrived or fallen due, whichever is
    /// first. Gives what people may want to hear.
    ///
    /// # Errors
    /// [`LinkError`] when the port is lost for good. A seat on which a person can ask for an end fails
    /// one turn then, and goes on for as long as it takes to undo what was begun.
    fn turn(&mut self, until: Instant) -> Result<Vec<Notice>, LinkError>;
}

/// A seat that is lent.
impl<S: Seat + ?Sized> Seat for &mut S {
    type Station = S::Station;

    fn now(&self) -> Instant {
        S::now(self)
    }

    fn station(&mut self) -> &mut Self::Station {
        S::station(self)
    }

    fn turn(&mut self, until: Instant) -> Result<Vec<Notice>, LinkError> {
        S::turn(self, until)
    }
}

/// A seat on a CAN port.
#[derive(Debug)]
pub struct CanSeat<S> {
    station: S,
    port: Box<dyn CanPort>,
    drive: Loop,
}

impl<S> CanSeat<S> {
    /// Seats `station` on `port`, in the time of `drive`.
    #[must_use]
    pub fn new(station: S, port: Box<dyn CanPort>, drive: Loop) -> Self {
        Self { station, port, drive }
    }
}

impl<S> Seat for CanSeat<S>
where
    S: for<'a> Station<Input<'a> = can::Input<'a>, Output = can::Frame>,
{
    type Station = S;

    fn now(&self) -> Instant {
        self.drive.clock().now()
    }

    fn station(&mut self) -> &mut S {
        &mut self.station
    }

    fn turn(&mut self, until: Instant) -> Result<Vec<Notice>, LinkError> {
        Ok(self.drive.turn(&mut self.station, self.port.as_mut(), Some(until))?.notices)
    }
}

/// A seat on an RS-485 port.
#[derive(Debug)]
pub struct Rs485Seat<S> {
    station: S,
    port: Box<dyn Rs485Port>,
    drive: Rs485Loop,
}

impl<S> Rs485Seat<S> {
    /// Seats `station` on `port`, in the time of `drive`.
    #[must_use]
    pub fn new(station: S, port: Box<dyn Rs485Port>, drive: Rs485Loop) -> Self {
        Self { station, port, drive }
    }
}

impl<S: Node> Seat for Rs485Seat<S> {
    type Station = S;

    fn now(&self) -> Instant {
        self.drive.clock().now()
    }

    fn station(&mut self) -> &mut S {
        &mut self.station
    }

    fn turn(&mut self, until: Instant) -> Result<Vec<Notice>, LinkError> {
        Ok(self.drive.turn(&mut self.station, self.port.as_mut(), Some(until))?.notices)
    }
}

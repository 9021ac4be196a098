//! What people do to a device while the plant runs, and what comes of it.

use std::error::Error;
use std::fmt;

/// Something that is done to one device of a bus.
///
/// The shaft and the switches are those of the device; settings go the way they go on its bus, so
/// they are refused for the same reasons and kept in the same memory. On DeviceNet they are written
/// locally, as a service of the same rows. On PROFIBUS they belong to the master: where a master of
/// this plant serves the device, its parameters change and it makes the slave ready anew.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Turns the shaft by so many raw steps, clockwise where positive; quick, but not faster than a
    /// shaft can turn. Several in a row add up. A motion that goes on ends with it.
    TurnBy(i64),
    /// Turns the shaft the shorter way to where the sensor has this raw code.
    TurnTo(u32),
    /// Moves the shaft on from where it is, in the notation of
    /// [`codewheel_sim::shaft`], without `angle=` and without files.
    Motion(String),
    /// Holds the shaft where it is.
    Stop,
    /// Switches the device on, or off at this very moment: a record on its way is torn.
    Power(bool),
    /// Turns switches. The terminating resistor acts at once, the others at the next power-up.
    Switch(Switch),
    /// Lets something go wrong from now on, in the words of plant files without `at=`:
    /// `jump steps=4000`, `late-answers delay=20ms for=5s`.
    Begin(String),
    /// Ends the fault of this kind: `late-answers`.
    End(String),
    /// Writes a setting.
    Write {
        /// Its key, as [`Object::key`](crate::Object::key) has it: `steps-per-turn`.
        key: String,
        /// A number, or one of the names of its values.
        value: Value,
    },
    /// Makes this the position of now.
    Preset(u32),
    /// Keeps the settings in force through a power cut; done when they are written.
    Save,
    /// Brings the settings back that are kept. On PROFIBUS: those that the plan gives the master.
    Restore,
    /// Brings the settings of a new device into force, unsaved.
    Reset,
}

/// The switches to turn; `None` leaves one as it is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Switch {
    /// Both rotary switches, 0 … 9 each: the tens and the units of the address.
    pub rotary: Option<[u8; 2]>,
    /// The DIP switches 1, 2, …, true for ON; as many as
    /// [`DeviceDescription::dip`](crate::DeviceDescription::dip) names.
    pub dip: Option<Vec<bool>>,
    /// The terminating resistor.
    pub termination: Option<bool>,
}

/// The value of an object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Value {
    /// A number.
    Number(i64),
    /// A text; for a write the name of a value: `CCW`.
    Text(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Text(text) => text.fmt(f),
        }
    }
}

/// What a command has done, as a sentence without a full stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Done(pub String);

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Why nothing was done, or why nobody knows what was.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// What kind of reason it is.
    pub cause: Cause,
    /// What was tried, what came back, and what to do.
    pub text: String,
}

/// Kinds of reasons to refuse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cause {
    /// No such bus, device or object.
    Unknown,
    /// What was given makes no sense or is out of its range.
    Value,
    /// The device or its bus cannot do this now.
    State,
    /// This device, or this plant, can never do it.
    Impossible,
    /// The device tried, and failed.
    Failed,
    /// The bus is busy with other commands; later there is room again.
    Busy,
    /// No answer came in time; it may be done all the same.
    Late,
    /// The bus has stopped.
    Stopped,
}

impl Refusal {
    pub(crate) fn new(cause: Cause, text: impl Into<String>) -> Self {
        Self { cause, text: text.into() }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Error for Refusal {}

/// A command under way on a bus that is run by hand. What became of it is asked with
/// [`VirtualBus::take_answer`](crate::VirtualBus::take_answer) or
/// [`PortBus::take_answer`](crate::PortBus::take_answer).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ticket(pub(crate) u64);

//! What a device tells people, in place of a log.

use core::fmt;

use codewheel_encoder::ssi::LineFault;
use codewheel_station::Instant;

/// Something that happened to a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The device was switched on, or restarted by a reset.
    PowerUp,
    /// On the network side.
    Network(codewheel_devicenet::Event),
    /// On the PROFIBUS side.
    Profibus(codewheel_profibus::Event),
    /// The address switches give no address of the bus.
    IllegalAddress {
        /// Where they stand, 64 … 99.
        switches: u8,
    },
    /// What the master of a PROFIBUS encoder sent is refused.
    Refused(crate::profibus::Refusal),
    /// What the master of a PROFIBUS encoder sent has a consequence that people should know.
    Remark(crate::profibus::Remark),
    /// Two samples lie further apart than the shaft can turn.
    PositionError,
    /// The position error has ended by itself.
    PositionErrorEnded,
    /// The SSI line of a converter cannot be read, or has another fault than before.
    LineFault(LineFault),
    /// The SSI line can be read again.
    LineRight,
    /// The voltage of the lithium cell is too low.
    CellLow,
    /// The voltage of the lithium cell is right again.
    CellRight,
    /// A setting was really changed.
    SettingChanged {
        /// Class 2Fh attribute.
        attribute: u8,
    },
    /// A preset was executed.
    Preset,
    /// The settings in force were saved.
    Saved,
    /// The saved settings were restored.
    Restored,
    /// The defaults were loaded.
    Reset,
    /// The memory did not take a record; a Save on DeviceNet is given up after 5 s without a word.
    KeepFailed,
    /// Both records in memory are damaged: the device runs with the defaults.
    MemoryDamaged,
    /// The very first write to the memory was interrupted: the device runs with the defaults.
    FirstWriteInterrupted,
    /// One of two records is damaged; the other one is in force.
    RecordDamaged,
}

impl Event {
    /// Whether something went wrong that a person should look at.
    #[must_use]
    pub const fn is_trouble(&self) -> bool {
        match self {
            Self::Profibus(event) => event.is_trouble(),
            Self::Remark(remark) => remark.is_trouble(),
            Self::Network(codewheel_devicenet::Event::Faulted(_))
            | Self::IllegalAddress { .. }
            | Self::Refused(_)
            | Self::PositionError
            | Self::LineFault(_)
            | Self::CellLow
            | Self::KeepFailed
            | Self::MemoryDamaged
            | Self::FirstWriteInterrupted
            | Self::RecordDamaged => true,
            _ => false,
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PowerUp => f.write_str("power up"),
            Self::Network(event) => event.fmt(f),
            Self::Profibus(event) => event.fmt(f),
            Self::IllegalAddress { switches } => {
                write!(f, "address switches at {switches}: DeviceNet has 0–63")
            }
            Self::Refused(refusal) => refusal.tell(f),
            Self::Remark(remark) => remark.fmt(f),
            Self::PositionError => f.write_str("position error: the code jumped"),
            Self::PositionErrorEnded => f.write_str("position error ended"),
            Self::LineFault(fault) => fault.fmt(f),
            Self::LineRight => f.write_str("the SSI line brings words again"),
            Self::CellLow => f.write_str("lithium cell: voltage too low"),
            Self::CellRight => f.write_str("lithium cell: voltage right again"),
            Self::SettingChanged { attribute } => write!(f, "2f/1/{attribute} changed"),
            Self::Preset => f.write_str("preset executed"),
            Self::Saved => f.write_str("settings saved"),
            Self::Restored => f.write_str("saved settings restored"),
            Self::Reset => f.write_str("reset to the defaults"),
            Self::KeepFailed => f.write_str("the memory did not take the record"),
            Self::MemoryDamaged => {
                f.write_str("both records in memory are damaged: running with the defaults")
            }
            Self::FirstWriteInterrupted => {
                f.write_str("the first write to memory was interrupted: running with the defaults")
            }
            Self::RecordDamaged => {
                f.write_str("one of two records in memory is damaged: the other one is in force")
            }
        }
    }
}

/// What can happen to a device on any bus.
///
/// [`Event`] is as wide as the widest event of any bus; the ring of each bus holds a type of its own,
/// so that no device pays for what it never says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Happening {
    PowerUp,
    PositionError,
    PositionErrorEnded,
    LineFault(LineFault),
    LineRight,
    CellLow,
    CellRight,
    Preset,
    KeepFailed,
    MemoryDamaged,
    FirstWriteInterrupted,
    RecordDamaged,
}

impl From<Happening> for Event {
    fn from(happening: Happening) -> Self {
        match happening {
            Happening::PowerUp => Self::PowerUp,
            Happening::PositionError => Self::PositionError,
            Happening::PositionErrorEnded => Self::PositionErrorEnded,
            Happening::LineFault(fault) => Self::LineFault(fault),
            Happening::LineRight => Self::LineRight,
            Happening::CellLow => Self::CellLow,
            Happening::CellRight => Self::CellRight,
            Happening::Preset => Self::Preset,
            Happening::KeepFailed => Self::KeepFailed,
            Happening::MemoryDamaged => Self::MemoryDamaged,
            Happening::FirstWriteInterrupted => Self::FirstWriteInterrupted,
            Happening::RecordDamaged => Self::RecordDamaged,
        }
    }
}

/// What a DeviceNet encoder tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DeviceNetEvent {
    Device(Happening),
    Network(codewheel_devicenet::Event),
    IllegalAddress { switches: u8 },
    SettingChanged { attribute: u8 },
    Saved,
    Restored,
    Reset,
}

impl From<Happening> for DeviceNetEvent {
    fn from(happening: Happening) -> Self {
        Self::Device(happening)
    }
}

impl From<DeviceNetEvent> for Event {
    fn from(event: DeviceNetEvent) -> Self {
        match event {
            DeviceNetEvent::Device(happening) => happening.into(),
            DeviceNetEvent::Network(event) => Self::Network(event),
            DeviceNetEvent::IllegalAddress { switches } => Self::IllegalAddress { switches },
            DeviceNetEvent::SettingChanged { attribute } => Self::SettingChanged { attribute },
            DeviceNetEvent::Saved => Self::Saved,
            DeviceNetEvent::Restored => Self::Restored,
            DeviceNetEvent::Reset => Self::Reset,
        }
    }
}

/// How many events wait to be fetched before the oldest is lost.
const EVENTS: usize = 6;

/// The last events, with a count of those lost.
#[derive(Clone, Debug)]
pub(crate) struct Events<E> {
    events: [Option<E>; EVENTS],
    /// When each of them happened; apart from them, since together they would take half as much
    /// again.
    times: [Instant; EVENTS],
    next: u8,
    lost: u32,
}

impl<E: Copy> Events<E> {
    pub(crate) const fn new() -> Self {
        Self { events: [None; EVENTS], times: [Instant::ZERO; EVENTS], next: 0, lost: 0 }
    }

    pub(crate) fn push(&mut self, now: Instant, event: impl Into<E>) {
        let next = usize::from(self.next);
        if let (Some(place), Some(time)) = (self.events.get_mut(next), self.times.get_mut(next)) {
            *time = now;
            if place.replace(event.into()).is_some() {
                self.lost = self.lost.saturating_add(1);
            }
        }
        self.next = (self.next + 1) % EVENTS as u8;
    }

    /// The oldest event not yet fetched.
    pub(crate) fn take(&mut self) -> Option<(Instant, E)> {
        let (newer, older) = self.events.split_at_mut_checked(usize::from(self.next))?;
        let (newer_times, older_times) = self.times.split_at_checked(usize::from(self.next))?;
        let older = older.iter_mut().zip(older_times);
        let newer = newer.iter_mut().zip(newer_times);
        older.chain(newer).find_map(|(event, time)| Some((*time, event.take()?)))
    }

    pub(crate) const fn lost(&self) -> u32 {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_come_in_order_and_the_oldest_are_lost_and_counted() {
        let mut events = Events::<Event>::new();
        assert_eq!(events.take(), None);
        for attribute in 0..11 {
            let now = Instant::from_nanos(u64::from(attribute));
            events.push(now, Event::SettingChanged { attribute });
        }
        assert_eq!(events.lost(), 5);
        for attribute in 5..11 {
            let event = Event::SettingChanged { attribute };
            assert_eq!(events.take(), Some((Instant::from_nanos(u64::from(attribute)), event)));
        }
        assert_eq!(events.take(), None);
    }
}

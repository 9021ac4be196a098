//! What a device tells people, in place of a log.

use core::fmt;

use codewheel_station::Instant;

/// Something that happened to a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The device was switched on, or restarted by a reset.
    PowerUp,
    /// On the network side.
    Network(codewheel_devicenet::Event),
    /// The address switches give no address of the bus.
    IllegalAddress {
        /// Where they stand, 64 … 99.
        switches: u8,
    },
    /// Two samples lie further apart than the shaft can turn.
    PositionError,
    /// The position error has ended by itself.
    PositionErrorEnded,
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
    /// The memory did not take a record, or not within 5 s.
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
        matches!(
            self,
            Self::Network(codewheel_devicenet::Event::Faulted(_))
                | Self::IllegalAddress { .. }
                | Self::PositionError
                | Self::CellLow
                | Self::KeepFailed
                | Self::MemoryDamaged
                | Self::FirstWriteInterrupted
                | Self::RecordDamaged
        )
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PowerUp => f.write_str("power up"),
            Self::Network(event) => event.fmt(f),
            Self::IllegalAddress { switches } => {
                write!(f, "address switches at {switches}: DeviceNet has 0–63")
            }
            Self::PositionError => f.write_str("position error: the code jumped"),
            Self::PositionErrorEnded => f.write_str("position error ended"),
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

/// How many events wait to be fetched before the oldest is lost.
const EVENTS: usize = 6;

/// The last events, with a count of those lost.
#[derive(Clone, Debug)]
pub(crate) struct Events {
    events: [Option<Event>; EVENTS],
    /// When each of them happened; apart from them, since together they would take half as much
    /// again.
    times: [Instant; EVENTS],
    next: u8,
    lost: u32,
}

impl Events {
    pub(crate) const fn new() -> Self {
        Self { events: [None; EVENTS], times: [Instant::ZERO; EVENTS], next: 0, lost: 0 }
    }

    pub(crate) fn push(&mut self, now: Instant, event: Event) {
        let next = usize::from(self.next);
        if let (Some(place), Some(time)) = (self.events.get_mut(next), self.times.get_mut(next)) {
            *time = now;
            if place.replace(event).is_some() {
                self.lost = self.lost.saturating_add(1);
            }
        }
        self.next = (self.next + 1) % EVENTS as u8;
    }

    /// The oldest event not yet fetched.
    pub(crate) fn take(&mut self) -> Option<(Instant, Event)> {
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
        let mut events = Events::new();
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

//! What people do to a device while it runs, and which faults it has of it.

use codewheel_encoder::Block;
use codewheel_sim::shaft::{Faulty, Shaft};
use codewheel_station::{Duration, Instant, Station};

use super::{Device, Power};
use crate::fault_kinds::kind_of;
use crate::field_bus::{Begun, Change, FieldBus, Powered, Switches};
use crate::{Cause, Refusal, SwitchPositions};

impl<B: FieldBus> Device<B> {
    /// Has the shaft do something else from `now` on, in these words.
    pub(crate) fn set_shaft(&mut self, now: Instant, shaft: Shaft, motion: &str, by_hand: bool) {
        self.motion = motion.into();
        self.by_hand = by_hand;
        match &mut self.power {
            Power::On(encoder) => {
                // A device whose shaft rested has not looked at it for a while.
                encoder.sensor_mut();
                encoder.advance(now);
                encoder.sensor_mut().set_shaft(shaft);
            }
            Power::Off(sensor) => sensor.set_shaft(shaft),
        }
    }

    /// Turns the switches; they act at the next power-up.
    pub(crate) fn set_switches(&mut self, positions: SwitchPositions) {
        let switches = B::Switches::at(&positions);
        self.outfit.switches = switches;
        self.switches = positions;
        if let Power::On(encoder) = &mut self.power {
            encoder.set_switches(switches);
        }
    }

    /// Changes its settings, where they are its own.
    pub(crate) fn change(&mut self, now: Instant, change: Change<'_>) -> Result<Begun, Refusal> {
        let Power::On(encoder) = &mut self.power else {
            let text = "the device has no power; nothing was changed: switch it on first";
            return Err(Refusal::new(Cause::State, text));
        };
        let begun = encoder.change(now, change);
        self.tend(now);
        begun
    }

    /// What became of a Save of `block`; `None` as long as it is under way.
    pub(crate) fn saved(&self, now: Instant, block: &Block) -> Option<Result<(), Refusal>> {
        let failed = |text| Some(Err(Refusal::new(Cause::Failed, text)));
        match &self.power {
            Power::Off(_) => failed(
                "the power was cut while the record was written: the next power-up shows whether \
                 the old or the new settings are kept",
            ),
            Power::On(encoder) if encoder.is_saving() => None,
            Power::On(encoder) if encoder.snapshot(now).saved == *block => Some(Ok(())),
            Power::On(_) => failed("the memory did not take the record: save once more"),
        }
    }

    /// Which kinds of faults it has now, power and bus apart.
    pub(crate) fn faults(&self, faults: &mut Vec<&'static str>) {
        let sensor = self.sensor();
        if sensor.shaft().is_some_and(Faulty::is_cell_low) {
            faults.push("cell-low");
        }
        if sensor.shaft().is_some_and(Faulty::is_stuck) {
            faults.push("stuck");
        }
        let drops = match &self.power {
            Power::On(encoder) => encoder.drops(),
            Power::Off(_) => self.drops,
        };
        if drops.is_some_and(|drops| drops.count != Some(0)) {
            faults.push("drop-answers");
        }
        if self.delay > Duration::ZERO {
            faults.push("late-answers");
        }
        faults.extend(sensor.line_fault().map(kind_of));
    }
}

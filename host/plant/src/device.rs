//! A device in a plant: switched on or off, with its memory, its faults and what it has told.

mod hands;
mod state;

use std::sync::Arc;

use codewheel_device::{Event, Snapshot};
use codewheel_encoder::{Geometry, Start};
use codewheel_link::Waker;
use codewheel_sim::Drops;
use codewheel_station::{Duration, Instant, Station, earlier};
use fastrand::Rng;

use crate::fault::{Action, Lever};
use crate::fault_kinds;
use crate::field_bus::{FieldBus, Outfit, Powered, Switches};
use crate::keeper::Keeper;
use crate::repeats::Repeats;
use crate::report::{Report, Reports, What};
use crate::sensor::PlantSensor;
use crate::{BusPlan, DeviceDescription, DevicePlan, MemoryError, StartError, SwitchPositions};

/// A device with everything that outlives its power.
#[derive(Debug)]
pub struct Device<B: FieldBus> {
    outfit: Outfit<B>,
    power: Power<B>,
    keeper: Keeper,
    reports: Reports,
    repeats: Repeats<Event>,
    random: Rng,
    /// Trouble between the device and its bus, over power cuts.
    drops: Option<Drops>,
    delay: Duration,
    /// How its shaft moves, as text.
    motion: Arc<str>,
    /// Whether it was turned by hand last, so that turning it further adds up.
    by_hand: bool,
    /// Where its switches stand.
    switches: SwitchPositions,
    /// Where they stood at the last power-up.
    switches_in_force: SwitchPositions,
    /// The rate of its switches is not that of the bus.
    is_apart: bool,
    /// It has been reset over the bus, and its switches had been turned.
    has_moved: bool,
    rate: B::Rate,
}

#[derive(Debug)]
enum Power<B: FieldBus> {
    On(Box<B::Encoder>),
    /// The shaft turns on.
    Off(PlantSensor),
}

impl<B: FieldBus> Device<B> {
    /// A device of `bus` that is still switched off. What chance there is in it is drawn from
    /// `seed`.
    ///
    /// # Errors
    /// [`StartError`] where its sensor cannot be had.
    pub(crate) fn new(
        bus: &BusPlan<B>,
        plan: &DevicePlan<B>,
        keeper: Keeper,
        seed: u64,
    ) -> Result<Self, StartError> {
        let kept = match keeper.start() {
            Start::Kept { kept, .. } => Some(kept.serial),
            _ => None,
        };
        let address = u32::from(plan.switches.position());
        let outfit = Outfit {
            product: plan.product,
            switches: plan.switches,
            options: plan.options,
            sensor: plan.sensor.clone(),
            rate: bus.bit_rate,
            simulated: bus.is_virtual(),
            serial: plan.serial.or(kept).unwrap_or(address),
        };
        Ok(Self {
            power: Power::Off(PlantSensor::new(&plan.sensor, plan.shaft.clone())?),
            outfit,
            keeper,
            reports: Reports::default(),
            repeats: Repeats::new(),
            random: Rng::with_seed(seed),
            drops: None,
            delay: Duration::ZERO,
            motion: plan.shaft_text.as_str().into(),
            by_hand: false,
            switches: plan.switches.positions(),
            switches_in_force: plan.switches.positions(),
            is_apart: false,
            has_moved: false,
            rate: bus.bit_rate,
        })
    }

    /// What does not change of it, as `plan` says it; `is_served`: by a master of this plant.
    pub(crate) fn describe(&self, plan: &DevicePlan<B>, is_served: bool) -> DeviceDescription {
        let geometry = self.geometry();
        DeviceDescription {
            name: plan.name.clone(),
            product: plan.product,
            serial: self.outfit.serial,
            singleturn_resolution: geometry.singleturn_resolution(),
            revolutions: geometry.revolutions(),
            bit_rates: B::bit_rates(),
            rotary: B::ROTARY,
            dip: B::DIP.to_vec(),
            shaft_fixed: self.outfit.sensor.fixed(),
            settings_fixed: B::settings_fixed(is_served),
            faults: fault_kinds::of(plan.product, &plan.sensor, self.outfit.simulated),
        }
    }

    /// What it measures with.
    pub(crate) fn geometry(&self) -> Geometry {
        self.outfit.model().geometry
    }

    /// Whether it may have another address than when it was plugged in.
    pub(crate) const fn has_moved(&self) -> bool {
        self.has_moved
    }

    /// It is plugged in anew.
    pub(crate) const fn settle(&mut self) {
        self.has_moved = false;
    }

    /// What observers of a wire call it.
    pub(crate) fn label(&self) -> String {
        format!("{} at {}", self.outfit.product.title, self.outfit.switches.position())
    }

    pub(crate) const fn outfit(&self) -> &Outfit<B> {
        &self.outfit
    }

    pub(crate) fn sensor(&self) -> &PlantSensor {
        match &self.power {
            Power::On(encoder) => encoder.sensor(),
            Power::Off(sensor) => sensor,
        }
    }

    pub(crate) const fn motion(&self) -> &Arc<str> {
        &self.motion
    }

    pub(crate) const fn is_by_hand(&self) -> bool {
        self.by_hand
    }

    pub(crate) const fn switches(&self) -> &SwitchPositions {
        &self.switches
    }

    /// Where the switches stood at the power-up that is in force, or will stand at the next one.
    pub(crate) const fn switches_at_power_up(&self) -> &SwitchPositions {
        match &self.power {
            Power::On(_) => &self.switches_in_force,
            Power::Off(_) => &self.switches,
        }
    }

    /// Writes a memory file in a thread of its own from now on.
    pub(crate) fn write_in_thread(&mut self, waker: &Waker) {
        self.keeper.write_in_thread(waker);
    }

    pub(crate) fn report(&mut self, at: Instant, what: What) {
        self.reports.push(at, what);
    }

    pub(crate) fn take_reports(&mut self) -> Vec<Report> {
        self.reports.take()
    }

    /// Switches the device on with what its memory holds.
    pub(crate) fn power_up(&mut self, now: Instant) {
        let Power::Off(sensor) = &mut self.power else { return };
        let sensor = sensor.take();
        let seed = self.random.u64(..);
        let start = self.keeper.start();
        let mut encoder = B::Encoder::power_up(now, &self.outfit, start, sensor, seed);
        encoder.set_drops(self.drops);
        encoder.set_delay(self.delay);
        self.power = Power::On(Box::new(encoder));
        self.wake(now);
        self.listen();
    }

    /// What every power-up does: the switches are read.
    fn wake(&mut self, now: Instant) {
        self.switches_in_force.clone_from(&self.switches);
        let apart = B::rate_apart(&self.outfit.switches, self.rate);
        self.is_apart = apart.is_some();
        if let Some(apart) = apart {
            let text = format!(
                "the switches say {apart} and the bus runs at {}: nobody hears the device",
                self.rate
            );
            self.reports.push(now, What::Wiring(text));
        }
    }

    /// Takes the power away, at any moment.
    pub(crate) fn power_cut(&mut self, now: Instant) {
        self.listen();
        if let Some(Err(error)) = self.keeper.cut(&mut self.random) {
            self.reports.push(now, What::NotKept(error.to_string()));
        }
        let Power::On(encoder) = &mut self.power else { return };
        self.drops = encoder.drops();
        let sensor = encoder.sensor_mut().take();
        self.power = Power::Off(sensor);
    }

    /// What it does about a fault that is neither power nor bus.
    pub(crate) fn suffer(&mut self, now: Instant, action: Action) {
        match action {
            Action::Begin(Lever::DropAnswers { probability, count, .. }) => {
                self.set_drops(Some(Drops { probability, count }));
            }
            Action::End(Lever::DropAnswers { .. }) => self.set_drops(None),
            Action::Begin(Lever::LateAnswers { delay, .. }) => self.set_delay(delay),
            Action::End(Lever::LateAnswers { .. }) => self.set_delay(Duration::ZERO),
            Action::Begin(lever) if lever.is_of_the_sensor() => match &mut self.power {
                Power::On(encoder) => {
                    // A device whose shaft rests has not looked at it for a while, and would find
                    // nothing wrong with any change since.
                    encoder.sensor_mut();
                    encoder.advance(now);
                    encoder.sensor_mut().suffer(lever);
                }
                Power::Off(sensor) => sensor.suffer(lever),
            },
            Action::Begin(_) | Action::End(_) => {}
        }
    }

    fn set_drops(&mut self, drops: Option<Drops>) {
        self.drops = drops;
        if let Power::On(encoder) = &mut self.power {
            encoder.set_drops(drops);
        }
    }

    fn set_delay(&mut self, delay: Duration) {
        self.delay = delay;
        if let Power::On(encoder) = &mut self.power {
            encoder.set_delay(delay);
        }
    }

    /// The device while it has power.
    pub(crate) fn powered(&self) -> Option<&B::Encoder> {
        match &self.power {
            Power::On(encoder) => Some(encoder),
            Power::Off(_) => None,
        }
    }

    /// What it shows of itself; `None` without power.
    pub(crate) fn snapshot(&self, now: Instant) -> Option<Snapshot> {
        self.powered().map(|encoder| encoder.snapshot(now))
    }

    /// Waits until the memory has taken everything.
    pub(crate) fn finish_memory(&mut self, now: Instant) {
        loop {
            self.hand_over_record(now);
            let Some(result) = self.keeper.finish() else { return };
            self.kept(now, result);
        }
    }

    /// Hears what the device has to tell.
    fn listen(&mut self) {
        let Power::On(encoder) = &mut self.power else { return };
        let mut restarted = None;
        while let Some((at, event)) = encoder.take_event() {
            if event == Event::PowerUp {
                restarted = Some(at);
            }
            match self.repeats.tell(at, event) {
                None => {}
                Some(1) => self.reports.push(at, What::Device(event)),
                Some(count) => self.reports.push(at, What::Repeated { event, count }),
            }
        }
        // A reset over the bus is a power-up too.
        if let Some(at) = restarted
            && self.switches_in_force != self.switches
        {
            self.has_moved = true;
            self.wake(at);
        }
    }

    /// Begins to write what the device wants to keep.
    fn hand_over_record(&mut self, now: Instant) {
        let Power::On(encoder) = &mut self.power else { return };
        if let Some(kept) = encoder.keep(now) {
            self.keeper.begin(now, kept);
        }
    }

    fn kept(&mut self, now: Instant, result: Result<(), MemoryError>) {
        let Power::On(encoder) = &mut self.power else { return };
        encoder.kept(now, result.as_ref().copied());
        if let Err(error) = result {
            self.reports.push(now, What::NotKept(error.to_string()));
        }
    }

    /// Serves the memory and hears the device.
    fn tend(&mut self, now: Instant) {
        self.hand_over_record(now);
        while let Some(result) = self.keeper.done(now) {
            self.kept(now, result);
            self.hand_over_record(now);
        }
        self.listen();
    }
}

impl<B: FieldBus> Station for Device<B> {
    type Input<'a> = B::Input<'a>;
    type Output = B::Output;

    fn handle(&mut self, now: Instant, input: B::Input<'_>) {
        if let Power::On(encoder) = &mut self.power
            && !self.is_apart
        {
            encoder.handle(now, input);
            self.tend(now);
        }
    }

    fn advance(&mut self, now: Instant) {
        if let Power::On(encoder) = &mut self.power {
            encoder.advance(now);
            self.tend(now);
        }
    }

    fn transmit(&mut self, now: Instant) -> Option<B::Output> {
        let Power::On(encoder) = &mut self.power else { return None };
        if self.is_apart {
            return None;
        }
        let output = encoder.transmit(now);
        self.hand_over_record(now);
        self.listen();
        output
    }

    fn deadline(&self) -> Option<Instant> {
        match &self.power {
            Power::On(encoder) => earlier(encoder.deadline(), self.keeper.deadline()),
            Power::Off(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DeviceNet;
    use codewheel_device::{MemoryState, Product, Switches};
    use codewheel_link::BusUri;
    use codewheel_sim::can::parse_frame;
    use codewheel_sim::shaft::Shaft;
    use codewheel_station::can::{BitRate, Input};

    fn micros(micros: u64) -> Instant {
        Instant::ZERO + Duration::from_micros(micros)
    }

    /// Runs the device alone up to `until`; whatever it says is sent at once.
    fn run(device: &mut Device<DeviceNet>, until: Instant) -> Vec<String> {
        let mut said = Vec::new();
        let mut now = Instant::ZERO;
        loop {
            device.advance(now);
            while let Some(frame) = device.transmit(now) {
                said.push(frame.to_string());
                device.handle(now, Input::Sent(&frame));
            }
            match device.deadline() {
                Some(at) if at <= until => now = at.max(now),
                _ => return said,
            }
        }
    }

    fn hear(device: &mut Device<DeviceNet>, now: Instant, text: &str) -> Option<String> {
        device.handle(now, Input::Frame(&parse_frame(text).unwrap()));
        let frame = device.transmit(now)?;
        device.handle(now, Input::Sent(&frame));
        Some(frame.to_string())
    }

    /// On-line since two seconds, allocated, with a COS delta of 7 in force.
    fn set_up(seed: u64) -> Device<DeviceNet> {
        let product = Product::find("amg11-d29").unwrap();
        let shaft = Shaft::parse("still", 8192, 65536).unwrap();
        let bus = BusPlan::new("b", BusUri::Virtual("b".into()), BitRate::Kbit125);
        let plan = DevicePlan::new(product, Switches::set_to(5, BitRate::Kbit125), shaft);
        let (keeper, _) = Keeper::open(None, product).unwrap();
        let mut device = Device::new(&bus, &plan, keeper, seed).unwrap();
        device.power_up(Instant::ZERO);
        assert_eq!(run(&mut device, micros(2_100_000)).len(), 2, "two checks");
        let at = micros(2_100_000);
        assert_eq!(hear(&mut device, at, "42E#0A4B0301030A").as_deref(), Some("42B#0ACB00"));
        assert_eq!(hear(&mut device, at, "42C#8A00102F010B0700").as_deref(), Some("42B#8AC000"));
        device.handle(at, Input::Frame(&parse_frame("42C#8A810000").unwrap()));
        while device.transmit(at).is_some() {}
        device
    }

    /// AMG manual §9.1: the switches are read at power-up, and a reset is one.
    #[test]
    fn a_reset_over_the_bus_reads_the_switches_and_has_the_device_plugged_in_anew() {
        let mut device = set_up(1);
        device.take_reports();
        let positions = SwitchPositions { rotary: [0, 9], ..device.switches().clone() };
        device.set_switches(positions);
        assert_eq!(device.switches_at_power_up().rotary, [0, 5]);
        assert!(!device.has_moved());
        let at = micros(2_110_000);
        assert_eq!(hear(&mut device, at, "42C#0A050101").as_deref(), Some("42B#0A85"));
        assert_eq!(device.switches_at_power_up().rotary, [0, 9]);
        assert!(device.has_moved() && device.label().ends_with("at 9"));
    }

    #[test]
    fn a_power_cut_at_any_moment_of_a_save_leaves_the_old_or_the_new_settings() {
        let (mut kept, mut lost, mut torn) = (0, 0, 0);
        for cut in 0..240 {
            let mut device = set_up(cut);
            let asked = micros(2_110_000);
            assert_eq!(hear(&mut device, asked, "42C#0A162F01"), None, "it is being written");
            let at = asked + Duration::from_micros(50 * cut);
            device.advance(at);
            let answered = device.transmit(at).is_some();
            device.power_cut(at);
            assert!(device.snapshot(at).is_none() && device.transmit(at).is_none());
            device.power_up(at);
            let snapshot = device.snapshot(at).expect("it has power");
            assert_ne!(snapshot.memory, MemoryState::Damaged);
            match snapshot.in_force.cos_delta {
                7 => kept += 1,
                _ => lost += 1,
            }
            assert!(!answered || snapshot.in_force.cos_delta == 7, "it was promised");
            let told = device.take_reports();
            torn += usize::from(told.iter().any(|report| {
                report.what == What::Device(codewheel_device::Event::FirstWriteInterrupted)
            }));
        }
        assert!(kept >= 40 && lost > 150 && torn > 150, "{kept} {lost} {torn}");
    }
}

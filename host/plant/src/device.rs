//! A device in a plant: switched on or off, with its memory, its faults and what it has told.

use codewheel_device::{DeviceNetEncoder, Factory, Product, Snapshot, Switches};
use codewheel_encoder::Start;
use codewheel_sim::can::{Drops, Troubled};
use codewheel_sim::shaft::{Faulty, Shaft};
use codewheel_station::can::{Filter, Frame, Input};
use codewheel_station::{Duration, Instant, Station, earlier};
use fastrand::Rng;

use crate::fault::{Action, Lever};
use crate::keeper::Keeper;
use crate::report::{Report, Reports, What};
use crate::{DevicePlan, MemoryError};

type Encoder = DeviceNetEncoder<Faulty<Shaft>>;

/// A device with everything that outlives its power.
#[derive(Debug)]
pub(crate) struct Device {
    product: &'static Product,
    switches: Switches,
    serial: u32,
    power: Power,
    keeper: Keeper,
    reports: Reports,
    random: Rng,
    /// Trouble between the device and its bus, over power cuts.
    drops: Option<Drops>,
    delay: Duration,
}

#[derive(Debug)]
enum Power {
    On(Box<Troubled<Encoder>>),
    /// The shaft turns on.
    Off(Faulty<Shaft>),
}

impl Device {
    /// A device that is still switched off. What chance there is in it is drawn from `seed`.
    pub(crate) fn new(plan: &DevicePlan, keeper: Keeper, seed: u64) -> Self {
        let kept = match keeper.start() {
            Start::Kept { kept, .. } => Some(kept.serial),
            _ => None,
        };
        let address = u32::from(plan.switches.address());
        let codes = plan.product.encoder.geometry.range();
        Self {
            product: plan.product,
            switches: plan.switches,
            serial: plan.serial.or(kept).unwrap_or(address),
            power: Power::Off(Faulty::new(plan.shaft.clone(), codes)),
            keeper,
            reports: Reports::default(),
            random: Rng::with_seed(seed),
            drops: None,
            delay: Duration::ZERO,
        }
    }

    pub(crate) fn report(&mut self, at: Instant, what: What) {
        self.reports.push(at, what);
    }

    pub(crate) fn take_reports(&mut self) -> Vec<Report> {
        self.reports.take()
    }

    /// Switches the device on with what its memory holds.
    pub(crate) fn power_up(&mut self, now: Instant) {
        let Power::Off(sensor) = &self.power else { return };
        let encoder = Encoder::power_up(
            now,
            self.product,
            Factory::with_serial(self.serial),
            self.switches,
            self.keeper.start(),
            sensor.clone(),
        );
        let mut troubled = Troubled::new(encoder, self.random.u64(..));
        troubled.set_drops(self.drops);
        troubled.set_delay(self.delay);
        self.power = Power::On(Box::new(troubled));
        self.listen();
    }

    /// Takes the power away, at any moment.
    pub(crate) fn power_cut(&mut self, now: Instant) {
        self.listen();
        if let Some(Err(error)) = self.keeper.cut(&mut self.random) {
            self.reports.push(now, What::NotKept(error.to_string()));
        }
        let Power::On(troubled) = &mut self.power else { return };
        self.drops = troubled.drops();
        let sensor = troubled.station_mut().sensor_mut().clone();
        self.power = Power::Off(sensor);
    }

    /// What it does about a fault that is neither power nor bus.
    pub(crate) fn suffer(&mut self, action: Action) {
        match action {
            Action::Begin(Lever::Jump(steps)) => self.sensor().jump(steps),
            Action::Begin(Lever::CellLow(low)) => self.sensor().set_cell_low(low),
            Action::Begin(Lever::Stuck(stuck)) => self.sensor().set_stuck(stuck),
            Action::Begin(Lever::DropAnswers { probability, count, .. }) => {
                self.set_drops(Some(Drops { probability, count }));
            }
            Action::End(Lever::DropAnswers { .. }) => self.set_drops(None),
            Action::Begin(Lever::LateAnswers { delay, .. }) => self.set_delay(delay),
            Action::End(Lever::LateAnswers { .. }) => self.set_delay(Duration::ZERO),
            Action::Begin(_) | Action::End(_) => {}
        }
    }

    fn set_drops(&mut self, drops: Option<Drops>) {
        self.drops = drops;
        if let Power::On(troubled) = &mut self.power {
            troubled.set_drops(drops);
        }
    }

    fn set_delay(&mut self, delay: Duration) {
        self.delay = delay;
        if let Power::On(troubled) = &mut self.power {
            troubled.set_delay(delay);
        }
    }

    fn sensor(&mut self) -> &mut Faulty<Shaft> {
        match &mut self.power {
            Power::On(troubled) => troubled.station_mut().sensor_mut(),
            Power::Off(sensor) => sensor,
        }
    }

    /// What it shows of itself; `None` without power.
    pub(crate) fn snapshot(&self, now: Instant) -> Option<Snapshot> {
        match &self.power {
            Power::On(troubled) => Some(troubled.station().snapshot(now)),
            Power::Off(_) => None,
        }
    }

    /// The frames it wants to see.
    pub(crate) fn filters(&self) -> Vec<Filter> {
        match &self.power {
            Power::On(troubled) => vec![troubled.station().filter()],
            Power::Off(_) => Vec::new(),
        }
    }

    /// Waits until the memory has taken everything.
    pub(crate) fn finish_memory(&mut self, now: Instant) {
        loop {
            self.hand_over_record(now);
            let Some(result) = self.keeper.finish() else { return };
            self.kept(now, result);
        }
    }

    /// Hears what the device has to tell, and begins to write what it wants to keep.
    fn listen(&mut self) {
        let Power::On(troubled) = &mut self.power else { return };
        while let Some((at, event)) = troubled.station_mut().take_event() {
            self.reports.push(at, What::Device(event));
        }
    }

    fn hand_over_record(&mut self, now: Instant) {
        let Power::On(troubled) = &mut self.power else { return };
        if let Some(kept) = troubled.station_mut().keep(now) {
            self.keeper.begin(now, kept);
        }
    }

    fn kept(&mut self, now: Instant, result: Result<(), MemoryError>) {
        let Power::On(troubled) = &mut self.power else { return };
        troubled.station_mut().kept(now, result.as_ref().copied());
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

impl Station for Device {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        if let Power::On(troubled) = &mut self.power {
            troubled.handle(now, input);
            self.tend(now);
        }
    }

    fn advance(&mut self, now: Instant) {
        if let Power::On(troubled) = &mut self.power {
            troubled.advance(now);
            self.tend(now);
        }
    }

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        let Power::On(troubled) = &mut self.power else { return None };
        let frame = troubled.transmit(now);
        self.hand_over_record(now);
        self.listen();
        frame
    }

    fn deadline(&self) -> Option<Instant> {
        match &self.power {
            Power::On(troubled) => earlier(troubled.deadline(), self.keeper.deadline()),
            Power::Off(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_device::MemoryState;
    use codewheel_sim::can::parse_frame;
    use codewheel_station::can::BitRate;

    fn micros(micros: u64) -> Instant {
        Instant::ZERO + Duration::from_micros(micros)
    }

    /// Runs the device alone up to `until`; whatever it says is sent at once.
    fn run(device: &mut Device, until: Instant) -> Vec<String> {
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

    fn hear(device: &mut Device, now: Instant, text: &str) -> Option<String> {
        device.handle(now, Input::Frame(&parse_frame(text).unwrap()));
        let frame = device.transmit(now)?;
        device.handle(now, Input::Sent(&frame));
        Some(frame.to_string())
    }

    /// On-line since two seconds, allocated, with a COS delta of 7 in force.
    fn set_up(seed: u64) -> Device {
        let product = Product::find("amg11-d29").unwrap();
        let shaft = Shaft::parse("still", 8192, 65536).unwrap();
        let plan = DevicePlan::new(product, Switches::set_to(5, BitRate::Kbit125), shaft);
        let (keeper, _) = Keeper::open(None, product).unwrap();
        let mut device = Device::new(&plan, keeper, seed);
        device.power_up(Instant::ZERO);
        assert_eq!(run(&mut device, micros(2_100_000)).len(), 2, "two checks");
        let at = micros(2_100_000);
        assert_eq!(hear(&mut device, at, "42E#0A4B0301030A").as_deref(), Some("42B#0ACB00"));
        assert_eq!(hear(&mut device, at, "42C#8A00102F010B0700").as_deref(), Some("42B#8AC000"));
        device.handle(at, Input::Frame(&parse_frame("42C#8A810000").unwrap()));
        while device.transmit(at).is_some() {}
        device
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

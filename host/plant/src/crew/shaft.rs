//! Shafts that people turn while a bus runs.

use codewheel_encoder::DEFAULT_SPEED_LIMIT;
use codewheel_sim::shaft::Shaft;
use codewheel_station::{Duration, Instant};

use super::commands::lost;
use super::{Crew, Medium};
use crate::field_bus::FieldBus;
use crate::{Cause, Refusal};

/// The shortest time in which a shaft is turned by hand.
const QUICK: Duration = Duration::from_millis(50);
/// How fast it is turned at most, in turns a minute: no position error comes of it.
const FAST: u64 = DEFAULT_SPEED_LIMIT as u64 * 3 / 4;
/// How far it is turned at most, in turns.
const FAR: u64 = 65_536;
impl<B: FieldBus> Crew<B> {
    /// Has the shaft do what `what` makes of it: a shaft, the motion in words, whether that is by hand,
    /// and what was done.
    fn move_shaft(
        &mut self,
        now: Instant,
        place: usize,
        medium: &mut impl Medium<B>,
        what: impl FnOnce(&Shaft, bool) -> Result<(Shaft, String, bool, String), Refusal>,
    ) -> Result<String, Refusal> {
        let name = self.devices[place].name.clone();
        let Some(device) = self.device_mut(place, medium) else { return Err(lost(&name)) };
        if let Some(why) = device.outfit().sensor.fixed() {
            let text = format!("cannot turn the shaft of {name}: {why}");
            return Err(Refusal::new(Cause::Impossible, text));
        }
        let Some(disc) = device.sensor().shaft() else { return Err(lost(&name)) };
        let (shaft, motion, by_hand, done) = what(disc.sensor(), device.is_by_hand())?;
        device.set_shaft(now, shaft, &motion, by_hand);
        Ok(done)
    }

    /// Turns the shaft by what `steps` makes of the raw code that its sensor shows and of the steps
    /// that are left of an earlier turn.
    pub(super) fn turn(
        &mut self,
        now: Instant,
        place: usize,
        medium: &mut impl Medium<B>,
        steps: impl FnOnce(u32, i64) -> i64,
    ) -> Result<String, Refusal> {
        let Some(device) = self.device(place, medium) else {
            return Err(lost(&self.devices[place].name));
        };
        let per_turn = device.geometry().singleturn_resolution();
        let jumped = device.sensor().shaft().map_or(0, |disc| disc.jumped());
        self.move_shaft(now, place, medium, |shaft, by_hand| {
            let code = (u64::from(shaft.code(now)) + u64::from(jumped)) % u64::from(shaft.codes());
            let left = if by_hand { shaft.steps_left(now) } else { 0 };
            let steps = steps(code as u32, left);
            let lasts = turning_time(steps, per_turn)?;
            let done = format!(
                "the shaft turns by {steps} steps in {} ms",
                lasts.as_nanos().div_ceil(1_000_000)
            );
            Ok((shaft.turned(now, steps, lasts), "by hand".to_owned(), true, done))
        })
    }

    /// Turns the shaft the shorter way to where the sensor shows `code`.
    pub(super) fn turn_to(
        &mut self,
        now: Instant,
        place: usize,
        code: u32,
        medium: &mut impl Medium<B>,
    ) -> Result<String, Refusal> {
        let codes = self.device(place, medium).map_or(0, |device| device.geometry().range());
        if code >= codes {
            let text = format!(
                "cannot turn the shaft to raw code {code}: it is 0 to {}; nothing was turned",
                codes.saturating_sub(1)
            );
            return Err(Refusal::new(Cause::Value, text));
        }
        self.turn(now, place, medium, |from, _| {
            let (codes, way) = (i64::from(codes), i64::from(code) - i64::from(from));
            // The shorter way; of two equal ones clockwise.
            (way + (codes - 1) / 2).rem_euclid(codes) - (codes - 1) / 2
        })
    }

    /// Has the shaft move on as `text` says.
    pub(super) fn set_motion(
        &mut self,
        now: Instant,
        place: usize,
        text: &str,
        medium: &mut impl Medium<B>,
    ) -> Result<String, Refusal> {
        let refused = |why: String| {
            let text = format!("cannot move the shaft so: {why}; it does what it did");
            Refusal::new(Cause::Value, text)
        };
        let mut words = text.split_whitespace();
        if words.next() == Some("csv") {
            return Err(refused(
                "files are read when a plant starts, so name it in the plan".into(),
            ));
        }
        if words.any(|word| word.starts_with("angle=")) {
            let why = "a motion goes on from where the shaft is, so leave out angle=".to_owned();
            return Err(refused(why));
        }
        let Some(device) = self.device(place, medium) else {
            return Err(lost(&self.devices[place].name));
        };
        let geometry = device.geometry();
        let shaft = Shaft::parse(text, geometry.singleturn_resolution(), geometry.revolutions());
        let shaft = shaft.map_err(|error| refused(error.to_string()))?;
        let motion = text.split_whitespace().collect::<Vec<_>>().join(" ");
        self.move_shaft(now, place, medium, |before, _| {
            let done = format!("the shaft moves on: {motion}");
            Ok((shaft.going_on_from(before, now), motion, false, done))
        })
    }

    /// Holds the shaft where it is.
    pub(super) fn hold(
        &mut self,
        now: Instant,
        place: usize,
        medium: &mut impl Medium<B>,
    ) -> Result<String, Refusal> {
        self.move_shaft(now, place, medium, |shaft, _| {
            Ok((shaft.held(now), "still".to_owned(), false, "the shaft rests".to_owned()))
        })
    }
}

/// How long it takes to turn a shaft by hand.
fn turning_time(steps: i64, per_turn: u32) -> Result<Duration, Refusal> {
    let (way, per_turn) = (steps.unsigned_abs(), u64::from(per_turn));
    if way > FAR.saturating_mul(per_turn) {
        let text = format!("cannot turn the shaft by {steps} steps: it is {FAR} turns at most");
        return Err(Refusal::new(Cause::Value, text));
    }
    let nanos = u128::from(way) * 60_000_000_000 / u128::from(FAST * per_turn.max(1));
    Ok(Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX)).max(QUICK))
}

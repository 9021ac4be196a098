//! The encoder: follows the shaft from sample to sample and says where it stands.

use codewheel_station::Instant;

use crate::alarm::{DEFAULT_SPEED_LIMIT, PositionError};
use crate::ssi::LineFault;
use crate::transform::Transform;
use crate::velocity::Velocity;
use crate::{Block, Direction, Model, Reading, Reference, Refusal, Sample, Settings};

/// An absolute rotary encoder: one settings block in force, one shaft, no bus.
///
/// Whoever owns it samples the shaft with every position it needs, and every millisecond while the
/// shaft moves and something waits for a change; a shaft at rest needs no sample. Between two
/// samples the shaft must turn less than half the range, or a crossing of the raw zero is missed.
#[derive(Clone, Debug)]
pub struct Encoder {
    model: Model,
    block: Block,
    transform: Transform,
    /// k: how often the raw code has passed its own zero, clockwise positive. It belongs to the
    /// shaft: no setting ever resets it. 64 bits, see [`Block::crossings_at_change`].
    crossings: i64,
    /// r of the newest sample, or of what `known` says.
    code: u32,
    known: Known,
    /// When the newest sample was taken.
    sampled_at: Instant,
    cell_low: bool,
    /// What was wrong with the newest reading.
    line_fault: Option<LineFault>,
    /// The settings changed before the first sample, which may still move k.
    change_awaits_sample: bool,
    position_error: PositionError,
    velocity: Velocity,
}

/// What the encoder knows of the shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Known {
    /// Nothing since power-up; the first sample infers no crossing.
    Nothing,
    /// The reference kept before power-off; the first sample may reveal a crossing.
    Reference,
    /// The newest sample.
    Sample,
}

impl Encoder {
    /// The encoder at power-up, with the saved block in force and not yet sampled.
    ///
    /// With a `reference` on a multiturn product, the first sample finds whether the raw code
    /// passed its zero without power. Without one, k starts at the block's k₀: on a singleturn
    /// product the position after power-up is that of the turn the settings were made in, and
    /// stays so if the same block is restored later (decision).
    ///
    /// # Errors
    /// What [`Block::check`] refuses: the record belongs to another product. Take
    /// [`with_defaults`](Self::with_defaults) and tell the user.
    pub fn power_up(
        model: Model,
        block: Block,
        reference: Option<Reference>,
    ) -> Result<Self, Refusal> {
        block.check(model)?;
        Ok(Self::started(model, block, reference))
    }

    /// The encoder at power-up with the defaults of its product, which are always legal: for a
    /// fresh device, and where nothing whole or nothing fitting was kept.
    #[must_use]
    pub fn with_defaults(model: Model) -> Self {
        Self::started(model, Block::default_for(model), None)
    }

    fn started(model: Model, block: Block, reference: Option<Reference>) -> Self {
        let (crossings, code, known) = match reference {
            Some(kept) if model.geometry.is_multiturn() => {
                (kept.crossings, kept.code % model.geometry.range(), Known::Reference)
            }
            _ => (block.crossings_at_change, 0, Known::Nothing),
        };
        let turned = crossings.wrapping_sub(block.crossings_at_change);
        let singleturn_resolution = model.geometry.singleturn_resolution();
        Self {
            model,
            block,
            transform: Transform::new(model, &block.settings, turned, block.offset),
            crossings,
            code,
            known,
            sampled_at: Instant::ZERO,
            cell_low: false,
            line_fault: None,
            change_awaits_sample: false,
            position_error: PositionError::new(DEFAULT_SPEED_LIMIT, singleturn_resolution),
            velocity: Velocity::new(),
        }
    }

    /// Takes in what the sensor says at `now`; `now` never goes back. A code of N or more is taken
    /// modulo N.
    ///
    /// Two samples less than 2.5 ms apart that differ by more than the shaft can turn raise the
    /// position error; the position follows the newer one all the same. The first sample after
    /// power-up raises none.
    ///
    /// Where the reading failed, the last good position is held, none as long as there was no good
    /// one, and every failed reading renews the position error. A repeated reading changes nothing;
    /// the encoder goes on once there is a new one.
    // Inlined, so that a sensor that always measures pays nothing for those that may fail.
    #[inline]
    pub fn sample(&mut self, now: Instant, sample: Sample) {
        match sample.reading {
            Reading::Fresh => self.measure(now, sample.code, sample.cell_low),
            Reading::Repeated => self.advance(now),
            Reading::Failed(fault) => self.fail(now, fault),
        }
    }

    /// A sample with a code, in parts that fit registers.
    fn measure(&mut self, now: Instant, code: u32, cell_low: bool) {
        // N is a power of two.
        let code = code & (self.model.geometry.range() - 1);
        self.position_error.advance(now);
        match self.known {
            Known::Sample => {
                let elapsed = now.since(self.sampled_at);
                if self.velocity.wants(self.sampled_at, elapsed) {
                    self.velocity.keep((self.sampled_at, self.unwrapped()));
                }
                if code != self.code {
                    self.position_error.judge(now, elapsed, self.shorter_way_to(code));
                    self.follow(code);
                }
            }
            Known::Reference => {
                self.follow(code);
                if self.change_awaits_sample {
                    self.begin_range_here();
                }
            }
            Known::Nothing => {}
        }
        self.known = Known::Sample;
        self.code = code;
        self.sampled_at = now;
        self.cell_low = cell_low;
        self.line_fault = None;
    }

    /// A sample without a code, from a line that does not answer.
    #[cold]
    fn fail(&mut self, now: Instant, fault: LineFault) {
        self.line_fault = Some(fault);
        self.position_error.raise(now);
    }

    /// Whether the shaft has been sampled since power-up. Until then position and code mean
    /// nothing.
    #[must_use]
    pub fn has_sample(&self) -> bool {
        self.known == Known::Sample
    }

    /// The position at the newest sample, 0 … T−1 steps (DeviceNet manual §8, attr 12).
    ///
    /// Decision: attr 12 says "1 to overall resolution", the preset 0 … T−1; a preset of 0 needs
    /// the second.
    #[must_use]
    pub fn position(&self) -> u32 {
        self.transform.position(self.code)
    }

    /// u, the position at the newest sample in steps, not wrapped into the range and without the
    /// offset: what a change of state is measured with.
    ///
    /// It starts near 0 with every real change of the settings, and may jump with
    /// [`set_preset`](Self::set_preset) and [`load`](Self::load); take it anew after these.
    #[must_use]
    pub fn unwrapped(&self) -> i64 {
        self.transform.unwrapped(self.code)
    }

    /// r, the raw code of the newest sample, 0 … N−1.
    #[must_use]
    pub const fn code(&self) -> u32 {
        self.code
    }

    /// Whether there is a position error (DeviceNet manual §8, attr 83 bit 0 and attr 85; PROFIBUS
    /// manual §7.2, octet 8 bit 0). Ends by [`advance`](Self::advance) or the next sample.
    #[must_use]
    pub const fn alarm(&self) -> bool {
        self.position_error.is_on()
    }

    /// Whether the lithium cell was too low at the newest sample (DeviceNet manual §8, attr 86
    /// bit 4; PROFIBUS manual §7.2, octets 20 and 21). Always false for products without a cell.
    #[must_use]
    pub const fn warning(&self) -> bool {
        self.cell_low && self.model.lithium_cell
    }

    /// What was wrong with the newest reading of the SSI line; `None` from the first good one on,
    /// while the position error it raised goes on to its end. Always `None` without such a line.
    #[must_use]
    pub const fn line_fault(&self) -> Option<LineFault> {
        self.line_fault
    }

    /// Lets the position error end when its 2.5 s are over. Calling it early or twice does
    /// nothing.
    pub fn advance(&mut self, now: Instant) {
        self.position_error.advance(now);
    }

    /// When [`advance`](Self::advance) must be called at the latest: the end of the position
    /// error.
    #[must_use]
    pub const fn deadline(&self) -> Option<Instant> {
        self.position_error.deadline()
    }

    /// Steps per second: what the unwrapped position moved by in the 100 ms before `now`, times
    /// ten.
    ///
    /// Before its first sample and after its newest the shaft counts as at rest, so the velocity
    /// grows over 100 ms after power-up and after a change of the settings, and is 0 when the last
    /// sample is 100 ms old. For display only (decision): no configuration or assembly of the
    /// manuals carries it.
    #[must_use]
    pub fn velocity(&self, now: Instant) -> i64 {
        if !self.has_sample() {
            return 0;
        }
        self.velocity.per_second(now, (self.sampled_at, self.unwrapped()))
    }

    /// The product.
    #[must_use]
    pub const fn model(&self) -> Model {
        self.model
    }

    /// The settings in force.
    #[must_use]
    pub const fn settings(&self) -> Settings {
        self.block.settings
    }

    /// The offset in force, −(T−1) … T−1 steps (DeviceNet manual §8, attr 91).
    #[must_use]
    pub const fn offset(&self) -> i32 {
        self.block.offset
    }

    /// The preset as last written, 0 … T−1 (DeviceNet manual §8, attr 10).
    #[must_use]
    pub const fn preset(&self) -> u32 {
        self.block.preset
    }

    /// The COS delta in force, 1 … T steps (DeviceNet manual §8, attr 11).
    #[must_use]
    pub const fn cos_delta(&self) -> u32 {
        self.block.cos_delta
    }

    /// The block in force: what Save keeps, together with a fresh
    /// [`reference`](Self::reference) where it [needs one](Block::needs_reference).
    #[must_use]
    pub const fn block(&self) -> Block {
        self.block
    }

    /// The block that Reset, and Restore on a device that never saved, load: the defaults, made
    /// for the turns the shaft is in now.
    #[must_use]
    pub const fn default_block(&self) -> Block {
        Block { crossings_at_change: self.crossings, ..Block::default_for(self.model) }
    }

    /// Puts `settings` in force, whole, or refuses them and changes nothing.
    ///
    /// `Ok(true)` is a real change: the offset and the preset become 0 (decision: by a change of
    /// direction too), k₀ becomes k, and the COS delta is lowered to T where it was above.
    /// `Ok(false)`: the settings were in force already, nothing changed. Before the first sample
    /// k₀ is provisional, and settled by that sample: a block to be saved is better taken after
    /// it.
    ///
    /// # Errors
    /// What [`Settings::check`] refuses.
    pub fn apply(&mut self, settings: Settings) -> Result<bool, Refusal> {
        settings.check(self.model)?;
        if settings == self.block.settings {
            return Ok(false);
        }
        self.block = Block {
            settings,
            preset: 0,
            offset: 0,
            crossings_at_change: self.crossings,
            cos_delta: self.block.cos_delta.min(settings.total_in_force(self.model)),
        };
        self.change_awaits_sample = !self.has_sample();
        self.take_over();
        Ok(true)
    }

    /// Writes the sense of rotation (DeviceNet manual §8, attr 3). Answers as
    /// [`apply`](Self::apply).
    ///
    /// # Errors
    /// None today; the type is that of the other writes.
    pub fn set_direction(&mut self, direction: Direction) -> Result<bool, Refusal> {
        self.apply(self.block.settings.with_direction(direction))
    }

    /// Writes the steps per turn, and the total resolution that follows from them (DeviceNet
    /// manual §8, attr 7). Answers as [`apply`](Self::apply).
    ///
    /// # Errors
    /// See [`Settings::with_steps_per_turn`].
    pub fn set_steps_per_turn(&mut self, steps_per_turn: u32) -> Result<bool, Refusal> {
        self.apply(self.block.settings.with_steps_per_turn(self.model, steps_per_turn)?)
    }

    /// Writes the total resolution (DeviceNet manual §8, attr 8). Answers as
    /// [`apply`](Self::apply).
    ///
    /// # Errors
    /// See [`Settings::with_total_resolution`].
    pub fn set_total_resolution(&mut self, total_resolution: u32) -> Result<bool, Refusal> {
        self.apply(self.block.settings.with_total_resolution(self.model, total_resolution)?)
    }

    /// Executes the preset function: the position of the newest sample becomes `preset` (DeviceNet
    /// manual §8, "Preset function"; PROFIBUS manual §7.4). Sample right before it.
    ///
    /// The offset becomes `preset − (u mod T)`. A moving shaft is no reason to refuse: the manuals
    /// advise standstill, they do not demand it.
    ///
    /// # Errors
    /// [`Refusal::Preset`] outside 0 … T−1; [`Refusal::NoSample`] before the first sample.
    pub fn set_preset(&mut self, preset: u32) -> Result<(), Refusal> {
        let max = self.block.settings.total_in_force(self.model) - 1;
        if preset > max {
            return Err(Refusal::Preset { max });
        }
        if !self.has_sample() {
            return Err(Refusal::NoSample);
        }
        // Decision: a singleturn disc keeps no turns without power. Where they matter, the preset
        // is made for the turn the shaft is in, which is the one power-up assumes.
        if !self.model.geometry.is_multiturn()
            && !self.block.settings.total_divides_range(self.model)
        {
            self.begin_range_here();
        }
        // Both lie in 0 … 2²⁹−1.
        let offset = i64::from(preset) - self.transform.modulo_total(self.unwrapped());
        self.block.preset = preset;
        self.block.offset = offset as i32;
        self.rebase();
        Ok(())
    }

    /// Writes the COS delta (DeviceNet manual §8, attr 11, a DINT). `Ok(false)` if it was in force
    /// already.
    ///
    /// # Errors
    /// [`Refusal::CosDelta`] outside 1 … T.
    pub fn set_cos_delta(&mut self, cos_delta: i32) -> Result<bool, Refusal> {
        let max = self.block.settings.total_in_force(self.model);
        match u32::try_from(cos_delta) {
            Ok(value) if (1..=max).contains(&value) => {
                let changed = value != self.block.cos_delta;
                self.block.cos_delta = value;
                Ok(changed)
            }
            _ => Err(Refusal::CosDelta { max }),
        }
    }

    /// Puts a whole block in force, offset and k₀ included: Restore with the saved block, Reset
    /// with [`default_block`](Self::default_block), PROFIBUS with the offset that belongs to the
    /// parameters. Executes no preset (decision).
    ///
    /// # Errors
    /// What [`Block::check`] refuses; then nothing changed.
    pub fn load(&mut self, block: Block) -> Result<(), Refusal> {
        block.check(self.model)?;
        self.block = block;
        self.change_awaits_sample = false;
        self.take_over();
        Ok(())
    }

    /// Sets the speed above which two samples are a position error, in revolutions per minute; at
    /// power-up [`DEFAULT_SPEED_LIMIT`]. 8 raw steps between two samples are always allowed.
    pub fn set_speed_limit(&mut self, rpm: u32) {
        self.position_error.set_limit(rpm, self.model.geometry.singleturn_resolution());
    }

    /// Where the shaft stands, to be kept for the next power-up; `None` before the first sample
    /// and on singleturn products.
    #[must_use]
    pub fn reference(&self) -> Option<Reference> {
        (self.has_sample() && self.model.geometry.is_multiturn())
            .then_some(Reference { crossings: self.crossings, code: self.code })
    }

    /// Whether the shaft has gone more than N/4 from `kept`, so that a fresh
    /// [`reference`](Self::reference) must be written where the saved block
    /// [needs one](Block::needs_reference).
    ///
    /// Ask after each sample: then a write falls due at most once per 16 384 turns, and up to a
    /// quarter of the range may be turned without power.
    #[must_use]
    pub fn reference_is_stale(&self, kept: &Reference) -> bool {
        if !self.has_sample() || !self.model.geometry.is_multiturn() {
            return false;
        }
        let range = self.model.geometry.range();
        let crossings = self.crossings.saturating_sub(kept.crossings);
        crossings
            .saturating_mul(i64::from(range))
            .saturating_add(i64::from(self.code) - i64::from(kept.code))
            .unsigned_abs()
            > u64::from(range / 4)
    }

    /// Counts a crossing of the raw zero between the code known so far and `code`.
    fn follow(&mut self, code: u32) {
        // All three below 2³⁰.
        let half = (self.model.geometry.range() / 2) as i32;
        let moved = code as i32 - self.code as i32;
        if moved < -half {
            self.cross(1);
        } else if moved > half {
            self.cross(-1);
        }
    }

    /// k changes, once in thousands of turns; apart, so that a sample without it stays short.
    #[cold]
    fn cross(&mut self, crossing: i64) {
        self.crossings = self.crossings.wrapping_add(crossing);
        self.rebase();
    }

    /// The raw steps between the code known so far and `code`, the shorter way round.
    fn shorter_way_to(&self, code: u32) -> u32 {
        let range = self.model.geometry.range();
        let forward = code.wrapping_sub(self.code) & (range - 1);
        forward.min(range - forward)
    }

    /// k₀ := k.
    fn begin_range_here(&mut self) {
        self.block.crossings_at_change = self.crossings;
        self.change_awaits_sample = false;
        self.velocity.clear();
        self.rebase();
    }

    /// Builds the transform of the block that came into force.
    fn take_over(&mut self) {
        let turned = self.crossings.wrapping_sub(self.block.crossings_at_change);
        self.transform =
            Transform::new(self.model, &self.block.settings, turned, self.block.offset);
        self.velocity.clear();
    }

    /// Tells the transform of a new k, k₀ or offset.
    fn rebase(&mut self) {
        let turned = self.crossings.wrapping_sub(self.block.crossings_at_change);
        self.transform.rebase(turned, self.block.offset);
    }
}

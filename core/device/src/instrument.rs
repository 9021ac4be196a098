//! What a device is on any bus: a sensor, the encoder behind it, and what happened to them.

use codewheel_encoder::ssi::LineFault;
use codewheel_encoder::{DEFAULT_SPEED_LIMIT, Encoder, Sensor};
use codewheel_station::{Deadline, Duration, Instant};

use crate::Product;
use crate::event::{Events, Happening};

/// How often a moving shaft is looked at between productions.
pub(crate) const SAMPLE_TIME: Duration = Duration::from_millis(1);

/// The measuring part of a device, whose events are `E`.
#[derive(Clone, Debug)]
pub(crate) struct Instrument<S, E> {
    pub(crate) product: &'static Product,
    pub(crate) sensor: S,
    pub(crate) encoder: Encoder,
    pub(crate) events: Events<E>,
    pub(crate) powered_at: Instant,
    /// When the shaft must be looked at; never while it rests.
    pub(crate) next_sample: Deadline,
    /// In turns a minute; above it two samples are a position error.
    speed_limit: u32,
    /// What was told last.
    told: Complaints,
}

/// What the encoder complains of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Complaints {
    alarm: bool,
    warning: bool,
    line_fault: Option<LineFault>,
}

impl Complaints {
    #[inline]
    const fn of(encoder: &Encoder) -> Self {
        Self {
            alarm: encoder.alarm(),
            warning: encoder.warning(),
            line_fault: encoder.line_fault(),
        }
    }
}

impl<S: Sensor, E: Copy + From<Happening>> Instrument<S, E> {
    pub(crate) fn new(
        now: Instant,
        product: &'static Product,
        sensor: S,
        encoder: Encoder,
        events: Events<E>,
    ) -> Self {
        Self {
            product,
            sensor,
            encoder,
            events,
            powered_at: now,
            next_sample: Deadline::NEVER,
            speed_limit: DEFAULT_SPEED_LIMIT,
            told: Complaints::default(),
        }
    }

    /// The power is there again, and with it `encoder`.
    pub(crate) fn restart(&mut self, now: Instant, encoder: Encoder) {
        self.encoder = encoder;
        self.encoder.set_speed_limit(self.speed_limit);
        self.powered_at = now;
        self.told = Complaints::default();
    }

    /// How fast the shaft can turn; it outlasts the power.
    pub(crate) fn set_speed_limit(&mut self, rpm: u32) {
        self.speed_limit = rpm;
        self.encoder.set_speed_limit(rpm);
    }

    /// The sensor, to be changed: it is looked at as soon as there is time.
    pub(crate) const fn sensor_mut(&mut self) -> &mut S {
        self.next_sample = Deadline::at(Instant::ZERO);
        &mut self.sensor
    }

    /// Looks at the shaft. Returns whether the encoder complains of something else than before.
    #[inline]
    pub(crate) fn sample(&mut self, now: Instant) -> bool {
        let sample = self.sensor.sample(now);
        self.encoder.sample(now, sample);
        let changes_at = self.sensor.changes_at(now);
        self.next_sample =
            changes_at.map_or(Deadline::NEVER, |at| Deadline::at(at.max(now + SAMPLE_TIME)));
        let complaints = Complaints::of(&self.encoder);
        let changed = complaints != self.told;
        if changed {
            self.tell(now, complaints);
        }
        changed
    }

    /// Lets an alarm end whose time is over.
    pub(crate) fn settle(&mut self, now: Instant) {
        if self.encoder.deadline().is_some_and(|at| now >= at) {
            self.encoder.advance(now);
            self.tell(now, Complaints::of(&self.encoder));
        }
    }

    /// Tells what the encoder complains of `now` and did not before, and the other way round.
    #[cold]
    fn tell(&mut self, now: Instant, after: Complaints) {
        let before = core::mem::replace(&mut self.told, after);
        if before.line_fault != after.line_fault {
            let fault = after.line_fault;
            self.events.push(now, fault.map_or(Happening::LineRight, Happening::LineFault));
        }
        match (before.alarm, after.alarm) {
            // A line fault says more than the alarm it raises.
            (false, true) if after.line_fault.is_none() => {
                self.events.push(now, Happening::PositionError);
            }
            (true, false) => self.events.push(now, Happening::PositionErrorEnded),
            _ => {}
        }
        match (before.warning, after.warning) {
            (false, true) => self.events.push(now, Happening::CellLow),
            (true, false) => self.events.push(now, Happening::CellRight),
            _ => {}
        }
    }

    /// When [`sample`](Self::sample) or [`settle`](Self::settle) is due.
    #[inline]
    pub(crate) fn deadline(&self) -> Deadline {
        Deadline::from(self.encoder.deadline()).min(self.next_sample)
    }

    /// When a turning shaft was looked at last; `now` for one that rests. Up to a millisecond of not
    /// looking is no standstill.
    pub(crate) fn looked_at(&self, now: Instant) -> Instant {
        match self.next_sample.instant() {
            Some(next) if next <= now + SAMPLE_TIME => next - SAMPLE_TIME,
            _ => now,
        }
    }
}

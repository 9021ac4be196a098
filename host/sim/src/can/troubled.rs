//! A station whose frames are dropped on the way out, or come late.

use std::collections::VecDeque;

use codewheel_station::can::{Frame, Input};
use codewheel_station::{Duration, Instant, Station, earlier};
use fastrand::Rng;

use super::{Node, faults};

/// Frames held back at once; beyond them the station is not asked for more.
const HELD: usize = 64;
/// Frames dropped in one call at most, so that a station that never falls silent holds nobody up.
const DROPPED_AT_ONCE: usize = 64;
/// When such a station is asked again.
const PAUSE: Duration = Duration::from_millis(1);

/// Which frames are dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drops {
    /// How likely each frame is dropped, 0 … 1.
    pub probability: f64,
    /// After so many dropped frames it is over; `None`: it goes on.
    pub count: Option<u32>,
}

/// A station between which and the medium something is broken: frames that it gives are dropped or
/// held back. Without trouble it is the station itself.
///
/// A dropped frame counts as sent to the station, which therefore waits for nothing. A late one
/// counts as sent when it really is, and carries what the station said when it gave it. What
/// happens is drawn from a seed. The order of frames stays.
#[derive(Clone, Debug)]
pub struct Troubled<S> {
    station: S,
    random: Rng,
    drops: Option<Drops>,
    delay: Duration,
    /// Frames on their way, with the moment from which they may leave.
    held: VecDeque<(Instant, Frame)>,
    /// The station had more to say than could be dropped in one call.
    ask_again: Option<Instant>,
    dropped: u64,
}

impl<S: Node> Troubled<S> {
    /// A station without trouble; what trouble there will be is drawn from `seed`.
    pub fn new(station: S, seed: u64) -> Self {
        Self {
            station,
            random: Rng::with_seed(seed),
            drops: None,
            delay: Duration::ZERO,
            held: VecDeque::new(),
            ask_again: None,
            dropped: 0,
        }
    }

    /// The station.
    pub const fn station(&self) -> &S {
        &self.station
    }

    /// The station, to be changed. As with any change, deadline and output are to be asked anew.
    pub const fn station_mut(&mut self) -> &mut S {
        &mut self.station
    }

    /// The station, out of its trouble. Frames held back are gone.
    pub fn into_station(self) -> S {
        self.station
    }

    /// Drops frames from now on, or no more.
    pub const fn set_drops(&mut self, drops: Option<Drops>) {
        self.drops = drops;
    }

    /// Which frames are dropped, with what is left of their count.
    pub const fn drops(&self) -> Option<Drops> {
        self.drops
    }

    /// Holds each frame back for `delay` from now on; zero ends it. Frames held back already keep
    /// their moment.
    pub const fn set_delay(&mut self, delay: Duration) {
        self.delay = delay;
    }

    /// How many frames were dropped so far.
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    fn drops_this_one(&mut self) -> bool {
        let Some(drops) = self.drops.as_mut().filter(|drops| drops.count != Some(0)) else {
            return false;
        };
        let drop = faults::happens(&mut self.random, drops.probability);
        if drop && let Some(count) = &mut drops.count {
            *count -= 1;
        }
        drop
    }

    /// The next frame that the station gives and that is not dropped.
    fn ask(&mut self, now: Instant) -> Option<Frame> {
        for _ in 0..DROPPED_AT_ONCE {
            let frame = self.station.transmit(now)?;
            if !self.drops_this_one() {
                return Some(frame);
            }
            self.dropped += 1;
            self.station.handle(now, Input::Sent(&frame));
        }
        self.ask_again = Some(now + PAUSE);
        None
    }
}

impl<S: Node> Station for Troubled<S> {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        if input == Input::BusOff {
            self.held.clear();
        }
        self.station.handle(now, input);
    }

    fn advance(&mut self, now: Instant) {
        self.station.advance(now);
    }

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        self.ask_again = None;
        if self.delay == Duration::ZERO && self.held.is_empty() {
            return self.ask(now);
        }
        while self.held.len() < HELD
            && let Some(frame) = self.ask(now)
        {
            self.held.push_back((now + self.delay, frame));
        }
        let &(from, frame) = self.held.front()?;
        (from <= now).then(|| {
            self.held.pop_front();
            frame
        })
    }

    fn deadline(&self) -> Option<Instant> {
        let held = self.held.front().map(|&(from, _)| from);
        earlier(earlier(self.station.deadline(), held), self.ask_again)
    }
}

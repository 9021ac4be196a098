//! A station whose outputs are dropped on the way out, or come late.

use std::collections::VecDeque;

use codewheel_station::rs485::{self, BaudRate, Transmission};
use codewheel_station::{Duration, Instant, Station, can, earlier};
use fastrand::Rng;

use crate::chance::happens;

/// Outputs held back at once; beyond them the station is not asked for more.
const HELD: usize = 64;
/// Outputs dropped in one call at most, so that a station that never falls silent holds nobody up.
const DROPPED_AT_ONCE: usize = 64;
/// When such a station is asked again.
const PAUSE: Duration = Duration::from_millis(1);

/// Which outputs are dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drops {
    /// How likely each output is dropped, 0 … 1.
    pub probability: f64,
    /// After so many dropped outputs it is over; `None`: it goes on.
    pub count: Option<u32>,
}

/// What a station `S` hands to its medium, and what the medium tells it about that.
pub trait Carried<S: Station>: Copy {
    /// Tells the station that this has been sent, where its medium tells that.
    fn count_as_sent(&self, station: &mut S, now: Instant);

    /// Whether with this input everything that has not been sent yet is gone.
    fn is_cut_off(input: &S::Input<'_>) -> bool;
}

impl<S> Carried<S> for can::Frame
where
    S: for<'a> Station<Input<'a> = can::Input<'a>>,
{
    fn count_as_sent(&self, station: &mut S, now: Instant) {
        station.handle(now, can::Input::Sent(self));
    }

    fn is_cut_off(input: &can::Input<'_>) -> bool {
        matches!(input, can::Input::BusOff | can::Input::Detached)
    }
}

/// Nobody is told what has gone over an RS-485 line, and nothing takes a station off it.
impl<S> Carried<S> for Transmission
where
    S: for<'a> Station<Input<'a> = rs485::Input<'a>>,
{
    fn count_as_sent(&self, _station: &mut S, _now: Instant) {}

    fn is_cut_off(_input: &rs485::Input<'_>) -> bool {
        false
    }
}

/// A station between which and the medium something is broken: frames or telegrams that it gives
/// are dropped or held back. Without trouble it is the station itself.
///
/// What is dropped counts as sent to the station, which therefore waits for nothing. What is late
/// counts as sent when it really is, and carries what the station said when it gave it. What
/// happens is drawn from a seed. The order stays.
#[derive(Clone, Debug)]
pub struct Troubled<S: Station> {
    station: S,
    random: Rng,
    drops: Option<Drops>,
    delay: Duration,
    /// Outputs on their way, with the moment from which they may leave.
    held: VecDeque<(Instant, S::Output)>,
    /// The station had more to say than could be dropped in one call.
    ask_again: Option<Instant>,
    dropped: u64,
}

impl<S: Station> Troubled<S> {
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

    /// The station, out of its trouble. Outputs held back are gone.
    pub fn into_station(self) -> S {
        self.station
    }

    /// Drops outputs from now on, or no more.
    pub const fn set_drops(&mut self, drops: Option<Drops>) {
        self.drops = drops;
    }

    /// Which outputs are dropped, with what is left of their count.
    pub const fn drops(&self) -> Option<Drops> {
        self.drops
    }

    /// Holds each output back for `delay` from now on; zero ends it. What is held back already keeps
    /// its moment.
    pub const fn set_delay(&mut self, delay: Duration) {
        self.delay = delay;
    }

    /// How many outputs were dropped so far.
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    fn drops_this_one(&mut self) -> bool {
        let Some(drops) = self.drops.as_mut().filter(|drops| drops.count != Some(0)) else {
            return false;
        };
        let drop = happens(&mut self.random, drops.probability);
        if drop && let Some(count) = &mut drops.count {
            *count -= 1;
        }
        drop
    }
}

impl<S: Station> Troubled<S>
where
    S::Output: Carried<S>,
{
    /// The next output that the station gives and that is not dropped.
    fn ask(&mut self, now: Instant) -> Option<S::Output> {
        for _ in 0..DROPPED_AT_ONCE {
            let output = self.station.transmit(now)?;
            if !self.drops_this_one() {
                return Some(output);
            }
            self.dropped += 1;
            output.count_as_sent(&mut self.station, now);
        }
        self.ask_again = Some(now + PAUSE);
        None
    }
}

impl<S: Station> Station for Troubled<S>
where
    S::Output: Carried<S>,
{
    type Input<'a> = S::Input<'a>;
    type Output = S::Output;

    fn handle(&mut self, now: Instant, input: Self::Input<'_>) {
        if S::Output::is_cut_off(&input) {
            self.held.clear();
        }
        self.station.handle(now, input);
    }

    fn advance(&mut self, now: Instant) {
        self.station.advance(now);
    }

    fn transmit(&mut self, now: Instant) -> Option<S::Output> {
        self.ask_again = None;
        if self.delay == Duration::ZERO && self.held.is_empty() {
            return self.ask(now);
        }
        while self.held.len() < HELD
            && let Some(output) = self.ask(now)
        {
            self.held.push_back((now + self.delay, output));
        }
        let &(from, output) = self.held.front()?;
        (from <= now).then(|| {
            self.held.pop_front();
            output
        })
    }

    fn deadline(&self) -> Option<Instant> {
        let held = self.held.front().map(|&(from, _)| from);
        earlier(earlier(self.station.deadline(), held), self.ask_again)
    }
}

impl<S: rs485::Node> rs485::Node for Troubled<S> {
    fn baud_rate(&self) -> BaudRate {
        self.station.baud_rate()
    }
}

//! The one loop that drives a station on a real port.

use std::collections::VecDeque;

use codewheel_station::{Duration, Instant, Station, can, can::Frame, earlier};

use crate::{CanPort, LinkError, Notice, Received, Tap};

/// How long after its hand-over a frame counts as sent on a port that does not report it: 100 ms,
/// so that nothing that waits for its own frame hangs.
pub const STAND_IN: Duration = Duration::from_millis(100);

/// How long after the stand-in a report of the port is still taken for the same frame.
const LATE: Duration = Duration::from_secs(1);

/// How often a station is looked after that stays overdue, because the port takes no frame: its
/// deadline then cannot be waited for.
const OVERDUE_PAUSE: Duration = Duration::from_millis(10);

/// Inputs taken in one turn at most, so that a flooded station still sees its caller.
const INPUTS: usize = 256;

/// Frames remembered until they are reported as sent.
const HANDED_OVER: usize = 64;

/// The operating system's monotonic clock as a station's time: nanoseconds since it was made.
///
/// Copies share the origin. Stations that exchange instants need copies of one clock.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    origin: std::time::Instant,
}

impl Clock {
    /// A clock that starts at zero now.
    #[must_use]
    pub fn new() -> Self {
        Self { origin: std::time::Instant::now() }
    }

    /// The time now.
    #[must_use]
    pub fn now(&self) -> Instant {
        Instant::ZERO + Duration::from(self.origin.elapsed())
    }
}

impl Default for Clock {
    fn default() -> Self {
        Self::new()
    }
}

/// What came of one turn, besides frames.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Outcome {
    /// What people may want to hear, in order.
    pub notices: Vec<Notice>,
    /// Whether the port's [`Waker`](crate::Waker) was used.
    pub woken: bool,
}

/// Drives one station on one port, turn by turn; keeps the promises that
/// [`Station`] asks of its driver.
///
/// Make one per station and port, and call [`turn`](Self::turn) for ever.
#[derive(Debug)]
pub struct Loop {
    clock: Clock,
    /// A frame that the station gave and the port, having said it was ready, did not take.
    left_over: Option<Frame>,
    /// Frames on their way, oldest first.
    handed_over: VecDeque<HandedOver>,
    tap: Option<Box<dyn Tap>>,
}

#[derive(Clone, Copy, Debug)]
struct HandedOver {
    frame: Frame,
    due: Instant,
    /// Reported as sent by time-out. Remembered, so that a report of the port that comes late is
    /// not a second one.
    stood_in: bool,
    /// The tap has seen it, since at its hand-over the port was one that reports nothing.
    tapped: bool,
}

impl Loop {
    /// A loop in the time of `clock`.
    #[must_use]
    pub const fn new(clock: Clock) -> Self {
        Self { clock, left_over: None, handed_over: VecDeque::new(), tap: None }
    }

    /// The clock that the station is driven by.
    #[must_use]
    pub const fn clock(&self) -> Clock {
        self.clock
    }

    /// Lets `tap` see each frame from now on; `None`: nobody.
    pub fn set_tap(&mut self, tap: Option<Box<dyn Tap>>) {
        self.tap = tap;
    }

    /// One turn: lets the station do what fell due, hands over what it gives while the port takes
    /// it, waits once — for input, a wake-up, the station's deadline or `until`, whichever is first
    /// — and takes in whatever has arrived.
    ///
    /// With no deadline and no input it waits for ever and costs nothing. A wait never ends early,
    /// and at most one tick of the system late: 1 ms on Linux and macOS, up to 16 ms on Windows. An `until` that has passed means: do not wait.
    ///
    /// # Errors
    /// [`LinkError`] when the port is lost for good.
    pub fn turn<S>(
        &mut self,
        station: &mut S,
        port: &mut dyn CanPort,
        until: Option<Instant>,
    ) -> Result<Outcome, LinkError>
    where
        S: for<'a> Station<Input<'a> = can::Input<'a>, Output = Frame>,
    {
        let mut outcome = Outcome::default();
        let served = self.serve(station, port)?;
        let mut deadline = station.deadline();
        if deadline.is_some_and(|deadline| deadline <= served) {
            deadline = Some(served + OVERDUE_PAUSE);
        }
        let deadline = earlier(earlier(deadline, until), self.next_stand_in(port));
        let wait = deadline.map(|deadline| deadline.since(self.clock.now()).into());
        let mut input = port.receive(wait)?;
        let mut left = INPUTS;
        while let Some(received) = input {
            self.take(station, received, &mut outcome);
            // Answering each input before the next keeps two requests two answers.
            self.hand_over(station, port)?;
            left -= 1;
            // A port that is lost now says so again in the next turn; what came before counts.
            input = match left {
                0 => None,
                _ => port.receive(Some(std::time::Duration::ZERO)).unwrap_or_default(),
            };
        }
        self.serve(station, port)?;
        Ok(outcome)
    }

    /// Runs what fell due and hands over what is owed; gives the time it was done at.
    fn serve<S>(&mut self, station: &mut S, port: &mut dyn CanPort) -> Result<Instant, LinkError>
    where
        S: for<'a> Station<Input<'a> = can::Input<'a>, Output = Frame>,
    {
        let now = self.clock.now();
        station.advance(now);
        self.handed_over.retain(|entry| !entry.stood_in || now < entry.due + LATE);
        if !port.confirms() {
            for entry in &mut self.handed_over {
                if !entry.stood_in && entry.due <= now {
                    entry.stood_in = true;
                    station.handle(now, can::Input::Sent(&entry.frame));
                }
            }
        }
        self.hand_over(station, port)?;
        Ok(now)
    }

    fn hand_over<S>(&mut self, station: &mut S, port: &mut dyn CanPort) -> Result<(), LinkError>
    where
        S: for<'a> Station<Input<'a> = can::Input<'a>, Output = Frame>,
    {
        while port.is_ready() {
            let now = self.clock.now();
            let Some(frame) = self.left_over.take().or_else(|| station.transmit(now)) else {
                break;
            };
            if !port.send(&frame)? {
                self.left_over = Some(frame);
                break;
            }
            if self.handed_over.len() >= HANDED_OVER
                && let Some(oldest) = self.handed_over.pop_front()
                && !oldest.stood_in
                && !port.confirms()
            {
                station.handle(now, can::Input::Sent(&oldest.frame));
            }
            let tapped = !port.confirms();
            if tapped && let Some(tap) = &mut self.tap {
                tap.sent(now, &frame);
            }
            let due = now + STAND_IN;
            self.handed_over.push_back(HandedOver { frame, due, stood_in: false, tapped });
        }
        Ok(())
    }

    fn take<S>(&mut self, station: &mut S, received: Received, outcome: &mut Outcome)
    where
        S: for<'a> Station<Input<'a> = can::Input<'a>, Output = Frame>,
    {
        let now = self.clock.now();
        match received {
            Received::Frame(frame) => {
                station.handle(now, can::Input::Frame(&frame));
                if let Some(tap) = &mut self.tap {
                    tap.received(now, &frame);
                }
            }
            Received::Sent(frame) => {
                let place = self.handed_over.iter().position(|entry| entry.frame == frame);
                let entry = place.and_then(|place| self.handed_over.remove(place));
                if !entry.is_some_and(|entry| entry.stood_in) {
                    station.handle(now, can::Input::Sent(&frame));
                }
                if !entry.is_some_and(|entry| entry.tapped)
                    && let Some(tap) = &mut self.tap
                {
                    tap.sent(now, &frame);
                }
            }
            Received::BusOff => {
                self.handed_over.clear();
                self.left_over = None;
                station.handle(now, can::Input::BusOff);
            }
            Received::Recovered => station.handle(now, can::Input::Recovered),
            Received::Detached => {
                self.handed_over.clear();
                self.left_over = None;
                station.handle(now, can::Input::Detached);
            }
            Received::Attached => station.handle(now, can::Input::Attached),
            Received::Notice(notice) => outcome.notices.push(notice),
            Received::Woken => outcome.woken = true,
        }
    }

    /// When the next frame counts as sent without a report.
    fn next_stand_in(&self, port: &dyn CanPort) -> Option<Instant> {
        if port.confirms() {
            return None;
        }
        self.handed_over.iter().filter(|entry| !entry.stood_in).map(|entry| entry.due).min()
    }
}

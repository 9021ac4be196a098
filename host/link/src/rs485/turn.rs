//! The loop that drives a station on an RS-485 line.

use codewheel_station::rs485::{BaudRate, Input, Node};
use codewheel_station::{Duration, Instant, earlier};

use super::port::{Rs485Port, Rs485Received};
use crate::{Clock, LinkError, Outcome, Rs485Tap};

/// How often a station is looked after that stays overdue: its deadline cannot be waited for.
const OVERDUE_PAUSE: Duration = Duration::from_millis(10);

/// Inputs taken in one turn at most, so that a flooded station still sees its caller.
const INPUTS: usize = 256;

/// How long after the last octet a deadline may be that of an answer: T_SDR is at most 255 bits,
/// which last 26.6 ms at 9.6 kbit/s. Only such a deadline is worth watching the clock for.
const ANSWER: Duration = Duration::from_millis(30);

/// How long before the deadline of an answer the clock is watched: the system may end a wait that
/// much late.
const WATCH: Duration = Duration::from_micros(100);

/// A deadline nearer than this is waited for in place; looking at the port takes as long.
const INSTANTLY: Duration = Duration::from_micros(5);

const NOT_AT_ALL: Option<std::time::Duration> = Some(std::time::Duration::ZERO);

/// Drives one station on one RS-485 port, turn by turn; keeps the promises that
/// [`Station`](codewheel_station::Station) asks of its driver.
///
/// The line can take a telegram when nothing more is to be read from it: what has arrived is handed
/// in before the station is asked to speak, so that octets which came first can still take the word
/// from it.
///
/// Make one per station and port, and call [`turn`](Self::turn) for ever.
#[derive(Debug)]
pub struct Rs485Loop {
    clock: Clock,
    /// The rate that the port was told last.
    rate: Option<BaudRate>,
    last_input: Option<Instant>,
    /// A deadline that stayed although everything was done that it can ask for.
    stuck: Option<Instant>,
    tap: Option<Box<dyn Rs485Tap>>,
}

impl Rs485Loop {
    /// A loop in the time of `clock`.
    #[must_use]
    pub const fn new(clock: Clock) -> Self {
        Self { clock, rate: None, last_input: None, stuck: None, tap: None }
    }

    /// The clock that the station is driven by.
    #[must_use]
    pub const fn clock(&self) -> Clock {
        self.clock
    }

    /// Lets `tap` see all octets from now on; `None`: nobody.
    pub fn set_tap(&mut self, tap: Option<Box<dyn Rs485Tap>>) {
        self.tap = tap;
    }

    /// One turn: lets the station do what fell due, waits once — for octets, a wake-up, the
    /// station's deadline or `until`, whichever is first — takes in whatever has arrived, and sends
    /// what the station gives once the line is quiet.
    ///
    /// With no deadline and no input it waits for ever and costs nothing. A deadline is met some
    /// 0.1 ms late at most on Unix, elsewhere a tick of the system; that of an answer, at most 30 ms
    /// after the last octet, within microseconds, for at most 0.1 ms of watching the clock. An
    /// `until` that has passed means: do not wait.
    ///
    /// # Errors
    /// [`LinkError`] when the port is lost for good.
    pub fn turn<N: Node>(
        &mut self,
        station: &mut N,
        port: &mut dyn Rs485Port,
        until: Option<Instant>,
    ) -> Result<Outcome, LinkError> {
        let mut outcome = Outcome::default();
        let now = self.advance(station, port)?;
        let deadline = match station.deadline() {
            stuck if stuck.is_some() && stuck == self.stuck => Some(now + OVERDUE_PAUSE),
            deadline => deadline,
        };
        let mut input = self.wait(port, deadline, until)?;
        let mut left = INPUTS;
        let mut is_quiet = true;
        while let Some(received) = input {
            self.take(station, port, received, &mut outcome)?;
            // However much there is to take in, deadlines are kept.
            if station.deadline().is_some_and(|deadline| deadline <= self.clock.now()) {
                self.advance(station, port)?;
            }
            left -= 1;
            if left == 0 {
                is_quiet = false;
                break;
            }
            self.stay(station.deadline());
            // A port that is lost now says so again in the next turn; what came before counts.
            input = port.receive(NOT_AT_ALL).unwrap_or_default();
        }
        let now = self.advance(station, port)?;
        if is_quiet {
            loop {
                let now = self.clock.now();
                let Some(transmission) = station.transmit(now) else { break };
                port.send(&transmission)?;
                if let Some(tap) = &mut self.tap {
                    tap.sent(now, transmission.octets());
                }
            }
            self.stuck = station.deadline().filter(|deadline| *deadline <= now);
        }
        Ok(outcome)
    }

    /// Runs what fell due; gives the time it was done at.
    fn advance<N: Node>(
        &mut self,
        station: &mut N,
        port: &mut dyn Rs485Port,
    ) -> Result<Instant, LinkError> {
        let now = self.clock.now();
        station.advance(now);
        self.follow_rate(station, port)?;
        Ok(now)
    }

    fn follow_rate<N: Node>(
        &mut self,
        station: &N,
        port: &mut dyn Rs485Port,
    ) -> Result<(), LinkError> {
        let rate = station.baud_rate();
        if self.rate.replace(rate) != Some(rate) {
            port.set_baud_rate(rate)?;
        }
        Ok(())
    }

    /// Waits for input until `deadline` or `until`. That nothing came is seen after the deadline,
    /// not before it.
    fn wait(
        &self,
        port: &mut dyn Rs485Port,
        deadline: Option<Instant>,
        until: Option<Instant>,
    ) -> Result<Option<Rs485Received>, LinkError> {
        let Some(end) = earlier(deadline, until) else { return port.receive(None) };
        let is_answer =
            deadline == Some(end) && self.last_input.is_some_and(|input| end <= input + ANSWER);
        let now = self.clock.now();
        if !is_answer {
            return port.receive(Some(end.since(now).into()));
        }
        let rest = (end - WATCH).since(now);
        let mut input = port.receive(Some(rest.into()))?;
        while input.is_none() && self.clock.now() < end {
            input = port.receive(NOT_AT_ALL)?;
        }
        match input {
            Some(input) => Ok(Some(input)),
            None => port.receive(NOT_AT_ALL),
        }
    }

    /// Waits in place for a deadline that is nearer than a look at the port takes.
    fn stay(&self, deadline: Option<Instant>) {
        let Some(deadline) = deadline else { return };
        if deadline.since(self.clock.now()) < INSTANTLY {
            while self.clock.now() < deadline {
                std::hint::spin_loop();
            }
        }
    }

    fn take<N: Node>(
        &mut self,
        station: &mut N,
        port: &mut dyn Rs485Port,
        received: Rs485Received,
        outcome: &mut Outcome,
    ) -> Result<(), LinkError> {
        let now = self.clock.now();
        match received {
            Rs485Received::Octets(octets) => {
                station.handle(now, Input::Octets(&octets));
                if let Some(tap) = &mut self.tap {
                    tap.received(now, &octets);
                }
            }
            Rs485Received::BrokenCharacter => {
                station.handle(now, Input::BrokenCharacter);
                if let Some(tap) = &mut self.tap {
                    tap.broken_character(now);
                }
            }
            Rs485Received::Notice(notice) => {
                outcome.notices.push(notice);
                return Ok(());
            }
            Rs485Received::Woken => {
                outcome.woken = true;
                return Ok(());
            }
        }
        self.last_input = Some(now);
        self.follow_rate(station, port)
    }
}

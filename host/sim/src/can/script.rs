//! A station played by hand.

use std::collections::VecDeque;

use codewheel_station::can::{Frame, Input};
use codewheel_station::{Instant, Station};

/// A station that sends what a test tells it to, when it tells it to, and writes down what it
/// hears. Without anything to send it is a listener.
///
/// What it hears is chosen by the filters it is attached with.
#[derive(Clone, Debug, Default)]
pub struct Script {
    /// Earliest first; frames of one moment in the order they were given.
    to_send: VecDeque<(Instant, Frame)>,
    received: Vec<(Instant, Frame)>,
    sent: Vec<(Instant, Frame)>,
}

impl Script {
    /// A station that only listens.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Sends `frame` as soon as the wire allows from `at` on. A moment that has passed means at
    /// once; frames for the same moment go out in the order they were given.
    pub fn send(&mut self, at: Instant, frame: Frame) {
        let place = self.to_send.partition_point(|&(earlier, _)| earlier <= at);
        self.to_send.insert(place, (at, frame));
    }

    /// As [`send`](Self::send), to write a script in one go.
    #[must_use]
    pub fn sending(mut self, at: Instant, frame: Frame) -> Self {
        self.send(at, frame);
        self
    }

    /// What arrived, and when, since the last [`take_received`](Self::take_received).
    #[must_use]
    pub fn received(&self) -> &[(Instant, Frame)] {
        &self.received
    }

    /// What arrived, and when, since the last call, forgotten here.
    pub fn take_received(&mut self) -> Vec<(Instant, Frame)> {
        std::mem::take(&mut self.received)
    }

    /// What went out and was acknowledged, and when.
    #[must_use]
    pub fn sent(&self) -> &[(Instant, Frame)] {
        &self.sent
    }
}

impl Station for Script {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        match input {
            Input::Frame(frame) => self.received.push((now, *frame)),
            Input::Sent(frame) => self.sent.push((now, *frame)),
            Input::BusOff | Input::Recovered | Input::Detached | Input::Attached => {}
        }
    }

    fn advance(&mut self, _now: Instant) {}

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        let &(at, frame) = self.to_send.front()?;
        (at <= now).then(|| {
            self.to_send.pop_front();
            frame
        })
    }

    fn deadline(&self) -> Option<Instant> {
        self.to_send.front().map(|&(at, _)| at)
    }
}

//! A station played by hand.

use std::collections::VecDeque;

use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Instant, Station};

/// What a [`Script`] has heard at one moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Heard {
    /// Octets that came without a pause between them.
    Octets(Vec<u8>),
    /// A broken character.
    Broken,
}

/// A station that says what a test tells it to, when it tells it to, and writes down what it
/// hears. Without anything to say it is a listener.
///
/// It looks neither at the line nor at the rules before it speaks.
#[derive(Clone, Debug)]
pub struct Script {
    rate: BaudRate,
    /// Earliest first; telegrams of one moment in the order they were given.
    to_send: VecDeque<(Instant, Transmission)>,
    heard: Vec<(Instant, Heard)>,
}

impl Script {
    /// A station that only listens.
    #[must_use]
    pub const fn new(rate: BaudRate) -> Self {
        Self { rate, to_send: VecDeque::new(), heard: Vec::new() }
    }

    /// Says `telegram` at `at`, or where it is still speaking then, as soon as it has finished. A
    /// moment that has passed means at once; telegrams for the same moment go out one behind the
    /// other in the order they were given.
    pub fn send(&mut self, at: Instant, telegram: Transmission) {
        let place = self.to_send.partition_point(|&(earlier, _)| earlier <= at);
        self.to_send.insert(place, (at, telegram));
    }

    /// As [`send`](Self::send), to write a script in one go.
    #[must_use]
    pub fn sending(mut self, at: Instant, telegram: Transmission) -> Self {
        self.send(at, telegram);
        self
    }

    /// Listens and speaks at another rate from now on. What it is just saying keeps its rate.
    pub const fn set_baud_rate(&mut self, rate: BaudRate) {
        self.rate = rate;
    }

    /// What it heard, and when, since the last [`take_heard`](Self::take_heard).
    #[must_use]
    pub fn heard(&self) -> &[(Instant, Heard)] {
        &self.heard
    }

    /// What it heard, and when, since the last call, forgotten here.
    pub fn take_heard(&mut self) -> Vec<(Instant, Heard)> {
        std::mem::take(&mut self.heard)
    }

    /// The octets it heard since the last [`take_heard`](Self::take_heard), one behind the other.
    #[must_use]
    pub fn octets(&self) -> Vec<u8> {
        let octets = self.heard.iter().filter_map(|(_, heard)| match heard {
            Heard::Octets(octets) => Some(octets.as_slice()),
            Heard::Broken => None,
        });
        octets.flatten().copied().collect()
    }
}

impl Station for Script {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        let heard = match input {
            Input::Octets(octets) => Heard::Octets(octets.to_vec()),
            Input::BrokenCharacter => Heard::Broken,
        };
        self.heard.push((now, heard));
    }

    fn advance(&mut self, _now: Instant) {}

    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        let &(at, telegram) = self.to_send.front()?;
        (at <= now).then(|| {
            self.to_send.pop_front();
            telegram
        })
    }

    fn deadline(&self) -> Option<Instant> {
        self.to_send.front().map(|&(at, _)| at)
    }
}

impl Node for Script {
    fn baud_rate(&self) -> BaudRate {
        self.rate
    }
}

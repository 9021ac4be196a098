//! Two kinds of stations on one wire.

use codewheel_station::rs485::{BaudRate, Node};
use codewheel_station::{Instant, Station};

/// A station of one of two kinds for the same medium, so that a device and a hand-played
/// [`Script`](crate::can::Script) can share a wire. More kinds nest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Either<L, R> {
    /// The first kind.
    Left(L),
    /// The second kind.
    Right(R),
}

impl<L, R> Either<L, R> {
    /// The station, where it is of the first kind.
    pub const fn left(&self) -> Option<&L> {
        match self {
            Self::Left(station) => Some(station),
            Self::Right(_) => None,
        }
    }

    /// The station, where it is of the first kind, to be changed.
    pub const fn left_mut(&mut self) -> Option<&mut L> {
        match self {
            Self::Left(station) => Some(station),
            Self::Right(_) => None,
        }
    }

    /// The station, where it is of the second kind.
    pub const fn right(&self) -> Option<&R> {
        match self {
            Self::Left(_) => None,
            Self::Right(station) => Some(station),
        }
    }

    /// The station, where it is of the second kind, to be changed.
    pub const fn right_mut(&mut self) -> Option<&mut R> {
        match self {
            Self::Left(_) => None,
            Self::Right(station) => Some(station),
        }
    }
}

impl<L, R> Station for Either<L, R>
where
    L: Station,
    R: for<'a> Station<Input<'a> = L::Input<'a>, Output = L::Output>,
{
    type Input<'a> = L::Input<'a>;
    type Output = L::Output;

    fn handle(&mut self, now: Instant, input: Self::Input<'_>) {
        match self {
            Self::Left(station) => station.handle(now, input),
            Self::Right(station) => station.handle(now, input),
        }
    }

    fn advance(&mut self, now: Instant) {
        match self {
            Self::Left(station) => station.advance(now),
            Self::Right(station) => station.advance(now),
        }
    }

    fn transmit(&mut self, now: Instant) -> Option<Self::Output> {
        match self {
            Self::Left(station) => station.transmit(now),
            Self::Right(station) => station.transmit(now),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        match self {
            Self::Left(station) => station.deadline(),
            Self::Right(station) => station.deadline(),
        }
    }
}

impl<L: Node, R: Node> Node for Either<L, R> {
    fn baud_rate(&self) -> BaudRate {
        match self {
            Self::Left(station) => station.baud_rate(),
            Self::Right(station) => station.baud_rate(),
        }
    }
}

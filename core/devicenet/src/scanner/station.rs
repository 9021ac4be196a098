//! The scanner as a [`Station`]: where frames go, and what is sent first.

use codewheel_station::can::{self, Frame};
use codewheel_station::{Deadline, Instant, Station};

use super::Scanner;
use super::cycle::Turn;
use super::exchange::Port;
use super::io::Heard;
use crate::duplicate::Change;
use crate::explicit::Header;
use crate::identifier::{
    CHANGE_ACKNOWLEDGE, CHANGE_OF_STATE_MESSAGE, DUPLICATE_MAC_CHECK, EXPLICIT_REQUEST,
    EXPLICIT_RESPONSE, Identifier, POLL_COMMAND, POLL_RESPONSE, UNCONNECTED_REQUEST, group_2,
};
use crate::{CheckMessage, DuplicateMacCheck, Fault, MacId};

impl<const SLAVES: usize> Scanner<SLAVES> {
    fn frame(&mut self, now: Instant, frame: &Frame) {
        let can::Identifier::Standard(bits) = frame.identifier() else { return };
        if frame.is_remote() {
            return;
        }
        let data = frame.data();
        let identifier = Identifier::from_bits(bits);
        self.live.heard(identifier, data);
        match identifier {
            Identifier::Group2 { mac, message: DUPLICATE_MAC_CHECK } => {
                self.check_message(now, mac, data);
            }
            _ if !self.network.is_on_line() => {}
            Identifier::Group1 { message: POLL_RESPONSE, source } => {
                self.poll_response(now, source, data);
            }
            Identifier::Group1 { message: CHANGE_OF_STATE_MESSAGE, source } => {
                self.change(source, |slave| slave.produced(now, data));
            }
            Identifier::Group2 { mac, message: EXPLICIT_RESPONSE } => {
                if let [first, rest @ ..] = data {
                    self.change(mac, |slave| slave.heard(now, Header(*first), rest));
                }
            }
            _ => {}
        }
    }

    fn check_message(&mut self, now: Instant, mac: MacId, data: &[u8]) {
        if mac == self.mac {
            if self.network.heard(data) == Some(Change::Duplicate) {
                self.leave_all();
            }
        } else if CheckMessage::parse(data).is_ok_and(|check| !check.response) {
            self.change(mac, |slave| slave.booted(now));
        }
    }

    fn poll_response(&mut self, now: Instant, source: MacId, data: &[u8]) {
        let Some(place) = self.place(source) else { return };
        let Some(slave) = self.slaves.get_mut(place).and_then(Option::as_mut) else { return };
        if slave.response(now, data) == Heard::Part {
            return self.cycle.part_of_answer(now, place);
        }
        // Everything else of the slave is as it was noted.
        let lost_at = slave.poll_lost_at();
        if let Some(noted) = self.due.get_mut(place) {
            *noted = lost_at.min(*noted);
        }
        self.slaves_due = self.slaves_due.min(lost_at);
        self.cycle.answered(now, place);
    }

    fn sent(&mut self, now: Instant, frame: &Frame) {
        let can::Identifier::Standard(bits) = frame.identifier() else { return };
        self.network.sent(now, bits);
        let Identifier::Group2 { mac, message } = Identifier::from_bits(bits) else { return };
        let Some(place) = self.place(mac) else { return };
        let port = match message {
            POLL_COMMAND => return self.cycle.sent(now, place),
            EXPLICIT_REQUEST => Port::Connected,
            UNCONNECTED_REQUEST => Port::Unconnected,
            _ => return,
        };
        self.change(mac, |slave| slave.sent(now, port, frame.data()));
    }

    fn acknowledge(&mut self) -> Option<Frame> {
        let place = first(self.acknowledging)?;
        self.acknowledging &= self.acknowledging - 1;
        let slave = self.slaves.get_mut(place)?.as_mut()?;
        slave.acknowledge = false;
        Some(Frame::standard(group_2(slave.settings.mac, CHANGE_ACKNOWLEDGE), &[]))
    }

    fn explicit_message(&mut self, now: Instant) -> Option<Frame> {
        while let Some(place) = first(self.owing) {
            let slave = self.slaves.get_mut(place).and_then(Option::as_mut);
            let frame = slave.and_then(|slave| slave.transmit(now));
            self.note(place);
            if frame.is_some() {
                return frame;
            }
        }
        None
    }

    fn probe(&mut self, now: Instant) -> Option<Frame> {
        if !self.live.is_probing() {
            return None;
        }
        let listed = self.places.iter().rev();
        let listed = listed.fold(0, |bits, place| bits << 1 | u64::from(*place != 0));
        self.live.transmit(now, listed, self.identity.vendor, self.identity.serial)
    }

    fn poll(&mut self, now: Instant) -> Option<Frame> {
        if let Some(frame) = self.long_poll.next() {
            return Some(frame);
        }
        while let Some(Turn { place, missed }) = self.cycle.next(now) {
            let slave = self.slaves.get_mut(place).and_then(Option::as_mut)?;
            let mac = slave.settings.mac;
            if let Some(output) = slave.poll(missed) {
                self.cycle.polled(now, place);
                return Some(self.long_poll.begin(mac, output));
            }
            // Lost by that: allocate it anew.
            self.note(place);
            if let Some(frame) = self.explicit_message(now) {
                return Some(frame);
            }
        }
        None
    }

    /// What falls due next.
    fn due(&self) -> Deadline {
        if self.network.is_on_line() {
            let own = self.network.deadline().min(self.live.deadline());
            own.min(self.cycle.deadline()).min(self.slaves_due)
        } else {
            self.network.deadline()
        }
    }
}

/// The lowest place of those that are bits.
const fn first(bits: u64) -> Option<usize> {
    if bits == 0 { None } else { Some(bits.trailing_zeros() as usize) }
}

impl<const SLAVES: usize> Station for Scanner<SLAVES> {
    type Input<'a> = can::Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: can::Input<'_>) {
        self.advance(now);
        match input {
            can::Input::Frame(frame) => self.frame(now, frame),
            can::Input::Sent(frame) => self.sent(now, frame),
            can::Input::BusOff => {
                // A duplicate MAC ID stays one.
                if self.network.faulted().is_none() {
                    self.network.fault(Fault::BusOff);
                    self.leave_all();
                }
            }
            can::Input::Recovered => {
                if self.network.faulted() == Some(Fault::BusOff) {
                    self.network = DuplicateMacCheck::begin(self.mac);
                }
            }
            can::Input::Detached => {
                let was_silent = self.network.faulted().is_some();
                self.network.fault(Fault::Detached);
                if !was_silent {
                    self.leave_all();
                }
            }
            can::Input::Attached => {
                if self.network.faulted() == Some(Fault::Detached) {
                    self.network = DuplicateMacCheck::begin(self.mac);
                }
            }
        }
        if self.network.is_on_line() {
            self.cycle.advance(now);
        }
    }

    fn advance(&mut self, now: Instant) {
        if !self.due().is_due(now) {
            return;
        }
        self.network.advance(now);
        if !self.network.is_on_line() {
            return;
        }
        if self.slaves_due.is_due(now) {
            self.slaves_due = Deadline::NEVER;
            for place in 0..SLAVES {
                let Some(due) = self.due.get(place).copied() else { continue };
                if !due.is_due(now) {
                    self.slaves_due = self.slaves_due.min(due);
                    continue;
                }
                if let Some(slave) = self.slaves.get_mut(place).and_then(Option::as_mut) {
                    slave.advance(now);
                }
                self.note(place);
            }
        }
        self.live.advance(now);
        self.cycle.advance(now);
    }

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        let check = self.network.transmit(self.identity.vendor, self.identity.serial);
        if check.is_some() || !self.network.is_on_line() {
            return check;
        }
        // An acknowledge is waited for with the shortest patience: 16 ms.
        self.acknowledge()
            .or_else(|| self.explicit_message(now))
            .or_else(|| self.probe(now))
            .or_else(|| self.poll(now))
    }

    fn deadline(&self) -> Option<Instant> {
        self.due().instant()
    }
}

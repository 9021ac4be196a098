//! Our side of one client, without I/O.

use std::time::Duration;

use codewheel_station::can::Frame;

use super::command::{Command, CommandDecoder};
use super::word::Word;
use crate::segment::{self, Guest, Moment};

/// One client's way through the modes: no bus, then broadcast, raw or control.
///
/// Starts without a bus. Frames are sent in any mode but control, and received in raw mode alone:
/// the subscriptions of broadcast mode and its cyclic frames are not served, and refused. So is what
/// is no command. Statistics are told once, when they are asked for.
#[derive(Clone, Debug, Default)]
pub struct Session {
    decoder: CommandDecoder,
    mode: Mode,
    /// Data octets and frames.
    received: [u64; 2],
    sent: [u64; 2],
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Mode {
    #[default]
    NoBus,
    Broadcast,
    Raw,
    Control,
}

/// What a client's command leads to.
pub type Effect = segment::Effect<Word>;

impl Session {
    /// Takes octets of the client, in pieces of any size, and tells `effect` what to do.
    pub fn receive(&mut self, octets: &[u8], mut effect: impl FnMut(Effect)) {
        for octet in octets {
            match self.decoder.push(*octet) {
                None => {}
                Some(Ok(command)) => self.obey(command, &mut effect),
                Some(Err(_)) => effect(Effect::Answer(Word::unknown())),
            }
        }
    }

    /// The word that brings a frame of the bus to the client, or `None` unless it is in raw mode.
    /// `at` is the time since the beginning of 1970.
    #[must_use]
    pub fn deliver(&mut self, frame: &Frame, at: Duration) -> Option<Word> {
        if self.mode == Mode::NoBus {
            return None;
        }
        count(&mut self.received, frame);
        (self.mode == Mode::Raw).then(|| Word::frame(frame, at))
    }

    fn obey(&mut self, command: Command, effect: &mut impl FnMut(Effect)) {
        let answer = match (command, self.mode) {
            (Command::Echo, _) => Word::echo(),
            (Command::Open, Mode::NoBus) => {
                self.mode = Mode::Broadcast;
                effect(Effect::Opened { listen_only: false, bit_rate: None });
                Word::ok()
            }
            (Command::Open, _) | (_, Mode::NoBus) => Word::unknown(),
            (Command::Raw, _) => self.turn(Mode::Raw),
            (Command::Broadcast, _) => self.turn(Mode::Broadcast),
            (Command::Control, _) => self.turn(Mode::Control),
            // A frame that was sent is not answered.
            (Command::Send(frame), Mode::Broadcast | Mode::Raw) => {
                count(&mut self.sent, &frame);
                effect(Effect::Transmit(frame));
                return;
            }
            (Command::Statistics(0), Mode::Control) => return,
            (Command::Statistics(_), Mode::Control) => Word::statistics(self.received, self.sent),
            (Command::Send(_) | Command::Statistics(_), _) => Word::unknown(),
        };
        effect(Effect::Answer(answer));
    }

    fn turn(&mut self, mode: Mode) -> Word {
        self.mode = mode;
        Word::ok()
    }
}

fn count([octets, frames]: &mut [u64; 2], frame: &Frame) {
    *octets += frame.data().len() as u64;
    *frames += 1;
}

impl Guest for Session {
    type Word = Word;
    const KIND: &'static str = "socketcand-listen";

    fn greeting() -> Option<Word> {
        Some(Word::hi())
    }

    fn hear(&mut self, octets: &[u8], effect: impl FnMut(Effect)) {
        self.receive(octets, effect);
    }

    fn tell(&mut self, frame: &Frame, at: Moment) -> Option<Word> {
        self.deliver(frame, at.since_1970)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the client reads back, and what it put on the bus.
    fn say(session: &mut Session, octets: &str) -> (String, Vec<Frame>) {
        let (mut answers, mut frames) = (String::new(), Vec::new());
        session.receive(octets.as_bytes(), |effect| match effect {
            Effect::Answer(word) => answers.push_str(word.as_text()),
            Effect::Transmit(frame) => frames.push(frame),
            Effect::Opened { .. } | Effect::Closed => {}
        });
        (answers, frames)
    }

    #[test]
    fn a_session_reads_as_with_the_real_server() {
        let session = &mut Session::default();
        let poll = Frame::standard(0x42D, &[]);
        assert_eq!(session.deliver(&poll, Duration::ZERO), None);
        assert_eq!(say(session, "< open can0 >"), ("< ok >".to_owned(), vec![]));
        assert_eq!(session.deliver(&poll, Duration::ZERO), None);
        assert_eq!(say(session, "< rawmode >"), ("< ok >".to_owned(), vec![]));
        assert_eq!(say(session, "< send 42D 0 >"), (String::new(), vec![poll]));
        let word = session.deliver(&Frame::standard(0x3C5, &[7]), Duration::from_secs(1)).unwrap();
        assert_eq!(word.as_text(), "< frame 3C5 1.000000 07 >");
    }

    #[test]
    fn without_a_bus_nothing_goes_but_opening_one() {
        let session = &mut Session::default();
        let (answers, frames) = say(session, "< rawmode >< send 42D 0 >< statistics 1 >< echo >");
        assert_eq!(answers, format!("{}< echo >", "< error unknown command >".repeat(3)));
        assert_eq!(frames, []);
    }

    #[test]
    fn a_second_opening_and_cyclic_frames_are_refused() {
        let session = &mut Session::default();
        let refused = "< error unknown command >";
        let (answers, _) =
            say(session, "< open a >< open b >< add 1 0 123 0 >< subscribe 0 0 123 >");
        assert_eq!(answers, format!("< ok >{}", refused.repeat(3)));
    }

    #[test]
    fn statistics_count_data_and_frames_both_ways() {
        let session = &mut Session::default();
        say(session, "< open can0 >< send 42D 2 1 2 >< send 42D 0 >< controlmode >");
        assert_eq!(session.deliver(&Frame::standard(0x3C5, &[1, 2, 3]), Duration::ZERO), None);
        let (answers, frames) = say(session, "< statistics 1000 >< statistics 0 >< send 1 0 >");
        assert_eq!(answers, "< stat 3 1 2 2 >< error unknown command >");
        assert_eq!(frames, []);
    }
}

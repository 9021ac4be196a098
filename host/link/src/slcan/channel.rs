//! The adapter's side of one client, without I/O.

use codewheel_station::can::{Frame, Identifier};

use super::command::{Command, CommandDecoder};
use super::line::Line;
use crate::segment::{self, Guest, Moment};

/// One client's channel to the bus: closed, open, or open to listen only.
///
/// Starts closed. Follows the CAN232 manual: frames, `F` and `C` need an open channel; `S`, `Z`,
/// `O`, `L` and settings of the hardware a closed one. One line has one answer.
#[derive(Clone, Debug, Default)]
pub struct Channel {
    decoder: CommandDecoder,
    access: Access,
    bit_rate: Option<u32>,
    timestamps: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Access {
    #[default]
    Closed,
    Open,
    ListenOnly,
}

/// What a client's line leads to.
pub type Effect = segment::Effect<Line>;

impl Channel {
    /// Takes octets of the client, in pieces of any size, and tells `effect` what to do.
    pub fn receive(&mut self, octets: &[u8], mut effect: impl FnMut(Effect)) {
        for octet in octets {
            match self.decoder.push(*octet) {
                None => {}
                Some(Ok(command)) => self.obey(command, &mut effect),
                Some(Err(_)) => effect(Effect::Answer(Line::REFUSED)),
            }
        }
    }

    /// The line that brings a frame of the bus to the client, or `None` while its channel is
    /// closed. `milliseconds` is any running time; the client gets it modulo 60 000.
    #[must_use]
    pub fn deliver(&self, frame: &Frame, milliseconds: u64) -> Option<Line> {
        let timestamp = self.timestamps.then_some((milliseconds % 60_000) as u16);
        (self.access != Access::Closed).then(|| Line::frame(frame, timestamp))
    }

    fn obey(&mut self, command: Command, effect: &mut impl FnMut(Effect)) {
        let closed = self.access == Access::Closed;
        let answer = match command {
            Command::Flush => Line::DONE,
            Command::Version => Line::short(b"V1013\r"),
            Command::SerialNumber => Line::short(b"NCW01\r"),
            Command::Status if !closed => Line::short(b"F00\r"),
            Command::BitRate(chosen) if closed => {
                self.bit_rate = Some(chosen);
                Line::DONE
            }
            Command::Timestamps(wanted) if closed => {
                self.timestamps = wanted;
                Line::DONE
            }
            Command::Hardware if closed => Line::DONE,
            Command::Open | Command::Listen if closed => {
                let listen_only = command == Command::Listen;
                self.access = if listen_only { Access::ListenOnly } else { Access::Open };
                effect(Effect::Opened { listen_only, bit_rate: self.bit_rate });
                Line::DONE
            }
            Command::Close if !closed => {
                self.access = Access::Closed;
                effect(Effect::Closed);
                Line::DONE
            }
            Command::Transmit(frame) if self.access == Access::Open => {
                effect(Effect::Transmit(frame));
                match frame.identifier() {
                    Identifier::Standard(_) => Line::short(b"z\r"),
                    Identifier::Extended(_) => Line::short(b"Z\r"),
                }
            }
            _ => Line::REFUSED,
        };
        effect(Effect::Answer(answer));
    }
}

impl Guest for Channel {
    type Word = Line;
    const KIND: &'static str = "slcan-listen";

    fn hear(&mut self, octets: &[u8], effect: impl FnMut(Effect)) {
        self.receive(octets, effect);
    }

    fn tell(&mut self, frame: &Frame, at: Moment) -> Option<Line> {
        self.deliver(frame, at.milliseconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn effects(channel: &mut Channel, octets: &[u8]) -> Vec<Effect> {
        let mut effects = Vec::new();
        channel.receive(octets, |effect| effects.push(effect));
        effects
    }

    /// What the client reads back.
    fn answers(channel: &mut Channel, octets: &[u8]) -> String {
        let mut answers = Vec::new();
        channel.receive(octets, |effect| {
            if let Effect::Answer(line) = effect {
                answers.extend_from_slice(line.as_octets());
            }
        });
        String::from_utf8(answers).unwrap()
    }

    #[test]
    fn a_session_reads_as_with_the_real_adapter() {
        let channel = &mut Channel::default();
        assert_eq!(answers(channel, b"\r\r\r"), "\r\r\r");
        assert_eq!(answers(channel, b"V\rN\r"), "V1013\rNCW01\r");
        assert_eq!(answers(channel, b"S4\rZ0\rO\r"), "\r\r\r");
        assert_eq!(answers(channel, b"t42D0\rT0000042D0\rr42D0\rR0000042D0\r"), "z\rZ\rz\rZ\r");
        assert_eq!(answers(channel, b"F\rC\r"), "F00\r\r");
    }

    #[test]
    fn a_closed_channel_takes_no_frames_and_gives_none() {
        let channel = &mut Channel::default();
        assert_eq!(answers(channel, b"t42D0\rF\rC\r"), "\x07\x07\x07");
        assert_eq!(channel.deliver(&Frame::standard(1, &[]), 0), None);
    }

    #[test]
    fn an_open_channel_keeps_its_settings() {
        let channel = &mut Channel::default();
        assert_eq!(answers(channel, b"O\r"), "\r");
        assert_eq!(answers(channel, b"O\rL\rS4\rZ1\rs031C\rM00000000\r"), "\x07".repeat(6));
    }

    #[test]
    fn a_listener_hears_and_cannot_speak() {
        let channel = &mut Channel::default();
        assert_eq!(answers(channel, b"L\rt42D0\r"), "\r\x07");
        let line = channel.deliver(&Frame::standard(0x3C5, &[0xAB]), 0).unwrap();
        assert_eq!(line.as_octets(), b"t3C51AB\r");
    }

    #[test]
    fn time_is_appended_modulo_a_minute_when_asked_for() {
        let channel = &mut Channel::default();
        assert_eq!(answers(channel, b"Z1\rO\r"), "\r\r");
        let line = channel.deliver(&Frame::standard(0x3C5, &[]), 60_000 + 0x12AB).unwrap();
        assert_eq!(line.as_octets(), b"t3C5012AB\r");
    }

    #[test]
    fn opening_tells_the_rate_that_was_chosen_or_that_none_was() {
        let opened = |octets| effects(&mut Channel::default(), octets).into_iter().rev().nth(1);
        assert_eq!(
            opened(b"S6\rO\r"),
            Some(Effect::Opened { listen_only: false, bit_rate: Some(500_000) })
        );
        assert_eq!(opened(b"L\r"), Some(Effect::Opened { listen_only: true, bit_rate: None }));
    }

    #[test]
    fn a_frame_goes_to_the_bus_before_it_is_confirmed() {
        let channel = &mut Channel::default();
        answers(channel, b"O\r");
        assert_eq!(
            effects(channel, b"t3C50\r"),
            [Effect::Transmit(Frame::standard(0x3C5, &[])), Effect::Answer(Line::short(b"z\r")),]
        );
    }

    /// Octets that look enough like SLCAN to get somewhere.
    fn talk() -> impl Strategy<Value = Vec<u8>> {
        let letter = prop_oneof![
            8 => proptest::sample::select(b"0123456789abcdefABCDEF".to_vec()),
            4 => Just(b'\r'),
            4 => proptest::sample::select(b"OLCSZtTrRVNFsMmWUXQ\n\x07".to_vec()),
            1 => any::<u8>(),
        ];
        proptest::collection::vec(letter, 0..300)
    }

    proptest! {
        #[test]
        fn the_split_into_pieces_changes_nothing(
            octets in talk(),
            cuts in proptest::collection::vec(1_usize..40, 1..20),
        ) {
            let whole = effects(&mut Channel::default(), &octets);
            let mut channel = Channel::default();
            let mut pieces = Vec::new();
            let mut rest = &octets[..];
            for cut in cuts.iter().cycle() {
                if rest.is_empty() {
                    break;
                }
                let (piece, tail) = rest.split_at((*cut).min(rest.len()));
                pieces.extend(effects(&mut channel, piece));
                rest = tail;
            }
            prop_assert_eq!(whole, pieces);
        }

        #[test]
        fn every_line_has_exactly_one_answer(octets in talk()) {
            let answers = effects(&mut Channel::default(), &octets)
                .into_iter()
                .filter(|effect| matches!(effect, Effect::Answer(_)))
                .count();
            let lines = octets.iter().filter(|octet| **octet == b'\r').count();
            prop_assert_eq!(answers, lines);
        }

        #[test]
        fn a_frame_survives_the_way_through_two_channels(
            bits in 0_u32..0x2000_0000, wide: bool, data in proptest::collection::vec(any::<u8>(), 0..=8),
        ) {
            let identifier = match wide {
                true => Identifier::Extended(bits),
                false => Identifier::Standard((bits & 0x7FF) as u16),
            };
            let frame = Frame::new(identifier, &data).unwrap();
            let mut channel = Channel::default();
            effects(&mut channel, b"O\r");
            let line = channel.deliver(&frame, 0).unwrap();
            let heard = effects(&mut channel, line.as_octets());
            prop_assert_eq!(heard[0], Effect::Transmit(frame));
        }
    }
}

//! What a terminal driver writes among the octets about broken characters (`PARMRK`, termios(3)):
//! `FF 00 x` for a character x with a parity or framing error, `FF 00 00` for a break, `FF FF` for
//! the octet FF.

use crate::rs485::Rs485Received;

/// Reads marks, in pieces of any size.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Marks {
    state: State,
}

#[derive(Clone, Copy, Debug, Default)]
enum State {
    #[default]
    Plain,
    /// After `FF`.
    Marked,
    /// After `FF 00`.
    Broken,
}

impl Marks {
    /// Takes octets of the driver and gives to `tell` what they mean, in order.
    pub(super) fn read(&mut self, octets: &[u8], mut tell: impl FnMut(Rs485Received)) {
        let mut plain = Vec::with_capacity(octets.len());
        for octet in octets {
            self.state = match (self.state, *octet) {
                (State::Plain, 0xFF) => State::Marked,
                (State::Marked, 0x00) => State::Broken,
                (State::Broken, _) => {
                    if !plain.is_empty() {
                        tell(Rs485Received::Octets(std::mem::take(&mut plain)));
                    }
                    tell(Rs485Received::BrokenCharacter);
                    State::Plain
                }
                // After FF only FF is written; a driver that writes another octet means that one.
                (State::Plain | State::Marked, octet) => {
                    plain.push(octet);
                    State::Plain
                }
            };
        }
        if !plain.is_empty() {
            tell(Rs485Received::Octets(plain));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(marks: &mut Marks, octets: &[u8]) -> Vec<Rs485Received> {
        let mut read = Vec::new();
        marks.read(octets, |received| read.push(received));
        read
    }

    fn octets(octets: &[u8]) -> Rs485Received {
        Rs485Received::Octets(octets.to_vec())
    }

    #[test]
    fn broken_characters_stand_where_they_came() {
        let said = [0x10, 0xFF, 0xFF, 0x07, 0xFF, 0x00, 0x02, 0x49, 0xFF, 0x00, 0x00, 0xFF, 0xFF];
        assert_eq!(
            read(&mut Marks::default(), &said),
            [
                octets(&[0x10, 0xFF, 0x07]),
                Rs485Received::BrokenCharacter,
                octets(&[0x49]),
                Rs485Received::BrokenCharacter,
                octets(&[0xFF]),
            ]
        );
    }

    /// A character on the line; the driver's way to say it.
    fn mark(said: &mut Vec<u8>, octet: u8, is_broken: bool) {
        match (octet, is_broken) {
            (_, true) => said.extend([0xFF, 0x00, octet]),
            (0xFF, false) => said.extend([0xFF, 0xFF]),
            (_, false) => said.push(octet),
        }
    }

    proptest! {
        #[test]
        fn what_was_on_the_line_is_read_whatever_the_pieces(
            line in prop::collection::vec((any::<u8>(), prop::bool::weighted(0.1)), 0..200),
            piece in 1_usize..40,
        ) {
            let mut said = Vec::new();
            for (octet, is_broken) in &line {
                mark(&mut said, *octet, *is_broken);
            }
            let mut marks = Marks::default();
            let mut heard = Vec::new();
            for piece in said.chunks(piece) {
                for received in read(&mut marks, piece) {
                    match received {
                        Rs485Received::Octets(octets) => heard.extend(octets.into_iter().map(Some)),
                        _ => heard.push(None),
                    }
                }
            }
            let expected: Vec<_> =
                line.iter().map(|(octet, is_broken)| (!is_broken).then_some(*octet)).collect();
            prop_assert_eq!(heard, expected);
        }

        #[test]
        fn any_octets_whatever_are_read_and_none_is_invented(
            said in prop::collection::vec(any::<u8>(), 0..200),
        ) {
            let heard: usize = read(&mut Marks::default(), &said)
                .iter()
                .map(|received| match received {
                    Rs485Received::Octets(octets) => octets.len(),
                    _ => 3,
                })
                .sum();
            prop_assert!(heard <= said.len());
        }
    }
}

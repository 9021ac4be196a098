//! Telegrams out of the octets that an RS-485 port brings.

use codewheel_profibus::telegram::Telegram;
use codewheel_station::rs485::BaudRate;
use codewheel_station::{Duration, Instant};

use crate::Condition;

/// The pause after which what follows begins anew, at the least: on a PC nobody sees 33 bits.
const PAUSE: Duration = Duration::from_millis(1);
/// How long a telegram may pause on its way through adapters and networks.
const ABANDONED: Duration = Duration::from_millis(50);
const IDLE_BITS: u32 = 33;
const LONGEST: usize = 255;

/// Makes telegrams of octets, as a port of a PC brings them: in portions of any size, several
/// telegrams in one, and without a trace of short pauses.
///
/// What is no telegram is given as broken, from where it began to the next pause, since payload must
/// not be taken for the beginning of a telegram. A telegram that stays incomplete for 50 ms is broken
/// as well.
#[derive(Clone, Debug)]
pub struct Framer {
    octets: Vec<u8>,
    /// No telegram begins before the next pause.
    astray: bool,
    last: Instant,
    pause: Duration,
    abandoned: Duration,
}

impl Framer {
    /// A framer for a line at `rate`.
    #[must_use]
    pub fn new(rate: BaudRate) -> Self {
        let idle = rate.bits(IDLE_BITS);
        Self {
            octets: Vec::with_capacity(2 * LONGEST),
            astray: false,
            last: Instant::ZERO,
            pause: PAUSE.max(idle),
            abandoned: ABANDONED.max(idle),
        }
    }

    /// Takes octets whose last one ended at `at`, and gives each telegram that is complete now, with
    /// the moment of its end.
    pub fn push(
        &mut self,
        at: Instant,
        octets: &[u8],
        give: &mut impl FnMut(Instant, &[u8], Condition),
    ) {
        let silence = at.since(self.last);
        if silence > self.abandoned || self.astray && silence > self.pause {
            self.end(give);
        }
        self.last = at;
        for portion in octets.chunks(LONGEST) {
            self.octets.extend_from_slice(portion);
            self.give_complete(at, give);
        }
    }

    /// A broken character ended at `at`: whatever it is part of is broken.
    pub fn broken(&mut self, at: Instant, give: &mut impl FnMut(Instant, &[u8], Condition)) {
        if at.since(self.last) > self.pause {
            self.end(give);
        }
        self.last = at;
        self.astray = true;
    }

    /// Gives what is incomplete as broken; at the end of a recording.
    pub fn end(&mut self, give: &mut impl FnMut(Instant, &[u8], Condition)) {
        if !self.octets.is_empty() {
            give(self.last, &self.octets, Condition::Broken);
        }
        self.octets.clear();
        self.astray = false;
    }

    fn give_complete(&mut self, at: Instant, give: &mut impl FnMut(Instant, &[u8], Condition)) {
        let mut begin = 0;
        while !self.astray {
            let rest = self.octets.get(begin..).unwrap_or_default();
            match Telegram::decode(rest) {
                Ok(Some(telegram)) => {
                    let length = telegram.length();
                    give(at, rest.get(..length).unwrap_or_default(), Condition::Intact);
                    begin += length;
                }
                Ok(None) => break,
                Err(_) => self.astray = true,
            }
        }
        self.octets.drain(..begin);
        while self.astray && self.octets.len() > LONGEST {
            give(at, self.octets.get(..LONGEST).unwrap_or_default(), Condition::Broken);
            self.octets.drain(..LONGEST);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Given = Vec<(u64, Vec<u8>, Condition)>;

    fn given(portions: &[(u64, &[u8])]) -> Given {
        let mut framer = Framer::new(BaudRate::Mbit1_5);
        let mut all = Given::new();
        let mut give = |at: Instant, octets: &[u8], condition| {
            all.push((at.as_nanos() / 1_000_000, octets.to_vec(), condition));
        };
        for (millis, octets) in portions {
            let at = Instant::ZERO + Duration::from_millis(*millis);
            match *octets {
                [] => framer.broken(at, &mut give),
                octets => framer.push(at, octets, &mut give),
            }
        }
        framer.end(&mut give);
        all
    }

    const STATUS: &[u8] = &[0x10, 7, 2, 0x49, 0x52, 0x16];

    #[test]
    fn telegrams_come_out_whole_however_they_come_in() {
        let all = [STATUS, &[0xE5], &[0xDC, 2, 2]].concat();
        let expected = |at: [u64; 3]| -> Given {
            vec![
                (at[0], STATUS.to_vec(), Condition::Intact),
                (at[1], vec![0xE5], Condition::Intact),
                (at[2], vec![0xDC, 2, 2], Condition::Intact),
            ]
        };
        assert_eq!(given(&[(5, &all)]), expected([5, 5, 5]));
        let single: Vec<(u64, &[u8])> = (0..).zip(all.chunks(1)).collect();
        assert_eq!(given(&single), expected([5, 6, 9]));
    }

    #[test]
    fn what_is_no_telegram_is_broken_up_to_the_next_pause() {
        let wrong = [&[0x68, 5, 6, 0x68][..], STATUS].concat();
        let all = given(&[(0, &wrong), (1, &[0xE5]), (9, STATUS)]);
        let broken = [wrong.as_slice(), &[0xE5]].concat();
        let expected =
            vec![(1, broken, Condition::Broken), (9, STATUS.to_vec(), Condition::Intact)];
        assert_eq!(all, expected);
    }

    #[test]
    fn a_telegram_that_never_ends_is_broken_and_the_next_one_is_not() {
        let all = given(&[(0, &STATUS[..4]), (100, STATUS)]);
        let expected = vec![
            (0, STATUS[..4].to_vec(), Condition::Broken),
            (100, STATUS.to_vec(), Condition::Intact),
        ];
        assert_eq!(all, expected);
    }

    #[test]
    fn a_broken_character_breaks_its_telegram() {
        let all = given(&[(0, &STATUS[..3]), (0, &[]), (0, &STATUS[3..]), (5, STATUS)]);
        let expected =
            vec![(0, STATUS.to_vec(), Condition::Broken), (5, STATUS.to_vec(), Condition::Intact)];
        assert_eq!(all, expected);
    }

    #[test]
    fn garbage_without_a_pause_is_given_in_portions_and_nothing_of_it_is_lost() {
        let all = given(&[(0, &[0x55; 1_000])]);
        assert!(all.iter().all(|(_, octets, condition)| {
            octets.len() <= LONGEST && *condition == Condition::Broken
        }));
        assert_eq!(all.iter().map(|(_, octets, _)| octets.len()).sum::<usize>(), 1_000);
    }
}

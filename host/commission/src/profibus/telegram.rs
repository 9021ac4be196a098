//! Octets to telegrams: whole ones, free of errors, and nothing else.

use codewheel_station::Instant;
use codewheel_station::rs485::{BaudRate, Input, TRANSMISSION_OCTETS};

/// Idle bits before a request (T_SYN), after which a broken telegram is over for certain.
pub(super) const SYNCHRONIZATION_BITS: u32 = 33;

const SC: u8 = 0xE5;
const SD1: u8 = 0x10;
const SD2: u8 = 0x68;
const SD3: u8 = 0xA2;
const SD4: u8 = 0xDC;
const ED: u8 = 0x16;

/// What octets begin with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Begins {
    /// A telegram of which octets are missing.
    Unfinished,
    /// An error-free telegram of so many octets.
    Telegram(usize),
    /// No telegram.
    Broken,
}

/// Looks at the octets from a start delimiter on.
fn begins(octets: &[u8]) -> Begins {
    let (head, length) = match *octets {
        [] => return Begins::Unfinished,
        [SC, ..] => return Begins::Telegram(1),
        [SD4, _, _, ..] => return Begins::Telegram(3),
        [SD4, ..] => return Begins::Unfinished,
        [SD1, ..] => (1, 6),
        [SD3, ..] => (1, 14),
        [SD2, length, repeated, delimiter, ..] => {
            if length != repeated || !(4..=249).contains(&length) || delimiter != SD2 {
                return Begins::Broken;
            }
            (4, usize::from(length) + 6)
        }
        [SD2, ..] => return Begins::Unfinished,
        _ => return Begins::Broken,
    };
    let Some(telegram) = octets.get(..length) else { return Begins::Unfinished };
    match telegram.get(head..) {
        Some([summed @ .., check, ED])
            if summed.iter().fold(0, |sum: u8, octet| sum.wrapping_add(*octet)) == *check =>
        {
            Begins::Telegram(length)
        }
        _ => Begins::Broken,
    }
}

/// Collects octets and gives the telegrams that they are.
///
/// After an error everything is dropped until the line has been idle for 33 bits: a start
/// delimiter inside a broken telegram is payload as likely as not. A telegram that comes in pieces,
/// as serial adapters deliver them, is waited for as long as an answer is: the slot time.
#[derive(Debug)]
pub(super) struct Receiver {
    baud_rate: BaudRate,
    slot_bits: u32,
    octets: Vec<u8>,
    broken: bool,
    quiet_since: Instant,
    /// Telegrams and characters that were broken, or were never finished.
    pub(super) errors: u64,
}

impl Receiver {
    pub(super) fn new(baud_rate: BaudRate, slot_bits: u16) -> Self {
        Self {
            baud_rate,
            slot_bits: u32::from(slot_bits),
            octets: Vec::with_capacity(TRANSMISSION_OCTETS),
            broken: false,
            quiet_since: Instant::ZERO,
            errors: 0,
        }
    }

    /// Takes in what arrived; then ask [`next`](Self::next) until `None`.
    pub(super) fn push(&mut self, now: Instant, input: Input<'_>) {
        let characters = match input {
            Input::Octets(octets) => u32::try_from(octets.len()).unwrap_or(u32::MAX),
            Input::BrokenCharacter => 1,
        };
        let began = now - self.baud_rate.characters(characters);
        let pause = began.since(self.quiet_since);
        self.quiet_since = now;
        // A bit less: the line's and our own rounding shall not cost a telegram.
        if self.broken && pause >= self.baud_rate.bits(SYNCHRONIZATION_BITS - 1) {
            self.broken = false;
        }
        if !self.octets.is_empty() && pause >= self.baud_rate.bits(self.slot_bits) {
            self.octets.clear();
            self.errors += 1;
        }
        match input {
            Input::BrokenCharacter => self.fail(),
            Input::Octets(octets) if !self.broken => self.octets.extend_from_slice(octets),
            Input::Octets(_) => {}
        }
    }

    /// Moves the next telegram into `telegram`.
    pub(super) fn next(&mut self, telegram: &mut Vec<u8>) -> bool {
        match begins(&self.octets) {
            Begins::Telegram(length) => {
                telegram.clear();
                telegram.extend(self.octets.drain(..length));
                true
            }
            Begins::Unfinished => false,
            Begins::Broken => {
                self.fail();
                false
            }
        }
    }

    /// Until when the rest of a telegram that has begun may take, at most, where it is handed in
    /// at once with its last octet; the origin without one.
    pub(super) fn patience(&self) -> Instant {
        let length = match *self.octets.as_slice() {
            [] => return Instant::ZERO,
            [SD1, ..] => 6,
            [SD3, ..] => 14,
            [SD4, ..] => 3,
            [SD2, length, ..] => usize::from(length) + 6,
            _ => TRANSMISSION_OCTETS,
        };
        let rest = u32::try_from(length.saturating_sub(self.octets.len())).unwrap_or(0);
        self.quiet_since + self.baud_rate.characters(rest + 1)
    }

    /// Forgets what has arrived: the master speaks.
    pub(super) fn clear(&mut self) {
        if !self.octets.is_empty() {
            self.octets.clear();
            self.errors += 1;
        }
        self.broken = false;
    }

    fn fail(&mut self) {
        self.octets.clear();
        if !self.broken {
            self.broken = true;
            self.errors += 1;
        }
    }
}

/// Where the user data of a telegram with both SAPs begin; `None` for another telegram.
pub(super) fn user_data(telegram: &[u8]) -> Option<usize> {
    match *telegram.first()? {
        SD2 => Some(9),
        SD3 => Some(6),
        _ => None,
    }
}

/// Puts `octets` at the end of the user data of a telegram with both SAPs, and the check octet
/// right. Nothing happens where they do not fit.
pub(super) fn fill(telegram: &mut [u8], octets: &[u8]) {
    let Some(data) = user_data(telegram) else { return };
    let Some(end) = telegram.len().checked_sub(2) else { return };
    let head = if telegram.first() == Some(&SD2) { 4 } else { 1 };
    let Some(begin) = end.checked_sub(octets.len()).filter(|begin| *begin >= data) else { return };
    if let Some(place) = telegram.get_mut(begin..end) {
        place.copy_from_slice(octets);
    }
    let summed = telegram.get(head..end).unwrap_or_default();
    let sum = summed.iter().fold(0, |sum: u8, octet| sum.wrapping_add(*octet));
    if let Some(check) = telegram.get_mut(end) {
        *check = sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_station::Duration;

    const STATUS: [u8; 6] = [0x10, 0x22, 0x02, 0x49, 0x6D, 0x16];
    const OUTPUTS: [u8; 13] =
        [0x68, 0x07, 0x07, 0x68, 0x07, 0x02, 0x7D, 0x00, 0x00, 0x00, 0x00, 0x86, 0x16];
    const RATE: BaudRate = BaudRate::Mbit1_5;

    fn at(micros: u64) -> Instant {
        Instant::ZERO + Duration::from_micros(micros)
    }

    fn received(receiver: &mut Receiver) -> Vec<Vec<u8>> {
        let mut all = Vec::new();
        let mut one = Vec::new();
        while receiver.next(&mut one) {
            all.push(one.clone());
        }
        all
    }

    #[test]
    fn every_part_of_a_telegram_is_not_yet_one() {
        for telegram in [&STATUS[..], &OUTPUTS, &[0xDC, 3, 2], &[0xE5]] {
            for length in 0..telegram.len() {
                assert_eq!(begins(&telegram[..length]), Begins::Unfinished);
            }
            assert_eq!(begins(telegram), Begins::Telegram(telegram.len()));
        }
    }

    #[test]
    fn every_wrong_bit_breaks_a_telegram_or_makes_it_another() {
        for place in 0..OUTPUTS.len() {
            for bit in 0..8 {
                let mut telegram = OUTPUTS;
                telegram[place] ^= 1 << bit;
                assert_ne!(begins(&telegram), Begins::Telegram(OUTPUTS.len()), "{place} {bit}");
            }
        }
    }

    #[test]
    fn telegrams_without_a_pause_between_them_are_told_apart() {
        let mut receiver = Receiver::new(RATE, 300);
        let both = [&STATUS[..], &OUTPUTS].concat();
        receiver.push(at(1_000), Input::Octets(&both));
        assert_eq!(received(&mut receiver), [STATUS.to_vec(), OUTPUTS.to_vec()]);
    }

    #[test]
    fn after_an_error_all_is_dropped_until_the_line_was_idle() {
        let mut receiver = Receiver::new(RATE, 300);
        receiver.push(at(1_000), Input::Octets(&[0x00]));
        receiver.push(at(1_060), Input::BrokenCharacter);
        assert!(received(&mut receiver).is_empty());
        // 66 bits last 44 µs; the first begins 16 µs after the broken character, 24 bits.
        receiver.push(at(1_120), Input::Octets(&STATUS));
        assert!(received(&mut receiver).is_empty());
        receiver.push(at(1_187), Input::Octets(&STATUS));
        assert_eq!(received(&mut receiver), [STATUS.to_vec()]);
    }

    #[test]
    fn a_telegram_in_pieces_is_waited_for_as_long_as_an_answer() {
        let mut receiver = Receiver::new(RATE, 300);
        receiver.push(at(1_000), Input::Octets(&STATUS[..3]));
        receiver.push(at(1_200), Input::Octets(&STATUS[3..]));
        assert_eq!(received(&mut receiver).len(), 1);
        receiver.push(at(2_000), Input::Octets(&STATUS[..3]));
        receiver.push(at(2_300), Input::Octets(&STATUS));
        assert_eq!(received(&mut receiver), [STATUS.to_vec()]);
        assert_eq!(receiver.errors, 1);
    }

    #[test]
    fn a_telegram_that_has_begun_is_given_the_time_its_rest_takes() {
        let mut receiver = Receiver::new(RATE, 300);
        assert_eq!(receiver.patience(), Instant::ZERO);
        receiver.push(at(1_000), Input::Octets(&OUTPUTS[..1]));
        assert_eq!(receiver.patience(), at(1_000) + RATE.characters(255));
        receiver.push(at(1_010), Input::Octets(&OUTPUTS[1..3]));
        assert_eq!(receiver.patience(), at(1_010) + RATE.characters(11));
        receiver.push(at(1_084), Input::Octets(&OUTPUTS[3..]));
        assert_eq!(received(&mut receiver).len(), 1);
        assert_eq!(receiver.patience(), Instant::ZERO);
    }

    #[test]
    fn filling_puts_octets_last_and_the_check_octet_right() {
        let mut telegram = [0x68, 6, 6, 0x68, 0x87, 0x82, 0x7C, 0x3E, 0x3E, 0, 0, 0x16];
        fill(&mut telegram, &[0xF1]);
        assert_eq!(telegram[9..], [0xF1, 0xF2, 0x16]);
        let before = telegram;
        fill(&mut telegram, &[0; 2]);
        assert_eq!(telegram, before);
    }
}

//! A telegram on the line.

use codewheel_station::rs485::{BaudRate, CHARACTER_BITS, TRANSMISSION_OCTETS, Transmission};

use super::NodeId;

/// A telegram on the line, and how far it has come. Every moment is reckoned from its begin, so that
/// no error adds up.
pub(super) struct Speaking {
    pub(super) from: NodeId,
    pub(super) sent: Transmission,
    pub(super) rate: BaudRate,
    pub(super) begin: u64,
    /// How many characters there will be: fewer than were sent where the power failed.
    length: u32,
    /// The character under way.
    pub(super) place: u32,
    /// The pause, if there is one: behind which character, and how many bits.
    pub(super) pause: Option<(u32, u32)>,
    /// All characters from this one on are broken.
    pub(super) broken_from: u32,
    /// Until when another station speaks too.
    pub(super) collides_until: u64,
    /// The slots that do not hear it.
    pub(super) deaf: Vec<usize>,
    /// Whether the speaker had the right to command, as far as it does.
    pub(super) rightful: bool,
    /// Whether all characters so far are as they were sent, without a pause.
    pub(super) intact: bool,
    /// What the line carried, up to the character under way; whether that is the whole truth says
    /// `unbroken`.
    carried: [u8; TRANSMISSION_OCTETS],
    /// Whether no character was broken and none had a pause before it.
    pub(super) unbroken: bool,
    /// How many characters have been handed to those who hear telegrams.
    pub(super) handed: u32,
}

impl Speaking {
    pub(super) fn new(from: NodeId, sent: Transmission, rate: BaudRate, begin: u64) -> Self {
        Self {
            from,
            sent,
            rate,
            begin,
            length: sent.octets().len() as u32,
            place: 0,
            pause: None,
            broken_from: u32::MAX,
            collides_until: 0,
            deaf: Vec::new(),
            rightful: true,
            intact: true,
            carried: [0; TRANSMISSION_OCTETS],
            unbroken: true,
            handed: 0,
        }
    }

    /// How many characters there are.
    pub(super) const fn length(&self) -> u32 {
        self.length
    }

    /// Whether the character under way is the last.
    pub(super) const fn is_last(&self) -> bool {
        self.place + 1 >= self.length
    }

    /// When `place` characters and the pauses before the next one are over.
    fn after(&self, place: u32, bits: u32) -> u64 {
        self.begin.saturating_add(self.rate.bits(place * CHARACTER_BITS + bits).as_nanos())
    }

    fn paused_before(&self, place: u32) -> u32 {
        self.pause.filter(|&(behind, _)| behind < place).map_or(0, |(_, bits)| bits)
    }

    /// The begin of character `place`.
    pub(super) fn begin_of(&self, place: u32) -> u64 {
        self.after(place, self.paused_before(place))
    }

    /// The end of the character under way.
    pub(super) fn character_end(&self) -> u64 {
        self.after(self.place + 1, self.paused_before(self.place))
    }

    /// The end of the last character.
    pub(super) fn end(&self) -> u64 {
        self.after(self.length, self.paused_before(self.length.saturating_sub(1)))
    }

    /// Whether a character has begun before `now`, and not only a pause. Its end is still to come.
    pub(super) fn is_within_character(&self, now: u64) -> bool {
        self.begin_of(self.place) < now
    }

    /// The octet of the character under way, as it was sent.
    pub(super) fn octet(&self) -> u8 {
        self.sent.octets().get(self.place as usize).copied().unwrap_or_default()
    }

    /// What the line carries as the character under way.
    pub(super) fn carry(&mut self, octet: u8) {
        if let Some(carried) = self.carried.get_mut(self.place as usize) {
            *carried = octet;
        }
    }

    /// The octets from character `from` up to the one under way.
    pub(super) fn carried_from(&self, from: u32) -> &[u8] {
        self.carried.get(from as usize..=self.place as usize).unwrap_or_default()
    }

    /// Whether the character under way is broken by a driver that gives out or by another speaker.
    pub(super) fn is_broken(&self) -> bool {
        self.place >= self.broken_from || self.begin_of(self.place) < self.collides_until
    }

    /// The sender has lost its power: the character under way is the last, and broken.
    pub(super) fn cut(&mut self) {
        self.length = self.length.min(self.place + 1);
        self.broken_from = self.broken_from.min(self.place);
    }
}

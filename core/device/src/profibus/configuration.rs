//! The configurations of Chk_Cfg: one row each (PROFIBUS manual §6.2).

use codewheel_encoder::Model;
use codewheel_profibus::Lengths;

use super::Refusal;

/// One configuration: what Data_Exchange carries.
///
/// All four are possible on every product (decision: the manual has no table for each of them).
#[derive(Debug, PartialEq, Eq)]
pub struct Row {
    /// The identifier octet: consistent over its whole length, in words.
    pub identifier: u8,
    /// How many octets of position the slave sends.
    pub inputs: u8,
    /// How many octets of preset the master sends.
    pub outputs: u8,
    /// The device class whose functions it carries.
    pub class: u8,
    /// Its name, at most 32 printable characters: the GSD file carries it.
    pub name: &'static str,
    /// One sentence that helps.
    pub help: &'static str,
}

/// All configurations, in the order of the manual.
pub static ROWS: [Row; 4] = [
    Row {
        identifier: 0xD1,
        inputs: 4,
        outputs: 0,
        class: 1,
        name: "32 bit position",
        help: "2 words of position",
    },
    Row {
        identifier: 0xF1,
        inputs: 4,
        outputs: 4,
        class: 2,
        name: "32 bit position and preset",
        help: "2 words of position, 2 words of preset with bit 31 as clock",
    },
    Row {
        identifier: 0xD0,
        inputs: 2,
        outputs: 0,
        class: 1,
        name: "16 bit position",
        help: "1 word of position, of a longer one the low 16 bits",
    },
    Row {
        identifier: 0xF0,
        inputs: 2,
        outputs: 2,
        class: 2,
        name: "16 bit position and preset",
        help: "1 word of position, 1 word of preset with bit 15 as clock",
    },
];

/// The bits of the position that fit a word.
const WORD_BITS: u32 = 16;

impl Row {
    /// The configuration with this identifier.
    #[must_use]
    pub fn find(identifier: u8) -> Option<&'static Self> {
        ROWS.iter().find(|row| row.identifier == identifier)
    }

    /// The configuration that Get_Cfg names before there was a Chk_Cfg: one word where the position
    /// fits, and the preset (decision).
    #[must_use]
    pub const fn default_for(model: Model) -> &'static Self {
        let [_, two_words, _, one_word] = &ROWS;
        if model.geometry.range() <= 1 << WORD_BITS { one_word } else { two_words }
    }

    /// Judges the identifiers of a Chk_Cfg.
    ///
    /// # Errors
    /// [`Refusal::Identifier`], or [`Refusal::Identifiers`] where there is not exactly one.
    pub fn judge(identifiers: &[u8]) -> Result<&'static Self, Refusal> {
        match *identifiers {
            [given] => Self::find(given).ok_or(Refusal::Identifier { given }),
            _ => Err(Refusal::Identifiers {
                count: u8::try_from(identifiers.len()).unwrap_or(u8::MAX),
            }),
        }
    }

    /// How many octets of process data it carries.
    #[must_use]
    pub const fn lengths(&self) -> Lengths {
        Lengths { inputs: self.inputs, outputs: self.outputs }
    }

    /// How many bits positions below `total` need, where it does not carry as many.
    pub(super) const fn bits_missing(&self, total: u32) -> Option<u8> {
        let bits = u32::BITS - total.saturating_sub(1).leading_zeros();
        if bits > self.inputs as u32 * u8::BITS { Some(bits as u8) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_encoder::Geometry;

    /// PROFIBUS manual §6.2; EN 50170-2: bit 7 consistency over the whole, bit 6 words, bits 5 and 4
    /// outputs and inputs, the rest the length less one.
    #[test]
    fn each_identifier_says_what_the_row_says() {
        for row in &ROWS {
            let words = (row.identifier & 0x0F) + 1;
            assert_eq!(row.identifier & 0xC0, 0xC0);
            assert_eq!(row.inputs, if row.identifier & 0x10 == 0 { 0 } else { words * 2 });
            assert_eq!(row.outputs, if row.identifier & 0x20 == 0 { 0 } else { words * 2 });
            assert!(row.name.len() <= 32 && row.name.is_ascii());
            assert_eq!(Row::judge(&[row.identifier]), Ok(row));
        }
    }

    #[test]
    fn anything_but_one_of_four_identifiers_is_refused() {
        let accepted = (0..=255).filter(|identifier| Row::judge(&[*identifier]).is_ok());
        assert!(accepted.eq([0xD0, 0xD1, 0xF0, 0xF1]));
        assert_eq!(Row::judge(&[]), Err(Refusal::Identifiers { count: 0 }));
        assert_eq!(Row::judge(&[0xF1, 0xF1]), Err(Refusal::Identifiers { count: 2 }));
    }

    #[test]
    fn one_word_is_the_default_of_13_bits_alone() {
        let default = |geometry| {
            let model = Model { geometry, lithium_cell: false, total_follows_steps: false };
            Row::default_for(model).identifier
        };
        assert_eq!(default(Geometry::SINGLETURN_13), 0xF0);
        assert_eq!(default(Geometry::SINGLETURN_18), 0xF1);
        assert_eq!(default(Geometry::MULTITURN_29), 0xF1);
    }

    #[test]
    fn bits_are_missing_from_65537_positions_on_and_only_in_one_word() {
        let [two_words, _, one_word, _] = &ROWS;
        assert_eq!(one_word.bits_missing(65_536), None);
        assert_eq!(one_word.bits_missing(65_537), Some(17));
        assert_eq!(one_word.bits_missing(1 << 29), Some(29));
        assert_eq!(one_word.bits_missing(1), None);
        assert_eq!(two_words.bits_missing(1 << 29), None);
    }
}

//! What the keys of an SSI line mean.

use codewheel_device::{Product, product};
use codewheel_encoder::ssi::{Code, Refusal, Settings, Word};
use codewheel_spidev::SsiUri;
use toml::Spanned;

use super::{Source, span};
use crate::file::{CodeName, DeviceTable, SsiTable};
use crate::{Complaint, SensorPlan};

impl Source<'_> {
    /// How a device comes to its code.
    pub(super) fn sensor(
        &self,
        table: &DeviceTable,
        product: &Product,
    ) -> Result<SensorPlan, Complaint> {
        if product.family.shaft() != product::Shaft::None {
            let because = format!("an {} has a shaft; ssi is for a HEAG 162", product.model);
            self.refuse([("ssi", span(&table.ssi))], &because)?;
            return Ok(SensorPlan::Disc);
        }
        match &table.ssi {
            None => self.ssi(&Spanned::new(0..0, SsiTable::default()), product),
            Some(given) => self.ssi(given, product),
        }
    }

    /// The SSI line of a converter.
    fn ssi(&self, given: &Spanned<SsiTable>, product: &Product) -> Result<SensorPlan, Complaint> {
        let ssi = given.get_ref();
        let words = Word::choices(product.encoder.geometry);
        let mut settings = Settings::of_word(words.first().copied().unwrap_or(Word::Bits29));
        if let Some(bits) = &ssi.word {
            let word = Word::from_bits(*bits.get_ref()).filter(|word| words.contains(word));
            settings.word = word.ok_or_else(|| {
                let words: Vec<_> = words.iter().map(|word| word.bits().to_string()).collect();
                let message = format!(
                    "an {} reads no words of {} bits: it reads {}",
                    product.model,
                    bits.get_ref(),
                    words.join(" or ")
                );
                self.complaint(bits.span(), message)
            })?;
        }
        settings.code = match ssi.code {
            Some(CodeName::Binary) => Code::Binary,
            Some(CodeName::Gray) | None => Code::Gray,
        };
        if let Some(clock) = &ssi.clock {
            settings.clock_hz = hertz(clock.get_ref()).ok_or_else(|| {
                let message =
                    format!("{:?} is no clock: write 100k to 1M, as 500k", clock.get_ref());
                self.complaint(clock.span(), message)
            })?;
        }
        if let Some(monoflop) = &ssi.monoflop {
            settings.monoflop = monoflop.get_ref().0;
        }
        settings.double_read = ssi.double_read.unwrap_or(false);
        settings.check().map_err(|refusal| {
            let at = match refusal {
                Refusal::Clock => span(&ssi.clock),
                Refusal::Monoflop { .. } | Refusal::Cycle { .. } => span(&ssi.monoflop),
            };
            self.complaint(at.unwrap_or_else(|| Spanned::span(given)), refusal.to_string())
        })?;
        let Some(line) = &ssi.line else { return Ok(SensorPlan::Ssi(settings)) };
        let uri = line.get_ref().parse::<SsiUri>();
        let uri = uri.map_err(|error| self.complaint(line.span(), error.to_string()))?;
        Ok(SensorPlan::SsiLine(settings, uri))
    }
}

/// The SSI line that `keys` and their values describe, as on a command line, for a converter.
///
/// # Errors
/// What is wrong, as one sentence.
pub(crate) fn sensor_of_keys(
    product: &Product,
    keys: &[(&str, String)],
) -> Result<SensorPlan, String> {
    if product.family.shaft() != product::Shaft::None {
        return match keys.first() {
            None => Ok(SensorPlan::Disc),
            Some(_) => Err(format!("an {} has a shaft; SSI is for a HEAG 162", product.model)),
        };
    }
    let text = super::toml_of(keys.iter().map(|(key, value)| (*key, value.as_str())));
    let table: SsiTable =
        toml::from_str(&text).map_err(|error| super::in_our_words(error.message()))?;
    let source = Source { text: &text, name: "", folder: std::path::Path::new("") };
    source
        .ssi(&Spanned::new(0..0, table), product)
        .map_err(|complaint| complaint.message().to_owned())
}

/// A frequency as people write it: `500k`, `1M`, `250000`, in whole hertz.
fn hertz(text: &str) -> Option<u32> {
    let (number, unit) = match text.strip_suffix(['k', 'M']) {
        Some(number) if text.ends_with('k') => (number, 1_000),
        Some(number) => (number, 1_000_000),
        None => (text, 1),
    };
    let (whole, decimals) = number.split_once('.').unwrap_or((number, ""));
    let digits = |text: &str| text.bytes().all(|octet| octet.is_ascii_digit());
    if whole.is_empty() || decimals.len() > 6 || !digits(whole) || !digits(decimals) {
        return None;
    }
    let parts = decimals.parse().unwrap_or(0_u64) * unit;
    let scale = 10_u64.pow(decimals.len() as u32);
    let hertz = whole.parse::<u64>().ok()?.checked_mul(unit)? + parts / scale;
    (parts % scale == 0).then_some(hertz).and_then(|hertz| u32::try_from(hertz).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_read_with_its_unit_and_to_the_hertz() {
        for (text, expected) in [
            ("500k", Some(500_000)),
            ("1M", Some(1_000_000)),
            ("0.5M", Some(500_000)),
            ("250000", Some(250_000)),
            ("100.001k", Some(100_001)),
            ("0.5", None),
            ("", None),
            ("k", None),
            ("-1k", None),
            ("500 k", None),
            ("99999999999", None),
        ] {
            assert_eq!(hertz(text), expected, "{text}");
        }
    }
}

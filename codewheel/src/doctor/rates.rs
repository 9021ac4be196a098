//! What the answers of this machine mean at each rate of PROFIBUS.

use std::time::Duration;

use codewheel_commission::profibus::{LONGEST_SLOT, shortest_slot};
use codewheel_station::rs485::{BaudRate, CHARACTER_BITS};
use serde_json::json;

use super::answers::Answers;
use super::finding::{Finding, milliseconds};

/// How much longer than 99 of 100 answers a slot should be.
const MARGIN: u32 = 2;
/// The rate that every machine should hold with what masters are delivered with.
const EXPECTED: BaudRate = BaudRate::Kbit19_2;

/// How the answers compare with what masters expect.
#[derive(Clone, Copy, Debug)]
pub(super) struct Promises {
    /// 99 of 100 answers begin within this time.
    answer: Duration,
    /// What of that the way to the line takes, as far as can be known; `None` on a loopback.
    delay: Option<Duration>,
}

/// The bits of `rate` that go into `time`, rounded up.
fn bits(time: Duration, rate: BaudRate) -> u128 {
    (time.as_nanos() * u128::from(rate.bits_per_second())).div_ceil(1_000_000_000)
}

impl Promises {
    pub(super) fn of(answers: &Answers, delay: Option<Duration>) -> Self {
        Self { answer: answers.most + delay.unwrap_or_default(), delay }
    }

    /// Whether answers begin within max T_SDR.
    fn holds_delay(&self, rate: BaudRate) -> bool {
        bits(self.answer, rate) <= rate.longest_station_delay().into()
    }

    /// Whether a master with the shortest slot time hears the first character of an answer.
    fn holds_slot(&self, rate: BaudRate) -> bool {
        bits(self.answer, rate) + u128::from(CHARACTER_BITS) <= shortest_slot(rate).into()
    }

    /// The slot time to set; `None` where none is long enough.
    fn slot(&self, rate: BaudRate) -> Option<u16> {
        let bits = bits(self.answer * MARGIN, rate) + u128::from(CHARACTER_BITS);
        let slot = u16::try_from(bits).ok()?.max(shortest_slot(rate));
        (slot <= LONGEST_SLOT).then_some(slot)
    }

    pub(super) fn finding(&self) -> Finding {
        let fastest = |holds: fn(&Self, BaudRate) -> bool| {
            let held = BaudRate::ALL.into_iter().take_while(|rate| holds(self, *rate)).last();
            held.map_or_else(|| "at no rate".to_owned(), |rate| format!("up to {rate}"))
        };
        let way = match self.delay {
            None => " (on a loopback, without an adapter)".to_owned(),
            Some(Duration::ZERO) => " (and what the port itself takes)".to_owned(),
            Some(delay) => format!(", {} of it for the way to the line", milliseconds(delay)),
        };
        let says = format!(
            "answers within {}{way}: the shortest slot time is held {}, max T_SDR {}",
            milliseconds(self.answer),
            fastest(Self::holds_slot),
            fastest(Self::holds_delay)
        );
        let mut finding = if self.holds_slot(EXPECTED) {
            Finding::fine("PROFIBUS rates", says)
        } else {
            Finding::trouble("PROFIBUS rates", says).remedy(
                "set the slot times below in the bus profile of the master, or make the way to \
                 the line shorter",
            )
        };
        finding.lines = self.table();
        finding.values(json!({
            "answer_us": self.answer.as_nanos() as f64 / 1e3,
            "rates": BaudRate::ALL.map(|rate| json!({
                "rate": rate.bits_per_second(),
                "answer_bits": bits(self.answer, rate) as u64,
                "max_station_delay_bits": rate.longest_station_delay(),
                "max_station_delay_held": self.holds_delay(rate),
                "shortest_slot_bits": shortest_slot(rate),
                "shortest_slot_held": self.holds_slot(rate),
                "slot_bits_to_set": self.slot(rate),
            })),
        }))
    }

    fn table(&self) -> Vec<String> {
        let held = |is_held| if is_held { "held" } else { "no" };
        let line = |rate: BaudRate| {
            let slot = match self.slot(rate) {
                Some(slot) if slot == shortest_slot(rate) => "the shortest".to_owned(),
                Some(slot) => format!("{slot} bits"),
                None => "none is long enough".to_owned(),
            };
            format!(
                "{:<8}{:<13}{:<5}{:<7}{:<5}{:<7}{slot}",
                rate.to_string(),
                format!("{} bits", bits(self.answer, rate)),
                rate.longest_station_delay(),
                held(self.holds_delay(rate)),
                shortest_slot(rate),
                held(self.holds_slot(rate)),
            )
        };
        let head = "RATE    ANSWER       MAX T_SDR   SLOT TIME   SLOT TIME TO SET".to_owned();
        std::iter::once(head).chain(BaudRate::ALL.map(line)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::finding::State;

    fn answering_within(answer: Duration) -> Promises {
        Promises { answer, delay: None }
    }

    /// The rates for which `holds`, as a range from the slowest on.
    fn held(promises: Promises, holds: fn(&Promises, BaudRate) -> bool) -> Option<BaudRate> {
        BaudRate::ALL.into_iter().take_while(|rate| holds(&promises, *rate)).last()
    }

    #[test]
    fn the_delays_are_those_that_our_gsd_files_promise() {
        let product = codewheel_device::Product::find("amg11-p29").unwrap();
        let sheet = codewheel_datasheet::sheet_for(product).text;
        for rate in BaudRate::ALL {
            let promise = sheet.lines().find_map(|line| {
                let (keyword, bits) = line.split_once('=')?;
                (keyword.trim() == format!("MaxTsdr_{}", rate.to_string().trim_end_matches('k')))
                    .then(|| bits.trim().parse::<u32>().ok())?
            });
            if let Some(promise) = promise {
                assert_eq!(promise, rate.longest_station_delay(), "{rate}");
            } else {
                assert!(rate >= BaudRate::Mbit1_5, "{rate} is written with its M");
            }
        }
        for (keyword, rate) in [
            ("MaxTsdr_1.5M", BaudRate::Mbit1_5),
            ("MaxTsdr_3M", BaudRate::Mbit3),
            ("MaxTsdr_6M", BaudRate::Mbit6),
            ("MaxTsdr_12M", BaudRate::Mbit12),
        ] {
            let promise = format!("{keyword} = {}", rate.longest_station_delay());
            assert!(sheet.replace("  ", " ").contains(&promise), "{promise}");
        }
    }

    #[test]
    fn a_low_latency_usb_adapter_holds_the_shortest_slots_up_to_19_2k_and_no_further() {
        let promises = answering_within(Duration::from_micros(3_050));
        assert_eq!(held(promises, Promises::holds_slot), Some(BaudRate::Kbit19_2));
        assert_eq!(held(promises, Promises::holds_delay), Some(BaudRate::Kbit19_2));
        assert_eq!(promises.finding().state, State::Fine);
        // 3.05 ms twice are 3050 bits at 500k; at 12M no slot is long enough.
        assert_eq!(promises.slot(BaudRate::Kbit500), Some(3_050 + 11));
        assert_eq!(promises.slot(BaudRate::Mbit12), None);
    }

    #[test]
    fn an_adapter_that_holds_octets_back_for_16_ms_is_a_finding_at_every_rate() {
        let promises = answering_within(Duration::from_millis(18));
        assert_eq!(held(promises, Promises::holds_slot), None);
        let finding = promises.finding();
        assert_eq!(finding.state, State::Finding);
        assert!(finding.says.contains("held at no rate"), "{}", finding.says);
        assert!(finding.remedy.is_some_and(|remedy| remedy.contains("slot time")));
        assert_eq!(promises.slot(BaudRate::Kbit9_6), Some(346 + 11));
    }

    #[test]
    fn a_slot_is_as_long_as_its_limit_exactly() {
        // 89 bits and a character fill the shortest slot of 9.6k.
        let bit = |count: u64| Duration::from_nanos(count * 1_000_000_000 / 9_600);
        assert!(answering_within(bit(89)).holds_slot(BaudRate::Kbit9_6));
        assert!(!answering_within(bit(90)).holds_slot(BaudRate::Kbit9_6));
        assert!(answering_within(bit(60)).holds_delay(BaudRate::Kbit9_6));
        assert!(!answering_within(bit(61)).holds_delay(BaudRate::Kbit9_6));
    }
}

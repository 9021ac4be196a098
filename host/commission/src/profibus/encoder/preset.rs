//! The preset of an encoder that is served (PROFIBUS manual §7.4).

use codewheel_device::profibus::configuration;
use codewheel_device::profibus::parameters::{CLASS_2, TOTAL_RESOLUTION};

use super::{Encoder, Served, Standing};
use crate::profibus::eavesdropper::position;
use crate::profibus::identity::Told;
use crate::profibus::{Console, SlaveState};
use crate::{Kind, Sample, Seat, Session, Trouble};

/// Data exchanges in which outputs are surely seen once: the first of them may have been under way
/// already.
const SEEN: u64 = 2;

impl<S: Seat<Station = Console>> Encoder<S> {
    /// Sends the preset twice, with the clock bit high and then low, and looks whether it was taken.
    pub(super) fn strike(&mut self, preset: u32) -> Result<Sample, Trouble> {
        let tried = format!("preset the encoder at address {} to {preset}", self.address);
        let served = match &self.standing {
            Standing::Served(served) => *served,
            _ => return Err(self.not_served(&tried)),
        };
        if served.configuration.outputs == 0 || !served.chosen.is_on(&CLASS_2) {
            let (came, remedy) = if served.configuration.outputs == 0 {
                let came =
                    format!("configuration {:02X}h has no preset", served.configuration.identifier);
                (came, "open the session with F1h")
            } else {
                ("class 1 has no preset".to_owned(), "write class-2 1 first")
            };
            return Err(Trouble::new(Kind::Refused, tried, came, remedy));
        }
        let before = self.read_diagnosis(&tried)?;
        let before = Told { diagnosis: &before };
        let total = before.number(TOTAL_RESOLUTION.key).unwrap_or_default();
        let largest = (total - 1).min(i64::from(largest_in(served.configuration)));
        if i64::from(preset) > largest {
            return Err(out_of_range(tried, &served, largest));
        }
        // The slave must see the bit low first: it counts as high when the exchange begins.
        for (value, clock) in [(0, false), (preset, true), (preset, false)] {
            self.put(&tried, served.configuration, value, clock)?;
        }
        let after = self.read_diagnosis(&tried)?;
        let after = Told { diagnosis: &after };
        let sample = self.sample()?;
        let is_taken =
            sample.position == preset || before.number("offset") != after.number("offset");
        if is_taken {
            return Ok(sample);
        }
        let alarm = if after.alarm() == Some(true) { ", and its alarm is on" } else { "" };
        let came = format!(
            "it did not take it: the position is {}, the offset as before{alarm}",
            sample.position
        );
        let remedy = "a converter takes none while its SSI line brings no position; a refused one \
                      lets the lamp flash red, 5 Hz, until another is good";
        Err(Trouble::new(Kind::Refused, tried, came, remedy))
    }

    /// Gives the slave other outputs, and waits until it has seen them.
    fn put(
        &mut self,
        tried: &str,
        configuration: &configuration::Row,
        value: u32,
        clock: bool,
    ) -> Result<(), Trouble> {
        let address = self.address;
        let until = self.conversation.patience();
        let since = self.set_outputs(tried, configuration, value, clock)?;
        let seen = |console: &mut Console, _| {
            let slave = console.master()?.slave(address)?;
            let is_seen = slave.state == SlaveState::DataExchange && slave.answers >= since + SEEN;
            is_seen.then_some(())
        };
        match self.conversation.wait(until, seen)? {
            Some(()) => Ok(()),
            None => Err(self.silence(tried)),
        }
    }

    /// Gives the slave other outputs, and tells how often it had answered before.
    fn set_outputs(
        &mut self,
        tried: &str,
        configuration: &configuration::Row,
        value: u32,
        clock: bool,
    ) -> Result<u64, Trouble> {
        let address = self.address;
        let wide = (value | u32::from(clock) << 31).to_be_bytes();
        let [.., high, low] = value.to_be_bytes();
        let narrow = [high | u8::from(clock) << 7, low];
        let octets: &[u8] = if configuration.outputs == 4 { &wide } else { &narrow };
        let Some(master) = self.conversation.console().master_mut() else {
            return Err(self.silence(tried));
        };
        if let Err(error) = master.set_outputs(address, octets) {
            return Err(Trouble::new(Kind::Usage, tried, error.to_string(), ""));
        }
        Ok(master.slave(address).map_or(0, |slave| slave.answers))
    }

    /// Lets the outputs be zero, as long as the slave exchanges data.
    pub(super) fn zero(&mut self, configuration: &configuration::Row) -> Result<(), Trouble> {
        if configuration.outputs == 0 {
            return Ok(());
        }
        let address = self.address;
        let until = self.conversation.patience();
        let since = self.set_outputs("release the encoder", configuration, 0, false)?;
        let is_over = |console: &mut Console, _| {
            let slave = console.master()?.slave(address)?;
            let is_over = slave.state != SlaveState::DataExchange || slave.answers >= since + SEEN;
            is_over.then_some(())
        };
        self.conversation.wait(until, is_over)?;
        Ok(())
    }

    /// The latest position of a slave that is served.
    pub(super) fn served_position(&mut self) -> Option<u32> {
        let address = self.address;
        let slave = self.conversation.console().master()?.slave(address)?;
        slave.input_at?;
        position(slave.inputs)
    }
}

/// The largest preset that its octets can say, beside the clock bit.
fn largest_in(configuration: &configuration::Row) -> u32 {
    if configuration.outputs == 4 { u32::MAX >> 1 } else { u32::MAX >> 17 }
}

fn out_of_range(tried: String, served: &Served, largest: i64) -> Trouble {
    let came = "the preset is out of range";
    let mut remedy = format!("it takes 0 to {largest}");
    if i64::from(largest_in(served.configuration)) == largest {
        remedy.push_str(", which is all that its outputs can say: F1h has more");
    }
    Trouble::new(Kind::Refused, tried, came, remedy)
}

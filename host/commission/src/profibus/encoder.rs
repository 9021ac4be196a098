//! One encoder on PROFIBUS, served by a master of ours or looked at.

mod preset;
mod session;

use codewheel_device::profibus::configuration;
use codewheel_device::profibus::parameters::{Row, TOTAL_RESOLUTION};
use codewheel_encoder::Model;
use codewheel_station::Instant;

use super::chosen::{Chosen, number_for};
use super::conversation::Conversation;
use super::identity::Told;
use super::{
    Acyclic, Answer, Console, Diagnosis, Event, HIGHEST_ADDRESS, ScanSettings, SlaveState,
};
use crate::{Kind, Progress, Reading, Seat, Trouble};

/// How a session is opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SessionSettings {
    /// The own master, and whether it joins others.
    pub master: ScanSettings,
    /// What is exchanged; `None` for F1h: 4 octets of position, and presets.
    pub configuration: Option<&'static configuration::Row>,
    /// Parameters by the keys of their rows that differ from what the encoder works with now.
    pub parameters: Vec<(String, Reading)>,
}

/// An encoder on PROFIBUS.
///
/// One that is free is parameterized with what it works with now, as its diagnosis tells, and
/// exchanges data with our master, whose watchdog lets it go should this program end. What is written
/// is a parameter of Set_Prm and lasts as long as the session; after that its own master brings its
/// own.
///
/// One that another master owns can be looked at, by Slave_Diag and by what is overheard; a slave
/// that is no encoder tells its identity and the octets of its diagnosis.
#[derive(Debug)]
pub struct Encoder<S> {
    conversation: Conversation<S>,
    address: u8,
    standing: Standing,
    /// When the latest position came that was handed out.
    sampled: Instant,
}

/// What a session can do with its slave.
#[derive(Clone, Debug)]
enum Standing {
    /// Our master serves it.
    Served(Served),
    /// Another master serves it.
    Locked {
        /// That master.
        master: u8,
        model: Model,
    },
    /// It is no encoder of the catalogue.
    Foreign,
    /// The session is over.
    Released,
}

#[derive(Clone, Copy, Debug)]
struct Served {
    chosen: Chosen,
    configuration: &'static configuration::Row,
    model: Model,
    data_sheet: &'static str,
}

/// What came of parameters and configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BroughtUp {
    ExchangesData,
    RefusedParameters,
    RefusedConfiguration,
    BelongsToAnother,
    Silent,
}

impl<S: Seat<Station = Console>> Encoder<S> {
    /// Opens a session with the slave at `address`. Listens first.
    ///
    /// # Errors
    /// [`Trouble`]: masters are on the bus and the settings do not say to join them; nobody answers;
    /// the encoder refuses what it is given; or the bus cannot be used.
    pub fn open(
        seat: S,
        address: u8,
        settings: &SessionSettings,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Self, Trouble> {
        let tried = format!("open the slave at address {address}");
        if address > HIGHEST_ADDRESS || address == settings.master.address {
            let came = if address > HIGHEST_ADDRESS {
                "there is no such address".to_owned()
            } else {
                "that is the address of this master".to_owned()
            };
            let remedy = "station addresses are 0 to 125, and each is that of one station";
            return Err(Trouble::new(Kind::Usage, tried, came, remedy));
        }
        let overrides = overrides(&tried, &settings.parameters)?;
        let mut conversation = Conversation::new(seat, settings.master);
        conversation.listen(progress)?;
        may_speak(&mut conversation, &tried, address, progress)?;
        conversation.join(&tried)?;
        let mut session =
            Self { conversation, address, standing: Standing::Foreign, sampled: Instant::ZERO };
        let opened = session.begin(&tried, settings, &overrides);
        if opened.is_err() {
            // What went wrong before is the one to hear of.
            let _ = session.let_go(&tried);
            session.conversation.abandon();
        }
        opened.map(|()| session)
    }

    /// Finds out what the slave is, and takes it where that is possible.
    fn begin(
        &mut self,
        tried: &str,
        settings: &SessionSettings,
        overrides: &[(&'static Row, u32)],
    ) -> Result<(), Trouble> {
        let diagnosis = self.ask_diagnosis(tried)?;
        let told = Told { diagnosis: &diagnosis };
        let models = told.models();
        let Some(product) = models.first().filter(|_| diagnosis.is_encoder()) else {
            return Ok(());
        };
        let model = product.encoder;
        let own = self.conversation.settings.address;
        if let Some(master) = diagnosis.master.filter(|master| *master != own) {
            self.standing = Standing::Locked { master, model };
            return match overrides {
                [] => Ok(()),
                _ => Err(self.locked_trouble(tried, master)),
            };
        }
        let mut chosen = Chosen::in_force(told, model);
        for (row, value) in overrides {
            chosen.set(row, *value);
        }
        let [_, two_words_and_preset, ..] = &configuration::ROWS;
        let configuration = settings.configuration.unwrap_or(two_words_and_preset);
        let served = Served { chosen, configuration, model, data_sheet: product.data_sheet };
        // It may be locked as soon as parameters are on their way.
        self.standing = Standing::Served(served);
        match self.bring_up(&served)? {
            BroughtUp::ExchangesData => Ok(()),
            BroughtUp::RefusedParameters => {
                let given =
                    overrides.iter().map(|(row, value)| refused_remedy(&served, row, *value));
                let remedy = given.collect::<Vec<_>>().join("; ");
                let came = "it refuses its parameters (Prm_Fault)";
                Err(Trouble::new(Kind::Refused, tried, came, remedy))
            }
            other => {
                if other == BroughtUp::BelongsToAnother {
                    // Then it is not for us to release it.
                    self.standing = Standing::Foreign;
                }
                Err(self.bring_up_trouble(tried, other))
            }
        }
    }

    /// Asks a slave for its diagnosis that this master does not serve. On a PC that is busy an answer
    /// may come after its slot, so silence is believed only after a while.
    fn ask_diagnosis(&mut self, tried: &str) -> Result<Diagnosis, Trouble> {
        let until = self.conversation.patience();
        let mut answer = self.conversation.ask(tried, self.address, Acyclic::Diagnosis)?;
        while answer == Answer::Silence && self.conversation.seat.now() < until {
            answer = self.conversation.ask(tried, self.address, Acyclic::Diagnosis)?;
        }
        match answer {
            Answer::Diagnosis(diagnosis) => Ok(diagnosis),
            Answer::Silence => Err(self.silence(tried)),
            _ => Err(Trouble::new(
                Kind::Refused,
                tried,
                "it gives no diagnosis",
                "a DP slave does: look with a scan what it is",
            )),
        }
    }

    fn silence(&mut self, tried: &str) -> Trouble {
        let rate = self.conversation.rate();
        Trouble::new(
            Kind::TimeOut,
            tried,
            format!("no answer at {rate}"),
            "look at its address switches, its supply, and termination; a scan tells who is there",
        )
    }

    fn locked_trouble(&mut self, tried: &str, master: u8) -> Trouble {
        let is_there = self.conversation.masters().contains(&master);
        let remedy = if is_there {
            format!("change it in the project of master {master}, or take that master off the bus")
        } else {
            format!(
                "master {master} was not heard: switch the encoder off and on, which makes it free"
            )
        };
        let came = format!("it belongs to master {master}");
        Trouble::new(Kind::Refused, tried, came, remedy)
    }

    fn bring_up_trouble(&mut self, tried: &str, why: BroughtUp) -> Trouble {
        let (came, remedy) = match why {
            BroughtUp::RefusedParameters => {
                ("it refuses its parameters (Prm_Fault)", "read its diagnosis")
            }
            BroughtUp::RefusedConfiguration => (
                "it refuses its configuration (Cfg_Fault)",
                "it takes D0h, D1h, F0h and F1h: choose another of them",
            ),
            BroughtUp::BelongsToAnother => {
                ("another master has taken it meanwhile", "a scan tells to whom it belongs")
            }
            BroughtUp::Silent | BroughtUp::ExchangesData => return self.silence(tried),
        };
        Trouble::new(Kind::Refused, tried, came, remedy)
    }

    /// Parameterizes and configures the slave, and waits for what comes of it.
    fn bring_up(&mut self, served: &Served) -> Result<BroughtUp, Trouble> {
        self.take_events();
        let address = self.address;
        let settings = served.chosen.slave(address, served.configuration);
        let until = self.conversation.patience();
        if let Some(master) = self.conversation.console().master_mut()
            && let Err(error) = master.serve(settings)
        {
            let tried = format!("serve the slave at address {address}");
            return Err(Trouble::new(Kind::Usage, tried, error.to_string(), ""));
        }
        let came = self.conversation.wait(until, |console, _| {
            let event = console.master_mut()?.take_event()?;
            match event {
                Event::Configured { address: of } if of == address => {
                    Some(BroughtUp::ExchangesData)
                }
                Event::ParameterError { address: of } if of == address => {
                    Some(BroughtUp::RefusedParameters)
                }
                Event::ConfigurationError { address: of } if of == address => {
                    Some(BroughtUp::RefusedConfiguration)
                }
                Event::Refused { address: of, .. } if of == address => {
                    Some(BroughtUp::BelongsToAnother)
                }
                _ => None,
            }
        })?;
        if came != Some(BroughtUp::ExchangesData) {
            return Ok(came.unwrap_or(BroughtUp::Silent));
        }
        let exchanges = self.conversation.wait(until, |console, _| {
            let slave = console.master()?.slave(address)?;
            (slave.state == SlaveState::DataExchange).then_some(BroughtUp::ExchangesData)
        })?;
        Ok(exchanges.unwrap_or(BroughtUp::Silent))
    }

    /// Ends the service of the slave, if it is served, and unlocks it for its own master.
    fn let_go(&mut self, tried: &str) -> Result<(), Trouble> {
        let address = self.address;
        let Some(master) = self.conversation.console().master_mut() else { return Ok(()) };
        let is_served = master.slave(address).is_some();
        master.stop();
        if is_served {
            self.conversation.ask(tried, address, Acyclic::Unlock)?;
        }
        Ok(())
    }

    /// Makes notices of what the master tells.
    fn take_events(&mut self) {
        while let Some(event) =
            self.conversation.console().master_mut().and_then(super::Master::take_event)
        {
            if event.is_trouble() {
                self.conversation.note(event.to_string());
            }
        }
    }
}

/// Whether a master may come to this bus.
fn may_speak<S: Seat<Station = Console>>(
    conversation: &mut Conversation<S>,
    tried: &str,
    address: u8,
    progress: &mut dyn FnMut(Progress),
) -> Result<(), Trouble> {
    if let Some(trouble) = conversation.gibberish_trouble(tried) {
        return Err(trouble);
    }
    conversation.listen_for_a_token(progress)?;
    let masters = conversation.masters();
    if !masters.is_empty() && !conversation.settings.join {
        let are = conversation.masters_in_words();
        let heard = conversation.console().overheard().slave(address);
        let came = match heard.and_then(|slave| slave.exchange.as_ref()) {
            Some(exchange) => format!("{are}, and {} exchanges data with it", exchange.master),
            None => are,
        };
        let remedy = if conversation.is_ring_heard() {
            "watch without a word, or take turns with the others: join the ring (--join)".to_owned()
        } else {
            format!("watch without a word: {}, so nobody can take turns", conversation.no_token())
        };
        return Err(Trouble::new(Kind::Bus, tried, came, remedy));
    }
    if let Some(trouble) = conversation.ring_trouble(tried) {
        return Err(trouble);
    }
    match conversation.address_trouble(tried) {
        Some(trouble) => Err(trouble),
        None => Ok(()),
    }
}

/// The rows and numbers of parameters that were given by their names.
fn overrides(
    tried: &str,
    given: &[(String, Reading)],
) -> Result<Vec<(&'static Row, u32)>, Trouble> {
    let number = |(key, reading): &(String, Reading)| {
        let row = Row::find(key).ok_or_else(|| no_parameter(tried, key))?;
        let number = number_for(row, reading).map_err(|remedy| {
            let came = format!("{key} cannot be {}", told(reading));
            Trouble::new(Kind::Usage, tried, came, remedy)
        })?;
        Ok((row, number))
    };
    given.iter().map(number).collect()
}

fn no_parameter(tried: &str, key: &str) -> Trouble {
    let keys = codewheel_device::profibus::parameters::ROWS.map(|row| row.key).join(", ");
    let came = format!("{key} is no parameter of Set_Prm");
    Trouble::new(Kind::Usage, tried, came, format!("these are: {keys}"))
}

/// A reading as people write it.
fn told(reading: &Reading) -> String {
    match reading {
        Reading::Number(number) => number.to_string(),
        Reading::Real(real) => real.to_string(),
        Reading::Text(text) => text.clone(),
        Reading::Octets(octets) => {
            octets.iter().map(|octet| format!("{octet:02X}")).collect::<Vec<_>>().join(" ")
        }
    }
}

/// What a refused parameter takes, how a GSD file writes what was given, and what else is in its way.
fn refused_remedy(served: &Served, row: &Row, value: u32) -> String {
    let Served { chosen, model, .. } = served;
    let smallest = *(row.range)(*model).start();
    let mut remedy = format!("{} takes {smallest} to {}", row.key, chosen.largest(row, *model));
    if let Some([high, low]) = row.words(*model) {
        remedy.push_str(&format!(
            "; a GSD file writes {value} as {} {}, {} {}",
            high.name,
            value >> 16,
            low.name,
            value & 0xFFFF
        ));
    }
    let (total, largest) =
        (chosen.value(&TOTAL_RESOLUTION), chosen.largest(&TOTAL_RESOLUTION, *model));
    if row.key != TOTAL_RESOLUTION.key && total > largest {
        remedy.push_str(&format!(
            "; beside it {} {total} is too much: write that first, at most {largest}",
            TOTAL_RESOLUTION.key
        ));
    }
    remedy
}

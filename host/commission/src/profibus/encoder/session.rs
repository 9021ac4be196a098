//! The session: the words that are the same on both buses.

use codewheel_device::product::Bus;
use codewheel_device::profibus::parameters::{ROWS, Row};
use codewheel_station::Instant;

use super::{BroughtUp, Encoder, Served, Standing, no_parameter, refused_remedy, told};
use crate::profibus::chosen::number_for;
use crate::profibus::eavesdropper::{cycles, position, sample_of};
use crate::profibus::identity::Told;
use crate::profibus::values::{Known, for_the_project, raw_value, raw_values};
use crate::profibus::{Console, Diagnosis, Event, SlaveState};
use crate::{Identity, Kind, Name, Reading, Sample, Seat, Session, Trouble, Value};

impl<S: Seat<Station = Console>> Encoder<S> {
    /// The diagnosis as it is now.
    pub(super) fn read_diagnosis(&mut self, tried: &str) -> Result<Diagnosis, Trouble> {
        match self.standing {
            Standing::Served(_) => {}
            Standing::Released => return Err(self.not_served(tried)),
            Standing::Locked { .. } | Standing::Foreign => return self.ask_diagnosis(tried),
        }
        self.take_events();
        let address = self.address;
        let until = self.conversation.patience();
        if let Some(master) = self.conversation.console().master_mut() {
            // It is in the list.
            let _ = master.request_diagnosis(address);
        }
        let read = self.conversation.wait(until, |console, _| {
            let master = console.master_mut()?;
            let event = master.take_event()?;
            if event != (Event::Diagnosis { address }) {
                return None;
            }
            master.slave(address)?.diagnosis.cloned()
        })?;
        read.ok_or_else(|| self.silence(tried))
    }

    /// Why something is only possible while our master serves the slave.
    pub(super) fn not_served(&mut self, tried: &str) -> Trouble {
        match self.standing {
            Standing::Locked { master, .. } => self.locked_trouble(tried, master),
            Standing::Released => Trouble::new(
                Kind::Usage,
                tried,
                "the session is over: the encoder was released",
                "open another one",
            ),
            Standing::Foreign | Standing::Served(_) => Trouble::new(
                Kind::Refused,
                tried,
                "the slave is no encoder of ours, and nobody knows its parameters",
                "its GSD file and a configuration tool of its vendor know them",
            ),
        }
    }

    fn doing(&self, what: &str) -> String {
        format!("{what} the encoder at address {}", self.address)
    }

    /// Looks up the row of a parameter.
    fn parameter(&self, tried: &str, name: &Name) -> Result<&'static Row, Trouble> {
        let key = match name {
            Name::Key(key) => key.as_str(),
            Name::Octet(octet) => {
                let came = format!("octet {octet} of Slave_Diag is what the slave tells");
                let keys = ROWS.map(|row| row.key).join(", ");
                let remedy = format!("these can be written: {keys}");
                return Err(Trouble::new(Kind::Usage, tried, came, remedy));
            }
            Name::Path { .. } | Name::Parameter(_) => return Err(no_paths(tried)),
        };
        if key == "position" {
            let came = "a position is not written";
            let remedy = "preset gives the shaft another position";
            return Err(Trouble::new(Kind::Usage, tried, came, remedy));
        }
        Row::find(key).ok_or_else(|| no_parameter(tried, key))
    }

    /// Sends other parameters; those of before where the encoder does not take them.
    fn parameterize(
        &mut self,
        tried: &str,
        served: &Served,
        row: &Row,
        value: u32,
    ) -> Result<(), Trouble> {
        let mut wanted = *served;
        wanted.chosen.set(row, value);
        let came = self.bring_up(&wanted)?;
        if came == BroughtUp::ExchangesData {
            self.standing = Standing::Served(wanted);
            return Ok(());
        }
        if came != BroughtUp::RefusedParameters {
            return Err(self.bring_up_trouble(tried, came));
        }
        let remedy = refused_remedy(&wanted, row, value);
        let back = self.bring_up(served)?;
        let came = match back {
            BroughtUp::ExchangesData => "it refuses that (Prm_Fault); it has its old ones again",
            _ => "it refuses that (Prm_Fault), and then its old ones too",
        };
        Err(Trouble::new(Kind::Refused, tried, came, remedy))
    }
}

fn no_paths(tried: &str) -> Trouble {
    Trouble::new(
        Kind::Usage,
        tried,
        "PROFIBUS has no classes and no Parameter object",
        "name a key, or octet/N for an octet of Slave_Diag",
    )
}

impl<S: Seat<Station = Console>> Session for Encoder<S> {
    fn bus(&self) -> Bus {
        Bus::Profibus
    }

    fn address(&self) -> u8 {
        self.address
    }

    fn now(&self) -> Instant {
        self.conversation.seat.now()
    }

    fn identify(&mut self) -> Result<Identity, Trouble> {
        let tried = self.doing("identify");
        Ok(self.read_diagnosis(&tried)?.identity())
    }

    fn values(&mut self) -> Result<Vec<Value>, Trouble> {
        let tried = self.doing("read");
        let diagnosis = self.read_diagnosis(&tried)?;
        let address = self.address;
        let standing = self.standing.clone();
        let known = match &standing {
            Standing::Foreign | Standing::Released => return Ok(raw_values(&diagnosis)),
            Standing::Served(served) => Known {
                diagnosis: &diagnosis,
                model: served.model,
                chosen: Some(&served.chosen),
                configuration: Some(served.configuration),
                position: self.served_position(),
            },
            Standing::Locked { model, .. } => {
                let heard = self.conversation.console().overheard().slave(address);
                let sample = heard.and_then(sample_of);
                Known {
                    diagnosis: &diagnosis,
                    model: *model,
                    chosen: None,
                    configuration: None,
                    position: sample.map(|sample| sample.position),
                }
            }
        };
        Ok(known.values())
    }

    fn value(&mut self, name: &Name) -> Result<Value, Trouble> {
        let tried = self.doing("read");
        let key = match name {
            Name::Key(key) => key,
            Name::Path { .. } | Name::Parameter(_) => return Err(no_paths(&tried)),
            Name::Octet(number) => {
                let octets = self.read_diagnosis(&tried)?.octets();
                let octet = usize::from(*number).checked_sub(1).and_then(|at| octets.get(at));
                return octet.map(|octet| raw_value(*number, *octet)).ok_or_else(|| {
                    let came = format!("its diagnosis has octets 1 to {}", octets.len());
                    Trouble::new(Kind::Usage, tried, came, "")
                });
            }
        };
        let values = self.values()?;
        let names = values.iter().map(|value| value.name.as_str()).collect::<Vec<_>>().join(", ");
        values.into_iter().find(|value| value.name == *key).ok_or_else(|| {
            let came = format!("it tells nothing called {key}");
            Trouble::new(Kind::Usage, tried, came, format!("it tells {names}"))
        })
    }

    fn write(&mut self, name: &Name, reading: &Reading) -> Result<Value, Trouble> {
        let tried = match name {
            Name::Key(key) => self.doing(&format!("write {key} {} of", told(reading))),
            _ => self.doing("write to"),
        };
        let row = self.parameter(&tried, name)?;
        let value = number_for(row, reading).map_err(|remedy| {
            let came = format!("{} cannot be {}", row.key, told(reading));
            Trouble::new(Kind::Usage, tried.as_str(), came, remedy)
        })?;
        let served = match &self.standing {
            Standing::Served(served) => *served,
            _ => return Err(self.not_served(&tried)),
        };
        self.parameterize(&tried, &served, row, value)?;
        self.value(&Name::Key(row.key.to_owned()))
    }

    fn preset(&mut self, position: u32) -> Result<Sample, Trouble> {
        self.strike(position)
    }

    fn save(&mut self) -> Result<(), Trouble> {
        Err(self.unknown_service("save", "the offset of a preset is kept at once"))
    }

    fn restore(&mut self) -> Result<(), Trouble> {
        Err(self.unknown_service("restore", "its master sends parameters at each start"))
    }

    fn reset(&mut self) -> Result<(), Trouble> {
        Err(self.unknown_service("reset", "write the values that it shall have"))
    }

    fn sample(&mut self) -> Result<Sample, Trouble> {
        let tried = self.doing("read the position of");
        if matches!(self.standing, Standing::Foreign | Standing::Released) {
            return Err(self.not_served(&tried));
        }
        let (address, last) = (self.address, self.sampled);
        let is_served = matches!(self.standing, Standing::Served(_));
        let console = self.conversation.console();
        let cycles = match console.master().filter(|_| is_served) {
            Some(master) => master.cycle_times(),
            None => cycles(console.overheard(), address),
        };
        let until = self.conversation.silence(cycles.mean());
        let newer = |console: &mut Console, _| {
            let sample = if is_served {
                let slave = console.master()?.slave(address)?;
                if slave.state != SlaveState::DataExchange {
                    return None;
                }
                let told = slave.diagnosis.map(|diagnosis| Told { diagnosis });
                let cycles = console.master()?.cycle_times();
                Sample {
                    at: slave.input_at?,
                    position: position(slave.inputs)?,
                    alarm: told.and_then(Told::alarm),
                    warning: told.and_then(Told::warning),
                    cycle: (cycles.count > 0).then(|| cycles.last.as_nanos()),
                }
            } else {
                sample_of(console.overheard().slave(address)?)?
            };
            (sample.at > last).then_some(sample)
        };
        let Some(sample) = self.conversation.wait(until, newer)? else {
            return Err(self.silence(&tried));
        };
        self.sampled = sample.at;
        Ok(sample)
    }

    fn release(&mut self) -> Result<(), Trouble> {
        let tried = self.doing("release");
        let standing = std::mem::replace(&mut self.standing, Standing::Released);
        if let Standing::Served(served) = standing {
            // One that is gone needs no release.
            let _ = self.zero(served.configuration);
            self.let_go(&tried)?;
        }
        self.take_events();
        self.conversation.leave()
    }

    fn take_notices(&mut self) -> Vec<String> {
        self.take_events();
        self.conversation.take_notices()
    }
}

impl<S: Seat<Station = Console>> Encoder<S> {
    fn unknown_service(&mut self, what: &str, instead: &str) -> Trouble {
        let tried = self.doing(what);
        let remedy = match &self.standing {
            Standing::Served(served) => {
                let project = for_the_project(&served.chosen, served.data_sheet);
                format!("{instead}; {project}")
            }
            _ => instead.to_owned(),
        };
        let came = format!("PROFIBUS has no service to {what}");
        Trouble::new(Kind::Refused, tried, came, remedy)
    }
}

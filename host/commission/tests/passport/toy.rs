//! A session with the core of an encoder behind it and no bus between: what it says of itself comes
//! from the rows of its product.

use std::time::{Duration as Span, SystemTime};

use codewheel_commission::passport::{self, Circumstances, Passport, Plan, Report};
use codewheel_commission::{Identity, Kind, Name, Reading, Sample, Session, Trouble, Value};
use codewheel_device::Product;
use codewheel_device::devicenet::rows;
use codewheel_device::product::Bus;
use codewheel_device::profibus::{IDENT_NUMBER, diagnosis, parameters};
use codewheel_encoder::{Block, Encoder};
use codewheel_station::{Duration, Instant};

/// So much time passes between two samples.
const CYCLE: Duration = Duration::from_millis(10);

/// An encoder on a machine.
pub(crate) struct Toy {
    product: &'static Product,
    encoder: Encoder,
    saved: Block,
    pub(crate) serial: u32,
    pub(crate) revision: (u8, u8),
    /// The code where the machine stands.
    code: u32,
    /// How far the code moves in each cycle.
    pub(crate) speed: i64,
    /// It stands on an edge: now and then it is seen a step further.
    pub(crate) trembles: bool,
    cycles: u64,
    now: Instant,
    /// Set_Prm from octet 8 on.
    user: Vec<u8>,
    /// So many more writes succeed.
    pub(crate) writes_left: usize,
    /// What was written, in this order.
    pub(crate) written: Vec<String>,
    /// A device that takes a write and does nothing.
    pub(crate) deaf: bool,
}

pub(crate) fn product(model: &str) -> &'static Product {
    Product::find(model).expect("a model of the catalogue")
}

pub(crate) fn circumstances() -> Circumstances {
    let when = SystemTime::UNIX_EPOCH + Span::from_secs(1_800_000_000);
    Circumstances::new(when, "codewheel test")
}

pub(crate) fn key(name: &str) -> Name {
    Name::Key(name.to_owned())
}

/// A new encoder, mounted so that its code is `code` where the machine stands.
pub(crate) fn new(model: &str, serial: u32, code: u32) -> Toy {
    let product = product(model);
    let encoder = Encoder::with_defaults(product.encoder);
    let mut toy = Toy {
        product,
        saved: encoder.block(),
        encoder,
        serial,
        revision: (1, 1),
        code,
        speed: 0,
        trembles: false,
        cycles: 0,
        now: Instant::ZERO,
        user: parameters::default_octets(product.encoder).to_vec(),
        writes_left: usize::MAX,
        written: Vec::new(),
        deaf: false,
    };
    toy.measure();
    toy
}

impl Toy {
    /// Settings in this order.
    pub(crate) fn with(mut self, settings: &[(&str, i64)]) -> Self {
        for (name, value) in settings {
            self.write(&key(name), &Reading::Number(*value)).expect("a legal setting");
        }
        self
    }

    pub(crate) fn preset_at(mut self, position: u32) -> Self {
        self.preset(position).expect("a legal preset");
        self
    }

    pub(crate) fn saved(mut self) -> Self {
        self.saved = self.encoder.block();
        self
    }

    /// Turns the machine, in codes.
    pub(crate) fn turn(&mut self, codes: i64) {
        let range = i64::from(self.product.encoder.geometry.range());
        self.code = (i64::from(self.code) + codes).rem_euclid(range) as u32;
        self.measure();
    }

    pub(crate) fn position(&self) -> u32 {
        self.encoder.position()
    }

    pub(crate) fn offset(&self) -> i32 {
        self.encoder.offset()
    }

    pub(crate) fn take(&mut self) -> Passport {
        passport::take(self, &circumstances()).expect("a passport")
    }

    pub(crate) fn plan(&mut self, passport: &Passport, at: Option<u32>) -> Result<Plan, Trouble> {
        passport::plan(passport, self, &circumstances(), at)
    }

    pub(crate) fn apply(&mut self, passport: &Passport, at: Option<u32>) -> Report {
        let plan = self.plan(passport, at).expect("a plan");
        plan.carry_out(self, &circumstances(), &mut |_| ())
    }

    /// One cycle of the machine.
    fn pass(&mut self) {
        self.cycles += 1;
        let trembles = self.trembles && self.cycles.is_multiple_of(7);
        self.turn(self.speed + i64::from(trembles));
        if trembles {
            self.code -= 1;
        }
    }

    fn measure(&mut self) {
        self.now += CYCLE;
        let sample = codewheel_encoder::Sample { code: self.code, ..Default::default() };
        self.encoder.sample(self.now, sample);
    }

    fn refuse(came: &str) -> Trouble {
        Trouble::new(Kind::Refused, "ask a toy", came, "")
    }

    fn row(&self, row: &'static rows::Row) -> Value {
        let view = rows::View { product: self.product, encoder: &self.encoder };
        let reading = match (row.read)(view) {
            rows::Value::Number(number) => Reading::Number(number),
            rows::Value::Octets(octets) => Reading::Octets(octets.to_vec()),
        };
        let label = match reading {
            Reading::Number(number) => {
                row.values.get(number as usize).map(|name| (*name).to_owned())
            }
            _ => None,
        };
        Value {
            name: row.key.to_owned(),
            place: String::new(),
            title: row.name.to_owned(),
            reading,
            label,
            unit: row.unit.to_owned(),
            writable: row.write.is_some(),
            setting: row.source == rows::Source::Parameter,
            range: row.range.map(|range| {
                let range = range(view);
                (range.minimum, range.maximum)
            }),
            help: row.help.to_owned(),
        }
    }

    fn parameter(&self, row: &'static parameters::Row) -> Value {
        let number = row.read(&self.user).expect("all octets");
        let range = (row.range)(self.product.encoder);
        Value {
            name: row.key.to_owned(),
            place: String::new(),
            title: row.name.to_owned(),
            reading: Reading::Number(number.into()),
            label: row.values.get(number as usize).map(|name| (*name).to_owned()),
            unit: row.unit.to_owned(),
            writable: true,
            setting: true,
            range: Some(((*range.start()).into(), (*range.end()).into())),
            help: row.help.to_owned(),
        }
    }

    fn diagnosis(&self, row: &'static diagnosis::Row) -> Value {
        let view = diagnosis::View {
            product: self.product,
            encoder: &self.encoder,
            class: 2,
            alarm: false,
        };
        Value {
            name: row.key.to_owned(),
            place: String::new(),
            title: row.name.to_owned(),
            reading: match (row.read)(&view) {
                diagnosis::Value::Number(number) => Reading::Number(number),
                diagnosis::Value::Octets(octets) => Reading::Octets(octets.to_vec()),
            },
            label: None,
            unit: row.unit.to_owned(),
            writable: false,
            setting: false,
            range: None,
            help: row.help.to_owned(),
        }
    }

    fn put(&mut self, name: &str, number: i64) -> Result<(), Trouble> {
        if let Bus::DeviceNet = self.product.bus {
            let row = rows::ROWS.iter().find(|row| row.key == name).expect("a row");
            let write = row.write.ok_or_else(|| Self::refuse("0E (attribute not settable)"))?;
            let written = write(&mut self.encoder, number);
            return written.map(|_| ()).map_err(|refusal| Self::refuse(&refusal.to_string()));
        }
        let row = parameters::Row::find(name).expect("a parameter");
        let mut user = self.user.clone();
        row.write(u32::try_from(number).expect("a parameter has 32 bits"), &mut user);
        let taken = parameters::Parameters::read(self.product.encoder, &user);
        let taken = taken.map_err(|refusal| Self::refuse(&format!("Prm_Fault: {refusal:?}")))?;
        self.encoder.apply(taken.settings).expect("they were judged");
        self.user = user;
        Ok(())
    }
}

impl Session for Toy {
    fn bus(&self) -> Bus {
        self.product.bus
    }

    fn address(&self) -> u8 {
        5
    }

    fn now(&self) -> Instant {
        self.now
    }

    fn identify(&mut self) -> Result<Identity, Trouble> {
        let product = self.product;
        let same = |other: &&'static Product| {
            other.bus == product.bus && other.encoder.geometry == product.encoder.geometry
        };
        Ok(match product.bus {
            Bus::DeviceNet => Identity {
                vendor: Some(468),
                device_type: Some(0),
                product_code: product.product_code(),
                revision: Some(self.revision),
                serial: Some(self.serial),
                product_name: Some(product.product_name.to_owned()),
                firmware: Some("1.01".to_owned()),
                models: vec![product],
            },
            Bus::Profibus => Identity {
                product_code: IDENT_NUMBER,
                models: Product::all().filter(same).collect(),
                ..Identity::default()
            },
        })
    }

    fn values(&mut self) -> Result<Vec<Value>, Trouble> {
        self.measure();
        Ok(match self.product.bus {
            Bus::DeviceNet => rows::ROWS.iter().map(|row| self.row(row)).collect(),
            Bus::Profibus => {
                let parameters = parameters::ROWS.into_iter().map(|row| self.parameter(row));
                let diagnosis = diagnosis::ROWS.iter().map(|row| self.diagnosis(row));
                parameters.chain(diagnosis).collect()
            }
        })
    }

    fn value(&mut self, name: &Name) -> Result<Value, Trouble> {
        let Name::Key(key) = name else { panic!("a toy knows keys") };
        let values = self.values()?;
        let found = values.into_iter().find(|value| value.name == *key);
        found.ok_or_else(|| Trouble::new(Kind::Usage, "ask a toy", "no such name", ""))
    }

    fn write(&mut self, name: &Name, reading: &Reading) -> Result<Value, Trouble> {
        let (Name::Key(key), Reading::Number(number)) = (name, reading) else {
            panic!("a toy knows keys and numbers")
        };
        self.writes_left = self.writes_left.checked_sub(1).ok_or_else(|| {
            Trouble::new(Kind::TimeOut, "write", "no answer", "see that it has power")
        })?;
        if !self.deaf {
            self.put(key, *number)?;
        }
        self.written.push(key.clone());
        self.value(name)
    }

    fn preset(&mut self, position: u32) -> Result<Sample, Trouble> {
        self.pass();
        let made = self.encoder.set_preset(position);
        made.map_err(|refusal| Self::refuse(&refusal.to_string()))?;
        self.written.push("preset".to_owned());
        self.sample()
    }

    fn save(&mut self) -> Result<(), Trouble> {
        if self.product.bus == Bus::Profibus {
            return Err(Self::refuse("PROFIBUS knows no Save"));
        }
        self.saved = self.encoder.block();
        self.written.push("save".to_owned());
        Ok(())
    }

    fn restore(&mut self) -> Result<(), Trouble> {
        self.encoder.load(self.saved).map_err(|refusal| Self::refuse(&refusal.to_string()))
    }

    fn reset(&mut self) -> Result<(), Trouble> {
        let defaults = self.encoder.default_block();
        self.encoder.load(defaults).map_err(|refusal| Self::refuse(&refusal.to_string()))
    }

    fn sample(&mut self) -> Result<Sample, Trouble> {
        self.pass();
        let position = self.position();
        Ok(Sample { at: self.now, position, alarm: None, warning: None, cycle: None })
    }

    fn release(&mut self) -> Result<(), Trouble> {
        Ok(())
    }

    fn take_notices(&mut self) -> Vec<String> {
        Vec::new()
    }
}

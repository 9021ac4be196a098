//! A segment: encoders and masters on one wire.

use codewheel_commission::profibus::{Master, MasterSettings, SlaveSettings, SlaveState};
use codewheel_device::profibus::{Factory, IDENT_NUMBER, Switches};
use codewheel_device::{Product, ProfibusEncoder};
use codewheel_encoder::Start;
use codewheel_profibus::{Baud, Timing};
use codewheel_sim::Either;
use codewheel_sim::rs485::{Attachment, Event, Faults, Hearing, NodeId, Wire};
use codewheel_sim::shaft::Shaft;
use codewheel_station::rs485::BaudRate;
use codewheel_station::{Duration, Instant};

pub(crate) type Encoder = ProfibusEncoder<Shaft>;

/// The address of the master.
pub(crate) const MASTER: u8 = 2;

/// What a master sends to one encoder, octet by octet as the manual has it (§6.1, §6.2), and not as
/// our tables write it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    pub(crate) address: u8,
    pub(crate) class_2: bool,
    /// D0h, D1h, F0h or F1h.
    pub(crate) configuration: u8,
    pub(crate) steps_per_turn: u32,
    pub(crate) total_resolution: u32,
}

impl Wanted {
    pub(crate) fn settings(self) -> SlaveSettings {
        let mut user_parameters = vec![0x00, if self.class_2 { 0x0A } else { 0x00 }];
        if self.class_2 {
            user_parameters.extend(self.steps_per_turn.to_be_bytes());
            user_parameters.extend(self.total_resolution.to_be_bytes());
        }
        SlaveSettings {
            address: self.address,
            ident_number: IDENT_NUMBER,
            user_parameters,
            configuration: vec![self.configuration],
            inputs: self.octets(),
            outputs: if self.configuration & 0x20 == 0 { 0 } else { self.octets() },
            ..SlaveSettings::default()
        }
    }

    /// Octets of the position.
    pub(crate) const fn octets(self) -> usize {
        if self.configuration & 0x01 == 0 { 2 } else { 4 }
    }
}

/// An encoder that rests at `angle`, switched on now.
pub(crate) fn encoder(
    now: Instant,
    product: &'static Product,
    address: u8,
    shaft: &str,
    baud: Baud,
) -> Encoder {
    let geometry = product.encoder.geometry;
    let (steps, turns) = (geometry.singleturn_resolution(), geometry.revolutions());
    let shaft = Shaft::parse(shaft, steps, turns).expect("a shaft");
    let factory = Factory { model: product.encoder, serial: 1, baud, timing: Timing::Exact };
    let start = Start::Fresh { interrupted: false };
    Encoder::power_up(now, product, factory, Switches::set_to(address), &start, shaft)
}

/// Encoders and masters on one wire.
pub(crate) struct Segment {
    pub(crate) wire: Wire<Either<Master, Encoder>>,
    masters: Vec<NodeId>,
    encoders: Vec<(u8, NodeId)>,
    /// What the wire complained of.
    pub(crate) complaints: Vec<String>,
}

impl Segment {
    pub(crate) fn new() -> Self {
        let wire = Wire::new(1);
        Self { wire, masters: Vec::new(), encoders: Vec::new(), complaints: Vec::new() }
    }

    pub(crate) fn set_faults(&mut self, faults: Faults) {
        self.wire.set_faults(faults);
    }

    pub(crate) fn attach_encoder(&mut self, address: u8, encoder: Encoder) {
        let name = format!("encoder {address}");
        // A slave does not look at how far a telegram has come.
        let attachment = Attachment { hearing: Hearing::Telegrams, ..Attachment::default() };
        let id = self.wire.attach(name, Either::Right(encoder), attachment);
        self.encoders.push((address, id));
    }

    pub(crate) fn attach_master(&mut self, settings: MasterSettings, wanted: &[Wanted]) {
        let name = format!("master {}", settings.address);
        let slaves = wanted.iter().map(|wanted| wanted.settings()).collect();
        let master = Master::new(settings, slaves).expect("settings of a master");
        self.masters.push(self.wire.attach(name, Either::Left(master), Attachment::default()));
    }

    /// Takes the first master away, as if it had been unplugged.
    pub(crate) fn detach_master(&mut self) {
        let id = self.masters.remove(0);
        self.wire.detach(id);
    }

    pub(crate) fn master(&self) -> &Master {
        let master = self.wire.node(self.masters[0]);
        master.and_then(Either::left).expect("a master")
    }

    pub(crate) fn master_mut(&mut self) -> &mut Master {
        let master = self.wire.node_mut(self.masters[0]);
        master.and_then(Either::left_mut).expect("a master")
    }

    pub(crate) fn encoder(&self, address: u8) -> &Encoder {
        let (_, id) = self.encoders.iter().find(|(of, _)| *of == address).expect("an encoder");
        self.wire.node(*id).and_then(Either::right).expect("an encoder")
    }

    pub(crate) fn addresses(&self) -> Vec<u8> {
        self.encoders.iter().map(|(address, _)| *address).collect()
    }

    pub(crate) fn run(&mut self, span: Duration) {
        let until = self.wire.now() + span;
        let complaints = &mut self.complaints;
        self.wire.run_until(until, &mut |event| {
            if matches!(event, Event::Violation { .. } | Event::Collision { .. }) {
                complaints.push(event.to_string());
            }
        });
    }

    /// Runs until `condition`, in steps of `step`; false when `limit` passes without.
    pub(crate) fn run_till(
        &mut self,
        limit: Duration,
        step: Duration,
        condition: impl Fn(&Self) -> bool,
    ) -> bool {
        let end = self.wire.now() + limit;
        while self.wire.now() < end {
            if condition(self) {
                return true;
            }
            self.run(step);
        }
        condition(self)
    }

    /// Whether the master exchanges data with all encoders and got each position at least so often.
    pub(crate) fn all_exchange(&self, answers: u64) -> bool {
        self.addresses().iter().all(|address| {
            self.master().slave(*address).is_some_and(|slave| {
                slave.state == SlaveState::DataExchange && slave.answers >= answers
            })
        })
    }

    /// Fails where the wire complained.
    pub(crate) fn expect_peace(&self) {
        assert_eq!(self.complaints, [""; 0], "the wire names offenders");
    }
}

/// A span that holds some exchanges with a segment full of encoders.
pub(crate) fn some_cycles(rate: BaudRate) -> Duration {
    rate.bits(40_000)
}

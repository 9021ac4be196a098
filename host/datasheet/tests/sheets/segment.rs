//! A PROFIBUS segment in virtual time: profirust as master, one encoder as slave.

use codewheel_commission::profibus::{
    Diagnosis, Master, MasterSettings, SlaveSettings, SlaveState,
};
use codewheel_device::profibus::{Factory, Switches};
use codewheel_device::{Product, ProfibusEncoder};
use codewheel_encoder::{Sample, Sensor, Settings, choose};
use codewheel_profibus::{Baud, Timing};
use codewheel_sim::Either;
use codewheel_sim::rs485::{Attachment, Event, Hearing, NodeId, Wire};
use codewheel_station::rs485::BaudRate;
use codewheel_station::{Duration, Instant};
use gsd_parser::{GenericStationDescription, Module};

/// A shaft that stands.
#[derive(Clone, Debug)]
pub(crate) struct Standing {
    code: u32,
}

impl Sensor for Standing {
    fn sample(&mut self, _: Instant) -> Sample {
        Sample { code: self.code, ..Sample::default() }
    }
    fn changes_at(&self, _: Instant) -> Option<Instant> {
        None
    }
}

const MASTER: u8 = 2;
const SLAVE: u8 = 7;
/// Where the shaft stands, within every disc.
pub(crate) const CODE: u32 = 5_000;

/// What a segment is made of.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    product: &'static Product,
    rate: BaudRate,
    /// Whether the slave must find the rate.
    searches: bool,
    settings: SlaveSettings,
}

/// How a segment came out.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub(crate) state: SlaveState,
    pub(crate) inputs: Vec<u8>,
    /// What the slave has in force.
    pub(crate) in_force: Settings,
    pub(crate) class_2: bool,
    pub(crate) diagnosis: Diagnosis,
}

impl Plan {
    /// A slave of `product` as a configuration tool describes it to its master, from what the file
    /// says and these octets of Set_Prm from 8 on.
    pub(crate) fn of(
        product: &'static Product,
        gsd: &GenericStationDescription,
        module: &Module,
        user_parameters: &[u8],
    ) -> Self {
        let (inputs, outputs) = lengths(&module.config);
        Self {
            product,
            rate: BaudRate::Mbit1_5,
            searches: false,
            settings: SlaveSettings {
                address: SLAVE,
                ident_number: gsd.ident_number,
                user_parameters: user_parameters.to_vec(),
                configuration: module.config.clone(),
                inputs,
                outputs,
                groups: 0,
                sync: gsd.sync_mode_supported,
                freeze: gsd.freeze_mode_supported,
            },
        }
    }

    /// The same at another rate, which the slave must find.
    pub(crate) fn searching_at(self, rate: BaudRate) -> Self {
        Self { rate, searches: true, ..self }
    }

    /// Runs until the slave exchanges data or reports a fault.
    pub(crate) fn run(&self) -> Outcome {
        let mut wire = Wire::new(1);
        let attachment = Attachment { hearing: Hearing::Telegrams, ..Attachment::default() };
        let slave = wire.attach("slave", Either::Left(self.slave()), attachment);
        let settings = MasterSettings::new(MASTER, self.rate);
        let master = Master::new(settings, vec![self.settings.clone()]).expect("good settings");
        let master = wire.attach("master", Either::Right(master), attachment);
        let mut seen = Vec::new();
        for _ in 0..4_000 {
            let until = wire.now() + Duration::from_millis(5);
            wire.run_until(until, &mut |event| {
                if let Event::Violation { .. } = event {
                    seen.push(event.to_string());
                }
            });
            assert!(seen.is_empty(), "{seen:#?}");
            if let Some(outcome) = outcome(&wire, slave, master) {
                return outcome;
            }
        }
        panic!("{} came to nothing at {}", self.product.model, self.rate);
    }

    fn slave(&self) -> ProfibusEncoder<Standing> {
        let baud = if self.searches { Baud::Search } else { Baud::Fixed(self.rate) };
        let factory =
            Factory { model: self.product.encoder, serial: 1, baud, timing: Timing::Exact };
        ProfibusEncoder::power_up(
            Instant::ZERO,
            self.product,
            factory,
            Switches::set_to(SLAVE),
            &choose(&[], &[]),
            Standing { code: CODE },
        )
    }
}

type Segment = Wire<Either<ProfibusEncoder<Standing>, Master>>;

fn outcome(wire: &Segment, slave: NodeId, master: NodeId) -> Option<Outcome> {
    let view = wire.node(master)?.right()?.slave(SLAVE)?;
    if !matches!(
        view.state,
        SlaveState::DataExchange | SlaveState::ParameterError | SlaveState::ConfigurationError
    ) {
        return None;
    }
    let device = wire.node(slave)?.left()?;
    Some(Outcome {
        state: view.state,
        inputs: view.inputs.to_vec(),
        in_force: device.encoder().settings(),
        class_2: device.snapshot(wire.now()).profibus()?.class_2,
        diagnosis: view.diagnosis?.clone(),
    })
}

/// The octets of inputs and outputs that identifiers ask for (EN 50170-2: bit 4 inputs, bit 5
/// outputs, bit 6 words, the low nibble the length less one).
pub(crate) fn lengths(identifiers: &[u8]) -> (usize, usize) {
    identifiers.iter().fold((0, 0), |(inputs, outputs), identifier| {
        let width = if identifier & 0x40 == 0 { 1 } else { 2 };
        let octets = usize::from((identifier & 0x0F) + 1) * width;
        let given = |bit| if identifier & bit == 0 { 0 } else { octets };
        (inputs + given(0x10), outputs + given(0x20))
    })
}

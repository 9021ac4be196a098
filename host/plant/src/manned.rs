//! A bus before it is switched on: its memories opened, its devices and masters made.

use codewheel_link::Waker;
use codewheel_station::Instant;

use crate::device::Device;
use crate::field_bus::{FieldBus, PlannedMaster, Switches};
use crate::keeper::Keeper;
use crate::report::What;
use crate::{BusDescription, BusPlan, MasterDescription, StartError};

/// A plan, and everybody in it, ready to be switched on.
#[derive(Debug)]
pub(crate) struct Manned<B: FieldBus> {
    pub(crate) plan: BusPlan<B>,
    pub(crate) devices: Vec<Box<Device<B>>>,
    pub(crate) masters: Vec<Box<B::Master>>,
}

impl<B: FieldBus> Manned<B> {
    /// Opens the memories of all devices and makes devices and masters.
    pub(crate) fn open(plan: BusPlan<B>) -> Result<Self, StartError> {
        let mut devices = Vec::new();
        for (place, planned) in plan.devices.iter().enumerate() {
            let (keeper, aside) = Keeper::open(planned.memory.as_deref(), planned.product)?;
            let seed = seed_at(plan.seed, place);
            let mut device = Box::new(Device::new(&plan, planned, keeper, seed)?);
            if let Some(path) = aside {
                device.report(Instant::ZERO, What::SetAside(path));
            }
            devices.push(device);
        }
        let mut masters = Vec::new();
        for (place, planned) in plan.masters.iter().enumerate() {
            masters.push(Box::new(B::make_master(planned, place)?));
        }
        Ok(Self { plan, devices, masters })
    }

    /// What does not change from here on.
    pub(crate) fn describe(&self) -> BusDescription {
        let plan = &self.plan;
        let masters = plan.masters.iter().map(|master| MasterDescription {
            name: master.name().to_owned(),
            address: master.address(),
        });
        let devices = plan.devices.iter().zip(&self.devices).map(|(planned, device)| {
            let address = planned.switches.address();
            let serves = |master: &B::MasterPlan| address.is_some_and(|at| master.serves(at));
            device.describe(planned, plan.masters.iter().any(serves))
        });
        BusDescription {
            name: plan.name.clone(),
            bus: B::BUS,
            uri: plan.uri.to_string(),
            bit_rate: plan.bit_rate.to_string(),
            devices: devices.collect(),
            masters: masters.collect(),
        }
    }

    /// Writes memory files in threads.
    pub(crate) fn in_threads(mut self, waker: &Waker) -> Self {
        for device in &mut self.devices {
            device.write_in_thread(waker);
        }
        self
    }
}

/// What chance on one place is drawn from: near seeds and near places have nothing in common.
pub(crate) fn seed_at(seed: u32, place: usize) -> u64 {
    (u64::from(seed) << 32 | place as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
}

//! The Identity (01) and DeviceNet (03) objects, and what the stack's own classes say of
//! themselves.

use codewheel_station::can::BitRate;
use codewheel_station::{Instant, Writer};

use super::router::{attribute, attribute_to_get, only_instance, put};
use super::{Restart, Server, expect_length, refuse};
use crate::application::{Class, Done, Request, Reset};
use crate::connection::CHANGE_OF_STATE;
use crate::explicit::{Error, GeneralStatus, Service, class};
use crate::{Application, Identity};

/// Identity attribute 8: operational.
pub(super) const OPERATIONAL: u8 = 3;
/// Identity attribute 5, bit 0: a master owns the connection set.
const OWNED: u16 = 1;

impl Server {
    /// Class attributes of the stack's own classes.
    pub(super) fn own_class<A: Application>(class: u8, app: &A) -> Option<Class> {
        let (revision, max_instance) = match class {
            class::IDENTITY | class::MESSAGE_ROUTER | class::ACKNOWLEDGE_HANDLER => (1, 1),
            class::DEVICENET => (2, 1),
            class::ASSEMBLY => (2, app.highest_assembly()),
            class::CONNECTION => (1, CHANGE_OF_STATE),
            _ => return None,
        };
        Some(Class { revision, max_instance: u16::from(max_instance) })
    }

    pub(super) fn identity<A: Application>(
        &mut self,
        now: Instant,
        request: Request<'_>,
        out: &mut Writer<'_>,
        app: &mut A,
    ) -> Result<Done, Error> {
        only_instance(request)?;
        match request.service {
            Service::GET_ATTRIBUTE_SINGLE => {
                let path = attribute_to_get(request)?;
                self.identity_attribute(path.attribute, out, app)
            }
            Service::SET_ATTRIBUTE_SINGLE => {
                let (path, data) = attribute(request)?;
                match (path.attribute, data) {
                    (1..=9, _) => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)),
                    (10, &[interval]) => {
                        self.settings.heartbeat_interval = interval;
                        self.restart_heartbeat(now);
                        app.keep(now, self.settings);
                        Ok(Done::Now)
                    }
                    (10, data) => expect_length(data, 1).map(|()| Done::Now),
                    _ => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
                }
            }
            Service::GET_ATTRIBUTES_ALL => {
                expect_length(request.data, 0)?;
                for attribute in 1..=10 {
                    self.identity_attribute(attribute, out, app)?;
                }
                Ok(Done::Now)
            }
            Service::RESET => {
                let reset = match *request.data {
                    [] | [0] => Reset::PowerCycle,
                    [1] => Reset::Defaults,
                    [_] => return Err(refuse(GeneralStatus::INVALID_PARAMETER)),
                    _ => return Err(refuse(GeneralStatus::TOO_MUCH_DATA)),
                };
                let done = app.reset(now, reset)?;
                if let Some(explicit) = &mut self.explicit {
                    explicit.limit(now);
                }
                self.restart = match done {
                    Done::Now => Restart::Answering,
                    Done::Later => Restart::Writing,
                };
                Ok(done)
            }
            _ => Err(refuse(GeneralStatus::SERVICE_NOT_SUPPORTED)),
        }
    }

    /// Identity attribute 5: what the device says of itself, and whether a master owns it.
    pub fn identity_status<A: Application>(&self, app: &A) -> u16 {
        app.status() | if self.master.is_some() { OWNED } else { 0 }
    }

    fn identity_attribute<A: Application>(
        &self,
        attribute: u8,
        out: &mut Writer<'_>,
        app: &A,
    ) -> Result<Done, Error> {
        let Identity {
            vendor,
            device_type,
            product_code,
            major_revision,
            minor_revision,
            serial,
            product_name,
        } = app.identity();
        put(match attribute {
            1 => out.u16_le(vendor),
            2 => out.u16_le(device_type),
            3 => out.u16_le(product_code),
            4 => out.octets(&[major_revision, minor_revision]),
            5 => out.u16_le(self.identity_status(app)),
            6 => out.u32_le(serial),
            7 => {
                out.u8(product_name.len() as u8).and_then(|()| out.octets(product_name.as_bytes()))
            }
            8 => out.u8(OPERATIONAL),
            9 => out.u16_le(app.configuration_consistency()),
            10 => out.u8(self.settings.heartbeat_interval),
            _ => return Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
        })
    }

    pub(super) fn devicenet<A: Application>(
        &mut self,
        now: Instant,
        request: Request<'_>,
        out: &mut Writer<'_>,
        app: &mut A,
    ) -> Result<Done, Error> {
        only_instance(request)?;
        match request.service {
            Service::GET_ATTRIBUTE_SINGLE => {
                let path = attribute_to_get(request)?;
                self.devicenet_attribute(path.attribute, out, app)
            }
            Service::SET_ATTRIBUTE_SINGLE => {
                let (path, data) = attribute(request)?;
                match path.attribute {
                    3 => {
                        expect_length(data, 1)?;
                        let bus_off_interrupt = match *data {
                            [0] => false,
                            [1] => true,
                            _ => return Err(refuse(GeneralStatus::INVALID_ATTRIBUTE_VALUE)),
                        };
                        self.settings.bus_off_interrupt = bus_off_interrupt;
                        app.keep(now, self.settings);
                        Ok(Done::Now)
                    }
                    4 => {
                        expect_length(data, 1)?;
                        self.bus_off_counter = 0;
                        Ok(Done::Now)
                    }
                    1 | 2 | 5..=9 => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)),
                    _ => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
                }
            }
            Service::ALLOCATE => self.allocate(now, request.data, out, app),
            Service::RELEASE => {
                // Over the explicit connection the owner itself speaks.
                let Some(owner) = self.master else {
                    return Err(refuse(GeneralStatus::OBJECT_STATE_CONFLICT));
                };
                self.release(now, request.data, owner, app)
            }
            _ => Err(refuse(GeneralStatus::SERVICE_NOT_SUPPORTED)),
        }
    }

    fn devicenet_attribute<A: Application>(
        &self,
        attribute: u8,
        out: &mut Writer<'_>,
        app: &A,
    ) -> Result<Done, Error> {
        let code = |bit_rate| match bit_rate {
            BitRate::Kbit125 => 0,
            BitRate::Kbit250 => 1,
            BitRate::Kbit500 => 2,
        };
        let switches = app.switches();
        put(match attribute {
            1 => out.u8(self.mac.value()),
            2 => out.u8(code(self.bit_rate)),
            3 => out.u8(u8::from(self.settings.bus_off_interrupt)),
            4 => out.u8(self.bus_off_counter),
            5 => {
                out.octets(&[self.allocation_choice(), self.master.map_or(0xFF, |mac| mac.value())])
            }
            6 => out.u8(u8::from(switches.mac != self.mac.value())),
            7 => out.u8(u8::from(switches.bit_rate != self.bit_rate)),
            8 => out.u8(switches.mac),
            9 => out.u8(code(switches.bit_rate)),
            _ => return Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
        })
    }
}

//! The Connection object (class 05): the attributes and services of the connections that exist.

use codewheel_station::{Instant, Reader, Writer};

use super::production::Trigger;
use super::router::{attribute, attribute_to_get, put};
use super::{REQUEST_OCTETS, RESPONSE_OCTETS, Server, expect_length, refuse};
use crate::application::{Done, Request};
use crate::connection::{CHANGE_OF_STATE, Connection, EXPLICIT, POLL, State};
use crate::explicit::{Error, GeneralStatus, Service, class};
use crate::identifier::{
    CHANGE_ACKNOWLEDGE, CHANGE_OF_STATE_MESSAGE, EXPLICIT_REQUEST, EXPLICIT_RESPONSE, POLL_COMMAND,
    POLL_RESPONSE, group_1, group_2,
};
use crate::{Application, Event, ProducedPath};

/// Attribute 5 where nothing is consumed.
const NO_IDENTIFIER: u16 = 0xFFFF;
/// Attribute 16 where acknowledges are consumed: class 2Bh instance 1.
const ACKNOWLEDGE_HANDLER_PATH: [u8; 4] = [0x20, class::ACKNOWLEDGE_HANDLER, 0x24, 1];
/// Attribute 12 of I/O connections.
const IO_WATCHDOG_ACTIONS: [u8; 3] =
    [Connection::TRANSITION_TO_TIMED_OUT, Connection::AUTO_DELETE, Connection::AUTO_RESET];

/// What is fixed about a connection instance.
struct Fixed {
    instance_type: u8,
    transport_class_trigger: u8,
    produced_id: u16,
    consumed_id: u16,
    initial_characteristics: u8,
    produced_size: u16,
    consumed_size: u16,
    consumed_path: &'static [u8],
    /// The values that attribute 12 takes.
    watchdog_actions: &'static [u8],
}

impl Server {
    pub(super) fn connection<A: Application>(
        &mut self,
        now: Instant,
        request: Request<'_>,
        out: &mut Writer<'_>,
        app: &mut A,
    ) -> Result<Done, Error> {
        let instance = request.instance;
        let fixed =
            self.fixed(instance, app).ok_or(refuse(GeneralStatus::OBJECT_DOES_NOT_EXIST))?;
        match request.service {
            Service::GET_ATTRIBUTE_SINGLE => {
                let path = attribute_to_get(request)?;
                self.connection_attribute(instance, &fixed, path.attribute, out)
            }
            Service::SET_ATTRIBUTE_SINGLE => {
                let (path, data) = attribute(request)?;
                self.set_connection_attribute(now, instance, &fixed, path.attribute, data, out, app)
            }
            Service::RESET => {
                expect_length(request.data, 0)?;
                let connection = self.connection_mut(instance)?;
                let before = connection.state;
                if before == State::Configuring {
                    return Err(refuse(GeneralStatus::OBJECT_STATE_CONFLICT));
                }
                connection.state = State::Established;
                connection.arm(now);
                if before == State::TimedOut {
                    self.begin_production(now, instance);
                }
                Ok(Done::Now)
            }
            Service::APPLY_ATTRIBUTES => {
                expect_length(request.data, 0)?;
                let connection = self.connection_mut(instance)?;
                if connection.state != State::Configuring {
                    return Err(refuse(GeneralStatus::OBJECT_STATE_CONFLICT));
                }
                connection.establish(now);
                self.begin_production(now, instance);
                app.notice(now, Event::Established { instance });
                put(out.u16_le(fixed.produced_id).and_then(|()| out.u16_le(fixed.consumed_id)))
            }
            _ => Err(refuse(GeneralStatus::SERVICE_NOT_SUPPORTED)),
        }
    }

    fn fixed<A: Application>(&self, instance: u8, app: &A) -> Option<Fixed> {
        match instance {
            EXPLICIT if self.explicit.is_some() => Some(Fixed {
                instance_type: 0,
                transport_class_trigger: 0x83,
                produced_id: group_2(self.mac, EXPLICIT_RESPONSE),
                consumed_id: group_2(self.mac, EXPLICIT_REQUEST),
                initial_characteristics: 0x21,
                produced_size: RESPONSE_OCTETS as u16,
                consumed_size: REQUEST_OCTETS as u16,
                consumed_path: &[],
                watchdog_actions: &[Connection::AUTO_DELETE, Connection::DEFERRED_DELETE],
            }),
            POLL => self.poll.as_ref().map(|io| Fixed {
                instance_type: 1,
                transport_class_trigger: 0x82,
                produced_id: group_1(POLL_RESPONSE, self.mac),
                consumed_id: group_2(self.mac, POLL_COMMAND),
                initial_characteristics: 0x01,
                produced_size: app.assembly_size(io.path.assembly).unwrap_or(0) as u16,
                consumed_size: 0,
                consumed_path: &[],
                watchdog_actions: &IO_WATCHDOG_ACTIONS,
            }),
            CHANGE_OF_STATE => self.production.as_ref().map(|production| Fixed {
                instance_type: 1,
                transport_class_trigger: match (production.trigger, production.acknowledged) {
                    (Trigger::ChangeOfState, true) => 0x13,
                    (Trigger::ChangeOfState, false) => 0x10,
                    (Trigger::Cyclic, true) => 0x03,
                    (Trigger::Cyclic, false) => 0x00,
                },
                produced_id: group_1(CHANGE_OF_STATE_MESSAGE, self.mac),
                consumed_id: if production.acknowledged {
                    group_2(self.mac, CHANGE_ACKNOWLEDGE)
                } else {
                    NO_IDENTIFIER
                },
                initial_characteristics: if production.acknowledged { 0x01 } else { 0x0F },
                produced_size: app.assembly_size(production.io.path.assembly).unwrap_or(0) as u16,
                consumed_size: 0,
                consumed_path: if production.acknowledged {
                    &ACKNOWLEDGE_HANDLER_PATH
                } else {
                    &[]
                },
                watchdog_actions: &IO_WATCHDOG_ACTIONS,
            }),
            _ => None,
        }
    }

    /// Connection instance 4 produces at once when it is established or revived.
    fn begin_production(&mut self, now: Instant, instance: u8) {
        if instance == CHANGE_OF_STATE
            && let Some(production) = &mut self.production
        {
            production.begin(now);
        }
    }

    fn connection_mut(&mut self, instance: u8) -> Result<&mut Connection, Error> {
        match instance {
            EXPLICIT => self.explicit.as_mut(),
            _ => self.io_mut(instance).map(|io| &mut io.connection),
        }
        .ok_or(refuse(GeneralStatus::OBJECT_DOES_NOT_EXIST))
    }

    /// The produced path of an I/O connection; the explicit connection has none.
    fn produced_path(&self, instance: u8) -> Option<ProducedPath> {
        self.io(instance).map(|io| io.path)
    }

    fn connection_attribute(
        &mut self,
        instance: u8,
        fixed: &Fixed,
        attribute: u8,
        out: &mut Writer<'_>,
    ) -> Result<Done, Error> {
        let path = self.produced_path(instance);
        let connection = self.connection_mut(instance)?;
        put(match attribute {
            1 => out.u8(connection.state as u8),
            2 => out.u8(fixed.instance_type),
            3 => out.u8(fixed.transport_class_trigger),
            4 => out.u16_le(fixed.produced_id),
            5 => out.u16_le(fixed.consumed_id),
            6 => out.u8(fixed.initial_characteristics),
            7 => out.u16_le(fixed.produced_size),
            8 => out.u16_le(fixed.consumed_size),
            9 => out.u16_le(connection.expected_packet_rate),
            12 => out.u8(connection.watchdog_action),
            13 => out.u16_le(path.map_or(0, |path| path.length() as u16)),
            14 => path.map_or(Ok(()), |path| path.write(out)),
            15 => out.u16_le(fixed.consumed_path.len() as u16),
            16 => out.octets(fixed.consumed_path),
            17 if instance != EXPLICIT => out.u16_le(connection.production_inhibit),
            _ => return Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
        })
    }

    #[allow(clippy::too_many_arguments)] // one request, taken apart
    fn set_connection_attribute<A: Application>(
        &mut self,
        now: Instant,
        instance: u8,
        fixed: &Fixed,
        attribute: u8,
        data: &[u8],
        out: &mut Writer<'_>,
        app: &mut A,
    ) -> Result<Done, Error> {
        match attribute {
            9 => {
                let rate = timer(data)?;
                let connection = self.connection_mut(instance)?;
                let configuring = connection.state == State::Configuring;
                connection.set_expected_packet_rate(now, rate)?;
                if configuring {
                    self.begin_production(now, instance);
                    app.notice(now, Event::Established { instance });
                } else if instance == CHANGE_OF_STATE
                    && let Some(production) = &mut self.production
                    && production.io.connection.is_established()
                {
                    production.restart_rate(now);
                }
                put(out.u16_le(rate))
            }
            12 => {
                expect_length(data, 1)?;
                let action = data.first().copied().unwrap_or_default();
                if !fixed.watchdog_actions.contains(&action) {
                    return Err(refuse(GeneralStatus::INVALID_ATTRIBUTE_VALUE));
                }
                self.connection_mut(instance)?.watchdog_action = action;
                Ok(Done::Now)
            }
            14 if instance != EXPLICIT => self.set_produced_path(now, instance, data, app),
            17 if instance != EXPLICIT => {
                let connection = self.connection_mut(instance)?;
                if connection.state != State::Configuring {
                    return Err(refuse(GeneralStatus::OBJECT_STATE_CONFLICT));
                }
                let inhibit = timer(data)?;
                connection.set_production_inhibit(inhibit)?;
                put(out.u16_le(inhibit))
            }
            1..=8 | 13..=17 => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)),
            _ => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
        }
    }

    /// Chooses the assembly an I/O connection produces; kept at once (AMG manual §6).
    fn set_produced_path<A: Application>(
        &mut self,
        now: Instant,
        instance: u8,
        data: &[u8],
        app: &mut A,
    ) -> Result<Done, Error> {
        if self.connection_mut(instance)?.state != State::Configuring {
            return Err(refuse(GeneralStatus::OBJECT_STATE_CONFLICT));
        }
        if data.is_empty() {
            return Err(refuse(GeneralStatus::NOT_ENOUGH_DATA));
        }
        let path = ProducedPath::parse(data)
            .filter(|path| app.assembly_size(path.assembly).is_some())
            .ok_or(refuse(GeneralStatus::INVALID_ATTRIBUTE_VALUE))?;
        if let Some(io) = self.io_mut(instance) {
            io.path = path;
        }
        match instance {
            CHANGE_OF_STATE => self.settings.change_path = path,
            _ => self.settings.poll_path = path,
        }
        app.keep(now, self.settings);
        Ok(Done::Now)
    }
}

/// A timer value: two octets.
fn timer(data: &[u8]) -> Result<u16, Error> {
    expect_length(data, 2)?;
    Reader::new(data).u16_le().map_err(|_| refuse(GeneralStatus::NOT_ENOUGH_DATA))
}

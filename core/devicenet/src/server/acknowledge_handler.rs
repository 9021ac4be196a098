//! The Acknowledge Handler object (class 2Bh, one instance).

use codewheel_station::Writer;

use super::router::{attribute, attribute_to_get, only_instance, put};
use super::{Server, expect_length, refuse};
use crate::application::{Done, Request};
use crate::connection::CHANGE_OF_STATE;
use crate::explicit::{Error, GeneralStatus, Service};

impl Server {
    pub(super) fn acknowledge_handler(
        &mut self,
        request: Request<'_>,
        out: &mut Writer<'_>,
    ) -> Result<Done, Error> {
        only_instance(request)?;
        let handler = &mut self.acknowledge_handler;
        match request.service {
            Service::GET_ATTRIBUTE_SINGLE => {
                let path = attribute_to_get(request)?;
                put(match path.attribute {
                    1 => out.u16_le(handler.timer),
                    2 => out.u8(handler.retry_limit),
                    3 => out.u16_le(u16::from(CHANGE_OF_STATE)),
                    _ => return Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
                })
            }
            Service::SET_ATTRIBUTE_SINGLE => {
                let (path, data) = attribute(request)?;
                match (path.attribute, data) {
                    (1, &[low, high]) => {
                        let timer = u16::from_le_bytes([low, high]);
                        if timer == 0 {
                            return Err(refuse(GeneralStatus::INVALID_ATTRIBUTE_VALUE));
                        }
                        handler.timer = timer;
                        put(out.u16_le(timer))
                    }
                    (2, &[limit]) => {
                        handler.retry_limit = limit;
                        Ok(Done::Now)
                    }
                    (1, data) => expect_length(data, 2).map(|()| Done::Now),
                    (2, data) => expect_length(data, 1).map(|()| Done::Now),
                    (3, _) => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)),
                    _ => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
                }
            }
            _ => Err(refuse(GeneralStatus::SERVICE_NOT_SUPPORTED)),
        }
    }
}

//! From the body of an explicit request to its object and back.

use codewheel_station::{Instant, Writer};

use super::{RESPONSE_OCTETS, Restart, Server, expect_length, refuse};
use crate::application::{Done, Request};
use crate::explicit::{Error, GeneralStatus, Header, Path, Service, class};
use crate::{Application, Class};

impl Server {
    /// Carries out the request in `body` and owes its response.
    pub(super) fn request<A: Application>(
        &mut self,
        now: Instant,
        header: Header,
        body: &[u8],
        app: &mut A,
    ) {
        let Some((&service, rest)) = body.split_first() else { return };
        if service >= 0x80 {
            // A response is nothing that a server could answer.
            return;
        }
        let service = Service(service);
        if self.messages.is_pending() || self.restart == Restart::Writing {
            let busy = refuse(GeneralStatus::DEVICE_STATE_CONFLICT);
            return self.messages.respond(header, service, Err(busy));
        }
        let &[class, instance, ref data @ ..] = rest else {
            let short = refuse(GeneralStatus::NOT_ENOUGH_DATA);
            return self.messages.respond(header, service, Err(short));
        };
        let request = Request { service, class, instance, data };
        let mut octets = [0; RESPONSE_OCTETS - 1];
        let mut out = Writer::new(&mut octets);
        let result = self.route(now, request, &mut out, app);
        let written = out.len();
        let result = match result {
            Ok(Done::Later) => return self.messages.defer(header, service),
            Ok(Done::Now) => {
                for (to, from) in self.messages.room().iter_mut().zip(&octets).take(written) {
                    *to = *from;
                }
                Ok(written)
            }
            Err(error) => Err(error),
        };
        self.messages.respond(header, service, result);
    }

    fn route<A: Application>(
        &mut self,
        now: Instant,
        request: Request<'_>,
        out: &mut Writer<'_>,
        app: &mut A,
    ) -> Result<Done, Error> {
        let own = Self::own_class(request.class, app);
        let about = own
            .or_else(|| app.class(request.class))
            .ok_or(refuse(GeneralStatus::OBJECT_DOES_NOT_EXIST))?;
        if request.instance == 0 {
            return self.class_level(now, request, about, own.is_some(), out, app);
        }
        match request.class {
            class::IDENTITY => self.identity(now, request, out, app),
            class::MESSAGE_ROUTER => message_router(request),
            class::DEVICENET => self.devicenet(now, request, out, app),
            class::ASSEMBLY => assembly(now, request, out, app),
            class::CONNECTION => self.connection(now, request, out, app),
            class::ACKNOWLEDGE_HANDLER => self.acknowledge_handler(request, out),
            _ => match request.service {
                Service::GET_ATTRIBUTE_SINGLE => {
                    let path = attribute_to_get(request)?;
                    app.get(now, path, out).map(|()| Done::Now)
                }
                Service::SET_ATTRIBUTE_SINGLE => {
                    let (path, data) = attribute(request)?;
                    app.set(now, path, data)
                }
                _ => app.serve(now, request, out),
            },
        }
    }

    fn class_level<A: Application>(
        &mut self,
        now: Instant,
        request: Request<'_>,
        about: Class,
        own: bool,
        out: &mut Writer<'_>,
        app: &mut A,
    ) -> Result<Done, Error> {
        match request.service {
            Service::GET_ATTRIBUTE_SINGLE => {
                let path = attribute_to_get(request)?;
                match path.attribute {
                    1 => put(out.u16_le(about.revision)),
                    2 => put(out.u16_le(about.max_instance)),
                    _ if own => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
                    _ => app.get(now, path, out).map(|()| Done::Now),
                }
            }
            Service::SET_ATTRIBUTE_SINGLE => Err(refuse(GeneralStatus::SERVICE_NOT_SUPPORTED)),
            _ if own => Err(refuse(GeneralStatus::SERVICE_NOT_SUPPORTED)),
            _ => app.serve(now, request, out),
        }
    }
}

/// The Message Router has one instance and no attributes.
fn message_router(request: Request<'_>) -> Result<Done, Error> {
    only_instance(request)?;
    match request.service {
        Service::GET_ATTRIBUTE_SINGLE => {
            attribute_to_get(request)?;
            Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED))
        }
        _ => Err(refuse(GeneralStatus::SERVICE_NOT_SUPPORTED)),
    }
}

/// Assembly instances: attribute 3 data, 4 size. What the device produces cannot be set.
fn assembly<A: Application>(
    now: Instant,
    request: Request<'_>,
    out: &mut Writer<'_>,
    app: &mut A,
) -> Result<Done, Error> {
    let size =
        app.assembly_size(request.instance).ok_or(refuse(GeneralStatus::OBJECT_DOES_NOT_EXIST))?;
    match request.service {
        Service::GET_ATTRIBUTE_SINGLE => {
            let path = attribute_to_get(request)?;
            match path.attribute {
                3 => {
                    let mut octets = [0; 8];
                    let size = app.produce(now, request.instance, &mut octets);
                    put(out.octets(octets.get(..size).unwrap_or(&octets)))
                }
                4 => put(out.u16_le(size as u16)),
                _ => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
            }
        }
        Service::SET_ATTRIBUTE_SINGLE => match attribute(request)?.0.attribute {
            3 | 4 => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)),
            _ => Err(refuse(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)),
        },
        _ => Err(refuse(GeneralStatus::SERVICE_NOT_SUPPORTED)),
    }
}

/// The attribute that a Get or Set names, and the data behind it.
pub(super) fn attribute<'a>(request: Request<'a>) -> Result<(Path, &'a [u8]), Error> {
    let (&attribute, data) =
        request.data.split_first().ok_or(refuse(GeneralStatus::NOT_ENOUGH_DATA))?;
    Ok((Path { class: request.class, instance: request.instance, attribute }, data))
}

/// The attribute that a Get names; a Get has no data.
pub(super) fn attribute_to_get(request: Request<'_>) -> Result<Path, Error> {
    let (path, data) = attribute(request)?;
    expect_length(data, 0)?;
    Ok(path)
}

/// Refuses every instance but 1.
pub(super) fn only_instance(request: Request<'_>) -> Result<(), Error> {
    if request.instance == 1 { Ok(()) } else { Err(refuse(GeneralStatus::OBJECT_DOES_NOT_EXIST)) }
}

/// Ends a Get: done, or the response buffer was too small for the value.
pub(super) fn put(result: Result<(), codewheel_station::Full>) -> Result<Done, Error> {
    result.map(|()| Done::Now).map_err(|_| refuse(GeneralStatus::RESOURCE_UNAVAILABLE))
}

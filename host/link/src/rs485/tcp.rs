//! `rs485:HOST:PORT`: we are a client of somebody else's line, or of another codewheel.

use std::io::{self, Read, Write};

use mio::Interest;
use mio::net::TcpStream;

use super::stream::{Line, STREAM, StreamPort};
use crate::socket::{Watch, connect_to};
use crate::{Endpoint, LinkError};

/// Connects to `endpoint`.
pub(super) fn connect(endpoint: &Endpoint) -> Result<StreamPort<Connection>, LinkError> {
    let failed = |reason| LinkError::Connect { endpoint: endpoint.to_string(), reason };
    let stream = connect_to(endpoint)?;
    stream.set_nodelay(true).map_err(failed)?;
    stream.set_nonblocking(true).map_err(failed)?;
    let mut stream = TcpStream::from_std(stream);
    let watch = Watch::new()?;
    let interest = Interest::READABLE | Interest::WRITABLE;
    watch.registry().register(&mut stream, STREAM, interest).map_err(LinkError::System)?;
    let connection = Connection { stream, endpoint: endpoint.clone() };
    Ok(StreamPort::new(connection, watch, Vec::new()))
}

/// A connection that passes octets.
#[derive(Debug)]
pub(super) struct Connection {
    stream: TcpStream,
    endpoint: Endpoint,
}

impl Read for Connection {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.read(buffer)
    }
}

impl Write for Connection {
    fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
        self.stream.write(octets)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

impl Line for Connection {
    fn describe(&self) -> String {
        format!("rs485:{}", self.endpoint)
    }
}

//! `slcan:PATH`: an adapter at a serial port of this machine.

use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::AsRawFd;
use std::path::Path;

use codewheel_station::can::BitRate;
use mio::Interest;
use mio::unix::SourceFd;
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};

use super::client::{ADAPTER, ClientPort};
use crate::serial::{self, Claim};
use crate::socket::Watch;
use crate::{BusUri, LinkError, Notice};

/// Opens the serial port at `path` with 8N1 at `speed` bit/s, for us alone, and asks the adapter
/// there to open its channel at `rate`.
pub(crate) fn open(
    path: &Path,
    speed: u32,
    rate: BitRate,
) -> Result<ClientPort<SerialPort>, LinkError> {
    let failed = |reason| LinkError::Device { path: path.to_owned(), reason };
    let file = serial::open(path).map_err(failed)?;
    let taken = set_up(&file, speed).map_err(failed)?;
    let mut notices = Vec::new();
    let mut claim = None;
    if !serial::is_pty(path) {
        claim = Some(Claim::on(&file).map_err(failed)?);
        notices.extend(serial::hurry(path));
        let is_near = taken.abs_diff(speed) <= speed / 100;
        notices.extend((!is_near).then_some(Notice::SpeedNotTaken { asked: speed, taken }));
    }
    let watch = Watch::new()?;
    watch
        .registry()
        .register(
            &mut SourceFd(&file.as_raw_fd()),
            ADAPTER,
            Interest::READABLE | Interest::WRITABLE,
        )
        .map_err(LinkError::System)?;
    let bus = BusUri::SlcanDevice { path: path.to_owned(), speed }.to_string();
    let port = SerialPort { file, _claim: claim };
    Ok(ClientPort::new(bus, port, watch, rate).telling(notices))
}

/// Sets characters and speed, and gives the speed that was taken. What came before is nobody's.
fn set_up(file: &File, speed: u32) -> io::Result<u32> {
    let mut settings = tcgetattr(file)?;
    serial::pass_octets(&mut settings);
    settings.set_speed(speed)?;
    tcsetattr(file, OptionalActions::Now, &settings)?;
    tcflush(file, QueueSelector::IOFlush)?;
    Ok(tcgetattr(file)?.output_speed())
}

/// An open serial port.
#[derive(Debug)]
pub(crate) struct SerialPort {
    file: File,
    _claim: Option<Claim>,
}

impl Read for SerialPort {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.file.read(buffer)
    }
}

impl Write for SerialPort {
    fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
        self.file.write(octets)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

//! `rs485:PATH`: a serial port of this machine.

use std::collections::VecDeque;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use codewheel_station::rs485::BaudRate;
use mio::Interest;
use mio::unix::SourceFd;
use rustix::fs::OFlags;
use rustix::termios::{
    ControlModes, InputModes, OptionalActions, QueueSelector, SpecialCodeIndex, ioctl_tiocexcl,
    ioctl_tiocnxcl, tcflush, tcgetattr, tcsetattr,
};

use self::marks::Marks;
use super::port::Rs485Received;
use super::stream::{Line, STREAM, StreamPort};
use crate::socket::Watch;
use crate::{LinkError, Notice};

mod adapter;
mod marks;

/// How far a rate may be from its nominal value, in percent. Between two stations 4 % would break
/// the stop bit of a character; the other side has its tolerance too.
const RATE_TOLERANCE: u32 = 1;

/// Opens the serial port at `path` with 8E1 at `rate`, for us alone.
pub(super) fn open(path: &Path, rate: BaudRate) -> Result<StreamPort<Terminal>, LinkError> {
    let failed = |reason| LinkError::Device { path: path.to_owned(), reason };
    // Without waiting: some drivers hold `open` up until the other side shows a carrier.
    let flags = (OFlags::NOCTTY | OFlags::NONBLOCK).bits().cast_signed();
    let file = OpenOptions::new().read(true).write(true).custom_flags(flags).open(path);
    let file = file.map_err(failed)?;
    let mut terminal = Terminal {
        file,
        path: path.to_owned(),
        is_pty: is_pty(path),
        marks: None,
        rate,
        missed: Vec::new(),
    };
    let mut notices = terminal.set_up().map_err(failed)?;
    if !terminal.is_pty {
        ioctl_tiocexcl(&terminal.file).map_err(|error| failed(error.into()))?;
        notices.extend(adapter::switch_transmitter(&terminal.file));
        notices.extend(adapter::hurry(path));
    }
    // What came before is nobody's.
    tcflush(&terminal.file, QueueSelector::IOFlush).map_err(|error| failed(error.into()))?;
    let watch = Watch::new()?;
    let interest = Interest::READABLE | Interest::WRITABLE;
    watch
        .registry()
        .register(&mut SourceFd(&terminal.file.as_raw_fd()), STREAM, interest)
        .map_err(LinkError::System)?;
    Ok(StreamPort::new(terminal, watch, notices))
}

/// Whether `path` leads to the programs' side of a pty: such a port has no rate, no parity and no
/// transmitter, and may be shared.
fn is_pty(path: &Path) -> bool {
    fs::canonicalize(path).is_ok_and(|device| device.starts_with("/dev/pts"))
}

/// An open serial port.
#[derive(Debug)]
pub(super) struct Terminal {
    file: File,
    path: PathBuf,
    is_pty: bool,
    /// Reads what the driver writes about broken characters, where it does.
    marks: Option<Marks>,
    rate: BaudRate,
    /// Rates that the hardware did not take, which people have heard of: a search comes round to
    /// them again and again.
    missed: Vec<BaudRate>,
}

impl Terminal {
    /// Sets characters and rate, and reads back what came of it: drivers take what they cannot do
    /// without a word.
    fn set_up(&mut self) -> io::Result<Vec<Notice>> {
        let mut settings = tcgetattr(&self.file)?;
        settings.make_raw();
        settings.input_modes -= InputModes::IGNPAR | InputModes::IGNBRK | InputModes::BRKINT;
        settings.input_modes -= InputModes::IXOFF | InputModes::IXANY;
        settings.input_modes |= InputModes::INPCK | InputModes::PARMRK;
        settings.control_modes -= ControlModes::CSIZE
            | ControlModes::CSTOPB
            | ControlModes::PARODD
            | ControlModes::CRTSCTS
            | ControlModes::HUPCL;
        settings.control_modes |=
            ControlModes::CS8 | ControlModes::PARENB | ControlModes::CLOCAL | ControlModes::CREAD;
        settings.special_codes[SpecialCodeIndex::VMIN] = 1;
        settings.special_codes[SpecialCodeIndex::VTIME] = 0;
        settings.set_speed(self.rate.bits_per_second())?;
        tcsetattr(&self.file, OptionalActions::Now, &settings)?;
        let settings = tcgetattr(&self.file)?;
        self.marks = settings.input_modes.contains(InputModes::PARMRK).then(Marks::default);
        let size = settings.control_modes & ControlModes::CSIZE;
        let others = ControlModes::CSTOPB | ControlModes::PARODD;
        let has_parity = settings.control_modes.contains(ControlModes::PARENB)
            && size == ControlModes::CS8
            && !settings.control_modes.intersects(others);
        let parity = (!has_parity).then_some(Notice::ParityNotTaken);
        Ok(parity.into_iter().chain(self.judge(settings.output_speed())).collect())
    }

    /// What people should hear of the rate that was taken.
    fn judge(&mut self, taken: u32) -> Option<Notice> {
        let asked = self.rate.bits_per_second();
        if taken.abs_diff(asked) <= asked / 100 * RATE_TOLERANCE || self.missed.contains(&self.rate)
        {
            return None;
        }
        self.missed.push(self.rate);
        Some(Notice::RateNotTaken { asked: self.rate, taken })
    }
}

impl Read for Terminal {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.file.read(buffer)
    }
}

impl Write for Terminal {
    fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
        self.file.write(octets)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Line for Terminal {
    fn hear(&mut self, octets: &[u8], inbox: &mut VecDeque<Rs485Received>) {
        match &mut self.marks {
            Some(marks) => marks.read(octets, |received| inbox.push_back(received)),
            None => inbox.push_back(Rs485Received::Octets(octets.to_vec())),
        }
    }

    fn has_rate(&self) -> bool {
        !self.is_pty
    }

    fn set_baud_rate(&mut self, rate: BaudRate) -> io::Result<Vec<Notice>> {
        if rate == self.rate || self.is_pty {
            return Ok(Vec::new());
        }
        self.rate = rate;
        let mut settings = tcgetattr(&self.file)?;
        settings.set_speed(rate.bits_per_second())?;
        tcsetattr(&self.file, OptionalActions::Now, &settings)?;
        // Octets that another rate made of the line mean nothing.
        tcflush(&self.file, QueueSelector::IFlush)?;
        let taken = tcgetattr(&self.file)?.output_speed();
        Ok(self.judge(taken).into_iter().collect())
    }

    fn advice(&self) -> &'static str {
        "plug the adapter in and start this program again"
    }

    fn describe(&self) -> String {
        format!("rs485:{}", self.path.display())
    }
}

impl Drop for Terminal {
    /// Lets others open the port again where somebody else keeps it open.
    fn drop(&mut self) {
        if !self.is_pty {
            let _ = ioctl_tiocnxcl(&self.file);
        }
    }
}

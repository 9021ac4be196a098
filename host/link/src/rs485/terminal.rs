//! `rs485:PATH`: a serial port of this machine.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};

use codewheel_station::rs485::BaudRate;
use mio::Interest;
use mio::unix::SourceFd;
use rustix::termios::{
    ControlModes, InputModes, OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr,
};

use self::marks::Marks;
use super::port::Rs485Received;
use super::stream::{Line, STREAM, StreamPort};
use crate::serial::{self, Claim};
use crate::socket::Watch;
use crate::{LinkError, Notice};

mod marks;
mod transmitter;

/// How far a rate may be from its nominal value, in percent. Between two stations 4 % would break
/// the stop bit of a character; the other side has its tolerance too.
const RATE_TOLERANCE: u32 = 1;

/// Opens the serial port at `path` with 8E1 at `rate`, for us alone.
pub(super) fn open(path: &Path, rate: BaudRate) -> Result<StreamPort<Terminal>, LinkError> {
    let failed = |reason| LinkError::Device { path: path.to_owned(), reason };
    let mut terminal = Terminal {
        file: serial::open(path).map_err(failed)?,
        path: path.to_owned(),
        is_pty: serial::is_pty(path),
        claim: None,
        marks: None,
        rate,
        missed: Vec::new(),
    };
    let mut notices = terminal.set_up().map_err(failed)?;
    if !terminal.is_pty {
        terminal.claim = Some(Claim::on(&terminal.file).map_err(failed)?);
        notices.extend(transmitter::switch_transmitter(&terminal.file));
        notices.extend(serial::hurry(path));
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

/// An open serial port.
#[derive(Debug)]
pub(super) struct Terminal {
    file: File,
    path: PathBuf,
    is_pty: bool,
    claim: Option<Claim>,
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
        serial::pass_octets(&mut settings);
        settings.input_modes |= InputModes::INPCK | InputModes::PARMRK;
        settings.control_modes |= ControlModes::PARENB;
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

    fn describe(&self) -> String {
        format!("rs485:{}", self.path.display())
    }
}

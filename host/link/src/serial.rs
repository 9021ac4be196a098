//! What every serial port of this machine needs, whatever is spoken over it.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use rustix::fs::OFlags;
use rustix::termios::{
    ControlModes, InputModes, SpecialCodeIndex, Termios, ioctl_tiocexcl, ioctl_tiocnxcl,
};

use crate::Notice;

/// Opens the port at `path`. Reading and writing do not wait, and neither does this: some drivers
/// hold `open` up until the other side shows a carrier.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    let flags = (OFlags::NOCTTY | OFlags::NONBLOCK).bits().cast_signed();
    OpenOptions::new().read(true).write(true).custom_flags(flags).open(path)
}

/// Has `settings` pass octets as they are: eight bits, one stop bit, no parity, no flow control,
/// no modem lines.
pub(crate) fn pass_octets(settings: &mut Termios) {
    settings.make_raw();
    settings.input_modes -= InputModes::IGNPAR | InputModes::IGNBRK | InputModes::BRKINT;
    settings.input_modes -= InputModes::IXOFF | InputModes::IXANY;
    settings.control_modes -= ControlModes::CSIZE
        | ControlModes::CSTOPB
        | ControlModes::PARENB
        | ControlModes::PARODD
        | ControlModes::CRTSCTS
        | ControlModes::HUPCL;
    settings.control_modes |= ControlModes::CS8 | ControlModes::CLOCAL | ControlModes::CREAD;
    settings.special_codes[SpecialCodeIndex::VMIN] = 1;
    settings.special_codes[SpecialCodeIndex::VTIME] = 0;
}

/// Whether `path` leads to the programs' side of a pty: such a port has no rate, no parity and no
/// transmitter, and may be shared.
pub(crate) fn is_pty(path: &Path) -> bool {
    fs::canonicalize(path).is_ok_and(|device| device.starts_with("/dev/pts"))
}

/// A port that nobody else may open as long as this is there.
#[derive(Debug)]
pub(crate) struct Claim(File);

impl Claim {
    /// Takes the port for us alone.
    pub(crate) fn on(file: &File) -> io::Result<Self> {
        let file = file.try_clone()?;
        ioctl_tiocexcl(&file)?;
        Ok(Self(file))
    }
}

impl Drop for Claim {
    /// Lets others open the port again where somebody else keeps it open.
    fn drop(&mut self) {
        let _ = ioctl_tiocnxcl(&self.0);
    }
}

/// Has an adapter hand octets over at once, if it has a timer for that: the drivers of FTDI's chips
/// collect for 16 ms unless told otherwise. Setting it needs rights that few programs have; a timer
/// that stays is told.
pub(crate) fn hurry(path: &Path) -> Option<Notice> {
    let device = fs::canonicalize(path).ok()?;
    let timer = Path::new("/sys/class/tty").join(device.file_name()?).join("device/latency_timer");
    hurry_timer(&timer)
}

fn hurry_timer(timer: &Path) -> Option<Notice> {
    let milliseconds = || fs::read_to_string(timer).ok()?.trim().parse::<u16>().ok();
    if milliseconds()? > 1 {
        // Whether it helped is read back.
        let _ = fs::write(timer, "1");
    }
    let milliseconds = milliseconds().filter(|milliseconds| *milliseconds > 1)?;
    Some(Notice::AdapterHoldsBack { milliseconds })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_timer_is_set_to_a_millisecond_where_there_is_one() {
        let folder = tempfile::tempdir().unwrap();
        let timer = folder.path().join("latency_timer");
        assert_eq!(hurry_timer(&timer), None);
        fs::write(&timer, "16\n").unwrap();
        assert_eq!(hurry_timer(&timer), None);
        assert_eq!(fs::read_to_string(&timer).unwrap(), "1");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_timer_that_stays_is_told() {
        // A number of the kernel that nobody may write, whatever the rights.
        let timer = Path::new("/proc/sys/kernel/cap_last_cap");
        let milliseconds = fs::read_to_string(timer).unwrap().trim().parse().unwrap();
        assert_eq!(hurry_timer(timer), Some(Notice::AdapterHoldsBack { milliseconds }));
    }
}

//! What the hardware behind a serial port must do besides: switch a transmitter, and hurry. Both are
//! tried and told, and neither is needed everywhere.

use std::fs::{self, File};
use std::path::Path;

use crate::Notice;

/// Has the driver switch the transmitter of the line (Linux: `TIOCSRS485`). A port that is set up
/// for RS-485 already, by the device tree or by hand, keeps its polarity and its delays.
#[cfg(target_os = "linux")]
pub(super) fn switch_transmitter(file: &File) -> Option<Notice> {
    use serial2::SerialPort;
    use serial2::rs4xx::{Rs485Config, TransceiverMode};
    use std::os::fd::OwnedFd;

    let switched =
        file.try_clone().map(|file| SerialPort::from(OwnedFd::from(file))).and_then(|port| {
            match port.get_rs4xx_mode()? {
                TransceiverMode::Rs485(_) => Ok(()),
                _ => port.set_rs4xx_mode(Rs485Config::new()),
            }
        });
    let reason = switched.err()?.to_string();
    Some(Notice::TransmitterNotSwitched { reason })
}

#[cfg(not(target_os = "linux"))]
pub(super) fn switch_transmitter(_: &File) -> Option<Notice> {
    Some(Notice::TransmitterNotSwitched { reason: "this system knows none".to_owned() })
}

/// Has an adapter hand octets over at once, if it has a timer for that: the drivers of FTDI's chips
/// collect for 16 ms unless told otherwise. Setting it needs rights that few programs have; a timer
/// that stays is told.
pub(super) fn hurry(path: &Path) -> Option<Notice> {
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

    #[test]
    fn a_file_that_is_no_terminal_has_no_transmitter_to_switch() {
        let file = tempfile::tempfile().unwrap();
        assert!(matches!(switch_transmitter(&file), Some(Notice::TransmitterNotSwitched { .. })));
    }
}

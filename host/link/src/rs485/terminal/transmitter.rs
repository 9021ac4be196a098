//! What the hardware behind a serial port must do besides: switch the transmitter of the line. It is
//! tried and told, and not needed everywhere.

use std::fs::File;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_terminal_has_no_transmitter_to_switch() {
        let file = tempfile::tempfile().unwrap();
        assert!(matches!(switch_transmitter(&file), Some(Notice::TransmitterNotSwitched { .. })));
    }
}

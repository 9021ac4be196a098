//! What the kernel hands over: frames, and error frames that report what the controller does.
//!
//! Source: Linux, `include/uapi/linux/can.h` (`struct can_frame`, 16 octets in the machine's order)
//! and `include/uapi/linux/can/error.h`.

use codewheel_station::can::{Frame, Identifier};

use crate::ControllerState;

/// The octets of a `can_frame`.
pub(super) const LENGTH: usize = 16;

/// `CAN_EFF_FLAG`: an identifier of 29 bits.
const EXTENDED: u32 = 0x8000_0000;
/// `CAN_RTR_FLAG`.
const REMOTE: u32 = 0x4000_0000;
/// `CAN_ERR_FLAG`.
const ERROR: u32 = 0x2000_0000;

/// `CAN_ERR_CRTL`: the controller has problems, see octet 1 of the data.
const CONTROLLER: u32 = 0x004;
/// `CAN_ERR_BUSOFF`.
const BUS_OFF: u32 = 0x040;
/// `CAN_ERR_RESTARTED`.
const RESTARTED: u32 = 0x100;

/// The kinds of error frames that are asked for.
pub(super) const ERRORS: u32 = CONTROLLER | BUS_OFF | RESTARTED;

/// What a `can_frame` says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Said {
    Frame(Frame),
    Controller(Report),
}

/// What an error frame reports; several things at once are possible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Report {
    pub(super) bus_off: bool,
    pub(super) restarted: bool,
    /// Frames that arrived were lost for want of room.
    pub(super) overrun: bool,
    /// The state that the controller has come to.
    pub(super) state: Option<ControllerState>,
}

/// The `can_frame` of `frame`.
pub(super) fn encode(frame: &Frame) -> [u8; LENGTH] {
    let identifier = match frame.identifier() {
        Identifier::Standard(bits) => u32::from(bits),
        Identifier::Extended(bits) => bits | EXTENDED,
    };
    let remote = if frame.is_remote() { REMOTE } else { 0 };
    let mut octets = [0; LENGTH];
    let (head, data) = octets.split_at_mut(8);
    for (to, from) in head.iter_mut().zip((identifier | remote).to_ne_bytes()) {
        *to = from;
    }
    if let Some(length) = head.get_mut(4) {
        *length = frame.length() as u8;
    }
    for (to, from) in data.iter_mut().zip(frame.data()) {
        *to = *from;
    }
    octets
}

/// Reads a `can_frame`; `None` where it is none.
pub(super) fn decode(octets: &[u8]) -> Option<Said> {
    let (head, data) = octets.split_first_chunk::<8>()?;
    let [a, b, c, d, length, ..] = *head;
    let identifier = u32::from_ne_bytes([a, b, c, d]);
    let data: &[u8; 8] = data.try_into().ok()?;
    if identifier & ERROR != 0 {
        return Some(Said::Controller(report(identifier, data)));
    }
    let length = usize::from(length);
    let bits = if identifier & EXTENDED != 0 {
        Identifier::Extended(identifier & 0x1FFF_FFFF)
    } else {
        Identifier::Standard((identifier & 0x7FF) as u16)
    };
    let frame = if identifier & REMOTE != 0 {
        Frame::remote(bits, length)
    } else {
        Frame::new(bits, data.get(..length)?)
    };
    frame.ok().map(Said::Frame)
}

fn report(class: u32, data: &[u8; 8]) -> Report {
    let problems = if class & CONTROLLER != 0 { data[1] } else { 0 };
    Report {
        bus_off: class & BUS_OFF != 0,
        restarted: class & RESTARTED != 0,
        overrun: problems & 0x01 != 0,
        state: match problems {
            problems if problems & 0x30 != 0 => Some(ControllerState::Passive),
            problems if problems & 0x0C != 0 => Some(ControllerState::Warning),
            problems if problems & 0x40 != 0 => Some(ControllerState::Active),
            _ => None,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn error(class: u32, problems: u8) -> Report {
        let mut octets = [0; LENGTH];
        octets[..4].copy_from_slice(&(class | ERROR).to_ne_bytes());
        octets[4] = 8;
        octets[9] = problems;
        match decode(&octets) {
            Some(Said::Controller(report)) => report,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn error_frames_tell_what_became_of_the_controller() {
        let none = Report::default();
        assert_eq!(error(BUS_OFF, 0), Report { bus_off: true, ..none });
        assert_eq!(error(RESTARTED, 0), Report { restarted: true, ..none });
        assert_eq!(error(CONTROLLER, 0x01), Report { overrun: true, ..none });
        for (problems, state) in [
            (0x04, ControllerState::Warning),
            (0x08, ControllerState::Warning),
            (0x10, ControllerState::Passive),
            (0x24, ControllerState::Passive),
            (0x40, ControllerState::Active),
        ] {
            assert_eq!(error(CONTROLLER, problems), Report { state: Some(state), ..none });
        }
        // Octet 1 means something in this class alone.
        assert_eq!(error(0x008, 0x10), none);
    }

    #[test]
    fn what_is_no_classic_frame_is_none() {
        let mut octets = encode(&Frame::standard(0x3C5, &[1, 2]));
        octets[4] = 9;
        assert_eq!(decode(&octets), None);
        assert_eq!(decode(&octets[..15]), None);
        assert_eq!(decode(&[0; 72]), None);
        assert_eq!(decode(&[]), None);
    }

    proptest! {
        #[test]
        fn a_frame_survives_the_kernels_form(
            bits in 0_u32..0x2000_0000, wide: bool, remote: bool,
            data in proptest::collection::vec(any::<u8>(), 0..=8),
        ) {
            let identifier = match wide {
                true => Identifier::Extended(bits),
                false => Identifier::Standard((bits & 0x7FF) as u16),
            };
            let frame = match remote {
                true => Frame::remote(identifier, data.len()),
                false => Frame::new(identifier, &data),
            }
            .unwrap();
            prop_assert_eq!(decode(&encode(&frame)), Some(Said::Frame(frame)));
        }
    }
}

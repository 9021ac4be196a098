//! What the kernel knows of a CAN interface: asked over rtnetlink, which every user may.
//!
//! Source: rtnetlink(7) and Linux, `include/uapi/linux/if_link.h` and
//! `include/uapi/linux/can/netlink.h`. All numbers are in the machine's order.

use std::io;

use rustix::net::{
    AddressFamily, RecvFlags, SendFlags, SocketFlags, SocketType, recv, send, socket_with,
};

/// `RTM_GETLINK`.
const ASK: u16 = 18;
/// `RTM_NEWLINK`.
const ANSWER: u16 = 16;
/// `NLMSG_ERROR`.
const ERROR: u16 = 2;
/// `NLM_F_REQUEST`.
const REQUEST: u16 = 1;

/// `ARPHRD_CAN`.
const CAN: u16 = 280;
/// `IFF_UP`.
const UP: u32 = 1;

/// `IFLA_IFNAME`.
const NAME: u16 = 3;
/// `IFLA_LINKINFO`, and in it `IFLA_INFO_KIND` and `IFLA_INFO_DATA`.
const LINK_INFO: u16 = 18;
const KIND: u16 = 1;
const DATA: u16 = 2;
/// In `IFLA_INFO_DATA`: `IFLA_CAN_BITTIMING`, `_STATE`, `_CTRLMODE` and `_RESTART_MS`.
const BIT_TIMING: u16 = 1;
const STATE: u16 = 4;
const CONTROL_MODE: u16 = 5;
const RESTART: u16 = 6;

/// `CAN_STATE_BUS_OFF`.
const BUS_OFF: u32 = 3;
/// `CAN_CTRLMODE_LISTENONLY`.
const LISTEN_ONLY: u32 = 2;

/// A CAN interface as the kernel knows it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Interface {
    /// Its number, greater than 0.
    pub(super) index: u32,
    pub(super) is_can: bool,
    pub(super) is_up: bool,
    /// `can`, `vcan`, `vxcan`; empty where the driver says nothing.
    pub(super) kind: String,
    /// In bits per second, where it has a rate.
    pub(super) bit_rate: Option<u32>,
    pub(super) is_bus_off: bool,
    pub(super) listens_only: bool,
    /// Whether the controller restarts by itself after a bus-off.
    pub(super) restarts: bool,
}

/// Asks the kernel for `interface`.
///
/// # Errors
/// What the kernel said; `ENODEV` where there is none of this name.
pub(super) fn look_up(interface: &str) -> io::Result<Interface> {
    // Without a number it is protocol 0, NETLINK_ROUTE.
    let socket = socket_with(AddressFamily::NETLINK, SocketType::RAW, SocketFlags::CLOEXEC, None)?;
    send(&socket, &question(interface), SendFlags::empty())?;
    let mut buffer = vec![0; 32 * 1024];
    let (_, length) = recv(&socket, buffer.as_mut_slice(), RecvFlags::empty())?;
    understand(buffer.get(..length).unwrap_or_default())
}

/// `RTM_GETLINK` with the name as its one attribute.
fn question(interface: &str) -> Vec<u8> {
    let mut name = interface.as_bytes().to_vec();
    name.push(0);
    let attribute = (4 + name.len()) as u16;
    name.resize(name.len().next_multiple_of(4), 0);
    let length = (16 + 16 + 4 + name.len()) as u32;
    let mut octets = length.to_ne_bytes().to_vec();
    octets.extend(ASK.to_ne_bytes());
    octets.extend(REQUEST.to_ne_bytes());
    // Number and sender, then `struct ifinfomsg`: none of it matters in a question by name.
    octets.extend([0; 8 + 16]);
    octets.extend(attribute.to_ne_bytes());
    octets.extend(NAME.to_ne_bytes());
    octets.extend(name);
    octets
}

fn understand(octets: &[u8]) -> io::Result<Interface> {
    let nonsense = || io::Error::new(io::ErrorKind::InvalidData, "the kernel's answer is unknown");
    let kind = u16_at(octets, 4).ok_or_else(nonsense)?;
    match kind {
        ERROR => {
            let errno = u32_at(octets, 16).ok_or_else(nonsense)?.cast_signed();
            Err(io::Error::from_raw_os_error(errno.wrapping_neg()))
        }
        ANSWER => read(octets).ok_or_else(nonsense),
        _ => Err(nonsense()),
    }
}

/// Reads the answer: a head of 16 octets, `struct ifinfomsg`, attributes.
fn read(octets: &[u8]) -> Option<Interface> {
    let mut interface = Interface {
        index: u32_at(octets, 20)?,
        is_can: u16_at(octets, 18)? == CAN,
        is_up: u32_at(octets, 24)? & UP != 0,
        ..Interface::default()
    };
    let Some(info) = attribute(octets.get(32..)?, LINK_INFO) else { return Some(interface) };
    if let Some(kind) = attribute(info, KIND) {
        let kind = kind.split(|octet| *octet == 0).next().unwrap_or_default();
        interface.kind = String::from_utf8_lossy(kind).into_owned();
    }
    if let Some(data) = attribute(info, DATA) {
        let number = |kind, place| attribute(data, kind).and_then(|value| u32_at(value, place));
        interface.bit_rate = number(BIT_TIMING, 0).filter(|rate| *rate > 0);
        interface.is_bus_off = number(STATE, 0) == Some(BUS_OFF);
        interface.listens_only =
            number(CONTROL_MODE, 4).is_some_and(|mode| mode & LISTEN_ONLY != 0);
        interface.restarts = number(RESTART, 0).is_some_and(|pause| pause > 0);
    }
    Some(interface)
}

/// The value of the first attribute of this kind.
fn attribute(mut octets: &[u8], kind: u16) -> Option<&[u8]> {
    loop {
        let length = usize::from(u16_at(octets, 0)?);
        // The two highest bits are flags.
        let found = u16_at(octets, 2)? & 0x3FFF;
        let value = octets.get(4..length)?;
        if found == kind {
            return Some(value);
        }
        octets = octets.get(length.next_multiple_of(4)..)?;
    }
}

fn u16_at(octets: &[u8], place: usize) -> Option<u16> {
    octets.get(place..)?.first_chunk().map(|octets| u16::from_ne_bytes(*octets))
}

fn u32_at(octets: &[u8], place: usize) -> Option<u32> {
    octets.get(place..)?.first_chunk().map(|octets| u32::from_ne_bytes(*octets))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn wrap(kind: u16, value: &[u8]) -> Vec<u8> {
        let mut octets = ((4 + value.len()) as u16).to_ne_bytes().to_vec();
        octets.extend(kind.to_ne_bytes());
        octets.extend(value);
        octets.resize(octets.len().next_multiple_of(4), 0);
        octets
    }

    fn answer(info: &[Vec<u8>]) -> Vec<u8> {
        let mut octets = vec![0; 32];
        octets[4..6].copy_from_slice(&ANSWER.to_ne_bytes());
        octets[18..20].copy_from_slice(&CAN.to_ne_bytes());
        octets[20..24].copy_from_slice(&7_u32.to_ne_bytes());
        octets[24..28].copy_from_slice(&0x0001_00C1_u32.to_ne_bytes());
        octets.extend(wrap(NAME, b"can0\0"));
        octets.extend(wrap(LINK_INFO, &info.concat()));
        octets
    }

    fn numbers(numbers: &[u32]) -> Vec<u8> {
        numbers.iter().flat_map(|number| number.to_ne_bytes()).collect()
    }

    #[test]
    fn the_loopback_of_this_machine_is_no_can() {
        let loopback = look_up("lo").unwrap();
        assert!(!loopback.is_can && loopback.index > 0);
        let missing = look_up("no-such-can").unwrap_err();
        assert_eq!(missing.raw_os_error(), Some(19), "ENODEV: {missing}");
    }

    #[test]
    fn a_controller_tells_rate_state_and_restart() {
        let data = [
            wrap(BIT_TIMING, &numbers(&[500_000, 875, 125, 6, 7, 2, 1, 1])),
            wrap(3, &numbers(&[8_000_000])),
            wrap(STATE, &numbers(&[BUS_OFF])),
            wrap(CONTROL_MODE, &numbers(&[0, LISTEN_ONLY])),
            wrap(RESTART, &numbers(&[100])),
        ];
        let found = understand(&answer(&[wrap(KIND, b"can\0"), wrap(DATA, &data.concat())]));
        let expected = Interface {
            index: 7,
            is_can: true,
            is_up: true,
            kind: "can".to_owned(),
            bit_rate: Some(500_000),
            is_bus_off: true,
            listens_only: true,
            restarts: true,
        };
        assert_eq!(found.unwrap(), expected);
    }

    #[test]
    fn a_virtual_interface_has_neither_rate_nor_state() {
        let found = understand(&answer(&[wrap(KIND, b"vcan")])).unwrap();
        assert_eq!((found.kind.as_str(), found.bit_rate, found.is_bus_off), ("vcan", None, false));
    }

    proptest! {
        #[test]
        fn any_answer_whatever_is_read_without_harm(
            octets in proptest::collection::vec(prop_oneof![Just(0), Just(4), any::<u8>()], 0..120),
        ) {
            let _ = understand(&octets);
            let mut octets = octets;
            octets.splice(0..0, answer(&[]).into_iter().take(32));
            prop_assert!(understand(&octets).is_ok());
        }
    }
}

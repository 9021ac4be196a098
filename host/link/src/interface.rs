//! What can be wrong with a CAN interface, and what to type.

use std::io;

use codewheel_station::can::BitRate;

use crate::error::phrase;

/// Why a CAN interface cannot be used as it is. Setting one up is for the administrator, so each
/// tells what to type.
#[derive(Debug)]
#[non_exhaustive]
pub enum InterfaceTrouble {
    /// There is no interface of this name.
    Missing,
    /// There is one, and it carries no CAN.
    NoCan,
    /// It is down.
    Down {
        /// The rate that the bus is to have; `None` for an interface that has none, as `vcan` ones.
        rate: Option<BitRate>,
    },
    /// It runs at another bit rate.
    OtherBitRate {
        /// The rate that the bus is to have.
        asked: BitRate,
        /// What it has, in bits per second.
        actual: u32,
    },
    /// Its controller listens and neither speaks nor acknowledges.
    ListensOnly {
        /// The rate that the bus is to have.
        rate: BitRate,
    },
    /// Its controller is bus-off, and does not restart by itself.
    BusOff,
    /// The system says so.
    System(io::Error),
}

impl InterfaceTrouble {
    /// What is wrong with `interface`, and what to type.
    pub(crate) fn phrase(&self, interface: &str) -> String {
        match self {
            Self::Missing => format!(
                "there is none of this name: plug the adapter in and look for its name with ip \
                 link; for a virtual one type: sudo ip link add dev {interface} type vcan && sudo \
                 ip link set {interface} up"
            ),
            Self::NoCan => "it carries no CAN: look for the one that does with ip link".to_owned(),
            Self::Down { rate: None } => {
                format!("it is down; type: sudo ip link set {interface} up")
            }
            Self::Down { rate: Some(rate) } => {
                format!("it is down; type: {}", up(interface, *rate))
            }
            Self::OtherBitRate { asked, actual } => format!(
                "it runs at {actual} bit/s and the bus is to have {}; take that rate, or type: sudo \
                 ip link set {interface} down && {}",
                asked.bits_per_second(),
                up(interface, *asked)
            ),
            Self::ListensOnly { rate } => format!(
                "it only listens, and a device must speak; type: sudo ip link set {interface} down \
                 && {} listen-only off",
                up(interface, *rate)
            ),
            Self::BusOff => format!(
                "its controller is bus-off: check bit rate, termination and wiring, and type: sudo \
                 ip link set {interface} type can restart"
            ),
            Self::System(reason) => {
                format!("{}; look at it with ip -details link show {interface}", phrase(reason))
            }
        }
    }
}

/// How an interface is set up.
fn up(interface: &str, rate: BitRate) -> String {
    let rate = rate.bits_per_second();
    format!("sudo ip link set {interface} up type can bitrate {rate} restart-ms 100")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinkError;

    fn said(trouble: InterfaceTrouble) -> String {
        LinkError::Interface { interface: "can0".to_owned(), trouble }.to_string()
    }

    #[test]
    fn each_trouble_says_exactly_what_to_type() {
        let rate = BitRate::Kbit500;
        assert_eq!(
            said(InterfaceTrouble::Missing),
            "cannot use the CAN interface can0: there is none of this name: plug the adapter in and \
             look for its name with ip link; for a virtual one type: sudo ip link add dev can0 type \
             vcan && sudo ip link set can0 up"
        );
        assert_eq!(
            said(InterfaceTrouble::Down { rate: Some(rate) }),
            "cannot use the CAN interface can0: it is down; type: sudo ip link set can0 up type can \
             bitrate 500000 restart-ms 100"
        );
        assert_eq!(
            said(InterfaceTrouble::Down { rate: None }),
            "cannot use the CAN interface can0: it is down; type: sudo ip link set can0 up"
        );
        assert_eq!(
            said(InterfaceTrouble::OtherBitRate { asked: rate, actual: 125_000 }),
            "cannot use the CAN interface can0: it runs at 125000 bit/s and the bus is to have \
             500000; take that rate, or type: sudo ip link set can0 down && sudo ip link set can0 \
             up type can bitrate 500000 restart-ms 100"
        );
        assert!(
            said(InterfaceTrouble::ListensOnly { rate })
                .ends_with("can bitrate 500000 restart-ms 100 listen-only off")
        );
        assert!(said(InterfaceTrouble::BusOff).ends_with("sudo ip link set can0 type can restart"));
    }
}

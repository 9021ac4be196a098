//! A CAN interface of this machine.

use codewheel_link::{BusUri, InterfaceTrouble, LinkError, Notice, Received, open};
use codewheel_station::can::BitRate;

use super::finding::Finding;

/// Whether the interface can carry DeviceNet. Opening it sends nothing.
pub(super) fn look_at(bus: &BusUri, name: &str) -> Finding {
    let asked = BitRate::Kbit125;
    let mut port = match open(bus, asked) {
        Ok(port) => port,
        Err(LinkError::Interface {
            trouble: InterfaceTrouble::OtherBitRate { actual, .. },
            ..
        }) => return at(name, actual),
        Err(error) => return Finding::cannot("CAN interface", error.to_string()),
    };
    let mut is_unknown = false;
    while let Ok(Some(received)) = port.receive(Some(std::time::Duration::ZERO)) {
        if let Received::Notice(Notice::BitRateUnknown { .. }) = received {
            is_unknown = true;
            break;
        }
    }
    if is_unknown {
        let says = format!("{name} is up and does not tell its bit rate, as virtual ones do");
        return Finding::fine("CAN interface", says);
    }
    at(name, asked.bits_per_second())
}

/// An interface that is up at `actual` bit/s.
fn at(name: &str, actual: u32) -> Finding {
    let says = format!("{name} is up at {actual} bit/s");
    let known = BitRate::ALL.into_iter().find(|rate| rate.bits_per_second() == actual);
    let finding = match known {
        Some(rate) => Finding::fine("CAN interface", format!("{says}: use --baud {rate}")),
        None => Finding::trouble("CAN interface", format!("{says}, which DeviceNet does not know"))
            .remedy(format!(
                "type: sudo ip link set {name} down && sudo ip link set {name} up type can \
                 bitrate 125000 restart-ms 100"
            )),
    };
    finding.values(serde_json::json!({ "bit_rate": actual }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::finding::State;

    #[test]
    fn a_rate_that_devicenet_knows_is_fine_and_another_one_is_a_finding() {
        let finding = at("can0", 250_000);
        assert_eq!(finding.state, State::Fine);
        assert_eq!(finding.says, "can0 is up at 250000 bit/s: use --baud 250k");
        let finding = at("can0", 1_000_000);
        assert_eq!(finding.state, State::Finding);
        assert!(finding.remedy.is_some_and(|remedy| remedy.contains("can bitrate 125000")));
    }
}

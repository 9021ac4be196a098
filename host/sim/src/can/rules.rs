//! Rules that stations must keep, beside those every wire holds by itself.

use codewheel_station::can::{Frame, Identifier};

/// A rule: given a frame that went over the wire and the name of its sender, what the sender did
/// wrong, as words that read on from its name; `None` where it did right. Frames come in the order
/// of the wire.
pub type Rule = Box<dyn FnMut(&Frame, &str) -> Option<String> + Send>;

/// DeviceNet: a station speaks under its own MAC ID only.
///
/// `mac_of` gives the MAC ID of a station by its name, `None` for one that may say anything.
/// Judged are the identifiers that carry their source: groups 1 and 3, and of group 2 the messages
/// 0 (bit-strobe command), 3 (response) and 7 (duplicate MAC ID check). The other messages of
/// group 2 carry their destination (IEC 62026-3, 5.2).
pub fn source_mac(mac_of: impl Fn(&str) -> Option<u8> + Send + 'static) -> Rule {
    Box::new(move |frame, sender| {
        let source = source_of(frame)?;
        let own = mac_of(sender)?;
        (source != own).then(|| {
            format!("sends {frame} with the source MAC ID {source}, but its own MAC ID is {own}")
        })
    })
}

fn source_of(frame: &Frame) -> Option<u8> {
    let Identifier::Standard(identifier) = frame.identifier() else {
        return None;
    };
    let low_six = (identifier & 0x3F) as u8;
    let group_2_mac = (identifier >> 3 & 0x3F) as u8;
    match identifier {
        0x000..=0x3FF | 0x600..=0x7BF => Some(low_six),
        0x400..=0x5FF if matches!(identifier & 7, 0 | 3 | 7) => Some(group_2_mac),
        _ => None,
    }
}

/// What every wire of this laboratory asks of a frame.
pub(super) fn frame_breaks(frame: &Frame) -> Option<String> {
    match frame.identifier() {
        Identifier::Extended(_) => {
            Some(format!("sends {frame}: DeviceNet has no 29-bit identifiers"))
        }
        _ if frame.is_remote() => Some(format!("sends {frame}: DeviceNet has no remote frames")),
        Identifier::Standard(0x7F0..) => {
            Some(format!("sends {frame}: the identifiers 7F0 to 7FF are invalid"))
        }
        Identifier::Standard(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_source_stands_where_the_group_says() {
        let source = |identifier| source_of(&Frame::standard(identifier, &[]));
        assert_eq!(source(0x3C5), Some(5), "poll response");
        assert_eq!(source(0x42B), Some(5), "explicit response");
        assert_eq!(source(0x42F), Some(5), "duplicate MAC ID check");
        assert_eq!(source(0x428), Some(5), "bit-strobe command");
        assert_eq!(source(0x42D), None, "poll command");
        assert_eq!(source(0x42E), None, "unconnected request");
        assert_eq!(source(0x745), Some(5), "group 3");
        assert_eq!(source(0x7EC), None, "group 4");
    }

    #[test]
    fn a_stranger_may_say_anything() {
        let mut rule = source_mac(|name| (name == "encoder 5").then_some(5));
        let frame = Frame::standard(0x3C7, &[]);
        assert_eq!(rule(&frame, "tool"), None);
        assert_eq!(
            rule(&frame, "encoder 5").as_deref(),
            Some("sends 3C7# with the source MAC ID 7, but its own MAC ID is 5")
        );
    }
}

//! What is said when a CAN interface cannot be had. Real ones are tried in `strangers/`.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

use codewheel_link::{InterfaceTrouble, LinkError, open};
use codewheel_station::can::BitRate;

fn trouble(uri: &str) -> InterfaceTrouble {
    match open(&uri.parse().unwrap(), BitRate::Kbit125) {
        Err(LinkError::Interface { trouble, .. }) => trouble,
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_interface_that_is_not_there_is_said_with_what_to_type() {
    assert!(matches!(trouble("socketcan:no-such-can"), InterfaceTrouble::Missing));
}

#[test]
fn an_interface_without_can_is_none() {
    assert!(matches!(trouble("socketcan:lo"), InterfaceTrouble::NoCan));
}

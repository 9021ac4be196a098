//! What is said when a line cannot be had.

use codewheel_link::{BusUri, open, open_rs485};
use codewheel_station::can::BitRate;
use codewheel_station::rs485::BaudRate;

fn refusal(uri: &str) -> String {
    let uri: BusUri = uri.parse().unwrap();
    open_rs485(&uri, BaudRate::Kbit500).err().unwrap().to_string()
}

#[test]
fn a_bus_of_another_kind_is_answered_with_the_forms_of_this_one() {
    const RS485: &str = "rs485-listen:HOST:PORT, rs485-listen:pty:PATH, rs485:HOST:PORT or \
                         rs485:/dev/tty… for RS-485";
    const CAN: &str = "socketcan:can0, slcan:/dev/tty…, slcan:HOST:PORT, slcan-listen:HOST:PORT, \
                       slcan-listen:pty:PATH or socketcand-listen:HOST:PORT for CAN";
    for uri in [
        "virtual:lab",
        "slcan:127.0.0.1:4001",
        "slcan-listen:127.0.0.1:0",
        "slcan:/dev/ttyACM0",
        "slcan-listen:pty:./a",
        "socketcan:can0",
        "socketcand-listen:127.0.0.1:0",
    ] {
        let expected = format!("{uri} is no RS-485 bus to connect to: write {RS485}");
        assert_eq!(refusal(uri), expected);
    }
    for uri in [
        "rs485:127.0.0.1:4002",
        "rs485-listen:127.0.0.1:0",
        "rs485:/dev/ttyS0",
        "rs485-listen:pty:./a",
    ] {
        assert_eq!(
            open(&uri.parse().unwrap(), BitRate::Kbit125).err().unwrap().to_string(),
            format!("{uri} is no CAN bus to connect to: write {CAN}")
        );
    }
}

#[test]
fn a_port_that_is_taken_and_one_that_nobody_listens_on_are_said_in_plain_words() {
    let port = open_rs485(&"rs485-listen:127.0.0.1:0".parse().unwrap(), BaudRate::Mbit12).unwrap();
    let address = port.local_address().unwrap();
    let taken = refusal(&port.describe());
    assert!(taken.starts_with(&format!("cannot listen on {address}: address already in use; ")));
    drop(port);
    let nobody = refusal(&format!("rs485:{address}"));
    assert!(nobody.starts_with(&format!("cannot connect to {address}: connection refused; ")));
}

#[cfg(unix)]
#[test]
fn a_path_that_is_no_serial_port_is_said_in_plain_words() {
    let missing = refusal("rs485:/dev/ttyNothing0");
    assert!(missing.starts_with("cannot open the serial port /dev/ttyNothing0: "), "{missing}");
    assert!(missing.ends_with("; plug the adapter in and look in /dev for its name"), "{missing}");
    let no_terminal = refusal("rs485:/dev/null");
    assert!(no_terminal.ends_with("; check that the path is that of a serial port"));
}

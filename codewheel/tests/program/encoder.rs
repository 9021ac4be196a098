//! `codewheel encoder` on its SLCAN port.

use crate::prompt::{Client, Running, codewheel, stderr};

#[cfg(unix)]
use rustix::process::Signal;

#[test]
fn a_client_allocates_and_polls_the_position_of_the_shaft() {
    let (_encoder, address) = Running::encoder("amg11-d29", &["--shaft", "still angle=74565"]);
    let mut client = Client::connect(&address);
    client.allocate();
    assert_eq!(client.ask("100502096400"), "906400");
    client.send("t42D0");
    assert_eq!(client.frame("3C5"), "445230100");
}

#[cfg(unix)]
#[test]
fn what_was_saved_is_there_again_and_what_was_not_is_gone() {
    let folder = tempfile::tempdir().expect("a folder");
    let memory = folder.path().join("memory").display().to_string();
    let more = ["--memory", &memory, "--shaft", "still angle=100000", "--serial", "77"];
    let (encoder, address) = Running::encoder("amg11-d29", &more);
    let mut client = Client::connect(&address);
    client.allocate();
    assert_eq!(client.set(7, 3_600), "90");
    assert_eq!(client.set(8, 921_600), "90");
    assert_eq!(client.set(10, 1_000), "90");
    assert_eq!(client.ask("162F01"), "96");
    assert_eq!(client.set(11, 77), "90");
    encoder.signal(Signal::TERM);
    assert_eq!(encoder.end().0.code(), Some(0));

    // Another model has no business with this memory.
    let other = [
        "encoder",
        "hmg10-d13",
        "--bus",
        "slcan-listen:127.0.0.1:0",
        "--address",
        "5",
        "--memory",
        &memory,
    ];
    let output = codewheel(&other);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("belongs to amg11-d29, this is hmg10-d13"));

    // The serial number is kept too.
    let (_encoder, address) = Running::encoder("amg11-d29", &more[..4]);
    let mut client = Client::connect(&address);
    client.allocate();
    assert_eq!(client.ask("0E2F0107"), "8E100E0000");
    assert_eq!(client.ask("0E2F0108"), "8E00100E00");
    assert_eq!(client.ask("0E2F010C"), "8EE8030000");
    assert_eq!(client.ask("0E2F010B"), "8E01000000");
    assert_eq!(client.ask("0E010106"), "8E4D000000");
}

#[cfg(unix)]
#[test]
fn a_damaged_memory_is_set_aside_reported_and_never_lost() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("memory");
    std::fs::write(&path, b"this is not a memory").expect("written");
    let memory = path.display().to_string();
    let (encoder, address) = Running::encoder("amg11-d29", &["--memory", &memory]);
    let mut client = Client::connect(&address);
    client.allocate();
    // Minor recoverable fault and owned, until the next good Save.
    assert_eq!(client.ask("0E010105"), "8E0101");
    assert_eq!(client.ask("162F01"), "96");
    assert_eq!(client.ask("0E010105"), "8E0100");
    encoder.signal(Signal::INT);
    let (status, messages) = encoder.end();
    assert_eq!(status.code(), Some(0));
    let aside = folder.path().join("memory.damaged");
    assert!(messages.contains(&aside.display().to_string()), "{messages}");
    assert_eq!(std::fs::read(aside).expect("kept"), b"this is not a memory");
}

#[test]
fn a_fault_of_the_command_line_happens_at_its_time() {
    let faults = ["--fault", "jump steps=4000 at=100ms", "--fault", "power-cut at=300ms for=1ms"];
    let more = [&["--shaft", "turn rpm=1"], &faults[..]].concat();
    let (mut encoder, _) = Running::encoder("amg11-d29", &more);
    let mut messages = vec![encoder.message(), encoder.message()];
    assert!(messages[0].ends_with("fault: the code jumps by 4000 steps"), "{messages:?}");
    assert!(messages[1].ends_with("position error: the code jumped"), "{messages:?}");
    messages = vec![encoder.message(), encoder.message()];
    assert!(messages[0].ends_with("fault: the power is cut for 1ms"), "{messages:?}");
    assert!(messages[1].ends_with("fault over: the power is cut for 1ms"), "{messages:?}");
}

#[test]
fn garbage_from_one_client_disturbs_no_other() {
    let (_encoder, address) = Running::encoder("hmg10-d13", &[]);
    let mut client = Client::connect(&address);
    client.allocate();
    let mut vandal = std::net::TcpStream::connect(&address).expect("the encoder listens");
    let noise: Vec<u8> =
        (0..200_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    std::thread::spawn(move || std::io::Write::write_all(&mut vandal, &noise));
    for _ in 0..50 {
        assert_eq!(client.ask("0E2F0151"), "8E00200000");
    }
}

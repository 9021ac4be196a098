//! `codewheel encoder` for PROFIBUS models, with a master at the other end of its pty or TCP port.

use std::time::{Duration, Instant};

use codewheel_link::Clock;
use codewheel_plant::{AnyBusPlan, Plant, PortBus, Profibus, SlaveSnapshot, SlaveState};

use crate::prompt::Running;

/// A DP master on a bus of its own.
struct Master {
    bus: PortBus<Profibus>,
    clock: Clock,
}

impl Master {
    /// A master at `uri`, which serves address 7 as `slave` says.
    fn connect(uri: &str, baud: &str, slave: &str) -> Self {
        let text = format!(
            "[[bus]]\nname = \"b\"\nkind = \"profibus\"\nuri = '{uri}'\nbaud = \"{baud}\"\n\
             [[master]]\naddress = 2\nwatchdog = \"5s\"\nslave = [{{ address = 7, {slave} }}]\n"
        );
        let plant = Plant::parse(&text, "master", std::path::Path::new(""));
        let mut buses = plant.unwrap_or_else(|complaint| panic!("{complaint}")).buses;
        let Some(AnyBusPlan::Profibus(plan)) = buses.pop() else { panic!("a PROFIBUS") };
        let clock = Clock::new();
        Self { bus: PortBus::power_up(plan, clock).expect("the encoder is there"), clock }
    }

    /// Runs until the slave is as `wanted`; how it is then.
    #[track_caller]
    fn until(&mut self, wanted: impl Fn(&SlaveSnapshot) -> bool) -> SlaveSnapshot {
        let deadline = Instant::now() + Duration::from_secs(30);
        loop {
            let soon = self.clock.now() + codewheel_station::Duration::from_millis(10);
            self.bus.turn(Some(soon)).expect("the encoder is there");
            let snapshot = self.bus.snapshot();
            let (_, slave) = snapshot.masters[0].slaves[0];
            if wanted(&slave) {
                return slave;
            }
            assert!(Instant::now() < deadline, "{snapshot:#?}");
        }
    }
}

fn exchanges(slave: &SlaveSnapshot) -> bool {
    slave.state == SlaveState::Running && slave.position.is_some()
}

fn alarm(slave: &SlaveSnapshot) -> bool {
    slave.diagnosis.is_some_and(|diagnosis| diagnosis.alarm)
}

#[test]
fn on_a_pty_it_exchanges_data_takes_a_preset_and_tells_a_code_jump_for_two_and_a_half_seconds() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("pb");
    let bus = format!("rs485-listen:pty:{}", path.display());
    let arguments = ["encoder", "amg11-p29", "--bus", &bus, "--address", "7", "--baud", "19200"];
    let more = ["--shaft", "still angle=1000", "--fault", "jump steps=4000 at=6s"];
    let mut encoder = Running::start(&[&arguments[..], &more].concat());
    assert_eq!(encoder.line(), format!("ready amg11-p29 address 7 on {bus}"));

    let preset = "preset = [{ at = \"2s\", value = 42 }]";
    let mut master = Master::connect(&format!("rs485:{}", path.display()), "19.2k", preset);
    assert_eq!(master.until(exchanges).position, Some(1_000));
    let slave = master.until(|slave| slave.position == Some(42));
    assert!(!alarm(&slave));
    let slave = master.until(alarm);
    let began = Instant::now();
    assert_eq!(slave.state, SlaveState::Running);
    assert_eq!(master.until(|slave| slave.position != Some(42)).position, Some(4_042));
    master.until(|slave| !alarm(slave));
    let lasted = began.elapsed();
    assert!(
        (Duration::from_millis(2_300)..Duration::from_millis(2_900)).contains(&lasted),
        "{lasted:?}"
    );
    let message = encoder.message();
    assert!(message.ends_with("fault: the code jumps by 4000 steps"), "{message}");
    assert!(encoder.message().ends_with("position error: the code jumped"));

    encoder.signal(rustix::process::Signal::TERM);
    let (status, messages) = encoder.end();
    assert_eq!(status.code(), Some(0), "{messages}");
    assert!(!path.exists(), "the pty is cleaned up");
}

#[test]
fn a_preset_is_there_again_with_its_parameters_after_a_new_start() {
    let folder = tempfile::tempdir().expect("a folder");
    let memory = folder.path().join("memory").display().to_string();
    let start = || {
        let bus = ["encoder", "amg11-p29", "--bus", "rs485-listen:127.0.0.1:0", "--address", "7"];
        let more = ["--shaft", "still angle=1000", "--memory", &memory];
        let mut encoder = Running::start(&[&bus[..], &more].concat());
        let line = encoder.line();
        let address = line.strip_prefix("ready amg11-p29 address 7 on rs485-listen:");
        let uri = format!("rs485:{}", address.unwrap_or_else(|| panic!("not ready: {line:?}")));
        (encoder, uri)
    };
    let (encoder, uri) = start();
    let scaled = "steps_per_turn = 3600, total_resolution = 921600";
    let preset = format!("{scaled}, preset = [{{ at = \"500ms\", value = 42 }}]");
    let mut master = Master::connect(&uri, "1.5M", &preset);
    master.until(|slave| slave.position == Some(42));
    drop(master);
    encoder.signal(rustix::process::Signal::INT);
    assert_eq!(encoder.end().0.code(), Some(0));

    let (_encoder, uri) = start();
    let slave = Master::connect(&uri, "1.5M", scaled).until(exchanges);
    assert_eq!(slave.position, Some(42));
    let offset = slave.diagnosis.and_then(|diagnosis| diagnosis.offset);
    assert_eq!(offset, Some(42 - 1_000 * 3_600 / 8_192));
}

#[test]
fn refused_parameters_are_explained_on_stderr() {
    let bus = ["encoder", "amg11-p29", "--bus", "rs485-listen:127.0.0.1:0", "--address", "7"];
    let mut encoder = Running::start(&bus);
    let line = encoder.line();
    let address = line.rsplit_once(" on rs485-listen:").expect("ready").1;
    let scaled = "steps_per_turn = 3600, total_resolution = 536870912";
    let mut master = Master::connect(&format!("rs485:{address}"), "12M", scaled);
    master.until(|slave| slave.state == SlaveState::Refused);
    let message = encoder.message();
    let sentence = "parameters refused: Set_Prm octets 14–17: total resolution 536870912 exceeds \
                    3600 × 65536 = 235929600";
    assert!(message.ends_with(sentence), "{message}");
}

#[test]
fn a_converter_plays_its_ssi_encoder_too() {
    let bus = ["encoder", "heag162-p29", "--bus", "rs485-listen:127.0.0.1:0", "--address", "7"];
    let more = [
        "--ssi-word",
        "25",
        "--ssi-code",
        "binary",
        "--shaft",
        "still angle=4095turns",
        "--fault",
        "ssi-unplugged at=3s",
    ];
    let mut encoder = Running::start(&[&bus[..], &more].concat());
    let line = encoder.line();
    let address = line.rsplit_once(" on rs485-listen:").expect("ready").1;
    let mut master = Master::connect(&format!("rs485:{address}"), "1.5M", "scaling = false");
    assert_eq!(master.until(exchanges).position, Some(4_095 * 8_192));
    let slave = master.until(alarm);
    assert_eq!(slave.position, Some(4_095 * 8_192), "held");
    assert!(encoder.message().contains("the SSI encoder is unplugged"));
    assert!(encoder.message().contains("the SSI data line stays high"));
}

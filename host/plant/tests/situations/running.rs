use std::time::{Duration, Instant};

use codewheel_plant::{Plant, StartError, VirtualBus};

use super::{at, example, only_bus, plant};

const PATIENCE: Duration = Duration::from_secs(10);

const TWO_BUSES: &str = r#"
    [[bus]]
    name = "simulated"
    [[bus]]
    name = "real"
    uri = "slcan-listen:127.0.0.1:0"
    [[device]]
    bus = "simulated"
    model = "amg11-d29"
    address = 5
    [[device]]
    bus = "real"
    model = "amg11-d29"
    address = 5
"#;

#[test]
fn in_real_time_snapshots_come_from_all_buses_and_the_threads_end_when_stopped() {
    let running = plant(TWO_BUSES).start(Duration::from_millis(20)).unwrap();
    assert_eq!(running.uris()[0], "virtual:simulated");
    assert!(running.uris()[1].starts_with("slcan-listen:127.0.0.1:"));
    assert!(!running.uris()[1].ends_with(":0"), "the port that the system chose");
    let mut seen = [0; 2];
    let deadline = Instant::now() + PATIENCE;
    while seen.iter().any(|count| *count < 3) {
        assert!(Instant::now() < deadline, "{seen:?}");
        for (place, snapshot) in running.snapshots(PATIENCE) {
            seen[place] += 1;
            assert_eq!(snapshot.name, ["simulated", "real"][place]);
        }
    }
    let (rest, result) = running.stop();
    assert!(result.is_ok());
    assert!(rest.len() <= 2);
}

#[test]
fn what_happened_while_nobody_looked_is_told_later() {
    let running = plant(TWO_BUSES).start(Duration::from_millis(10)).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let snapshots = running.snapshots(PATIENCE);
    assert_eq!(snapshots.len(), 2);
    for (_, snapshot) in snapshots {
        let reports = &snapshot.devices[0].reports;
        assert_eq!(reports[0].what.to_string(), "power up", "{reports:?}");
    }
}

#[test]
fn a_port_that_is_taken_starts_nothing() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let memory = folder.path().join("memory");
    let text = format!(
        "[[bus]]\nname = \"b\"\nuri = \"slcan-listen:{address}\"\n\
         [[device]]\nmodel = \"amg11-d29\"\naddress = 5\nmemory = '{}'\n",
        memory.display()
    );
    let error = plant(&text).start(PATIENCE).unwrap_err();
    assert!(matches!(error, StartError::Link(_)), "{error}");
    // Its memory is free again.
    drop(taken);
    drop(plant(&text).start(PATIENCE).unwrap());
}

#[test]
fn the_demo_starts_and_stops_at_once() {
    drop(Plant::load(&example("demo.toml")).unwrap().start(PATIENCE).unwrap());
}

#[test]
fn a_damaged_memory_on_a_simulated_bus_is_set_aside_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let memory = folder.path().join("memory");
    std::fs::write(&memory, b"dear diary").unwrap();
    let text = format!(
        "[[bus]]\nname = \"b\"\n[[device]]\nname = \"d\"\nmodel = \"amg11-d29\"\naddress = 5\n\
         memory = '{}'\n",
        memory.display()
    );
    let mut bus = VirtualBus::power_up(only_bus(plant(&text))).unwrap();
    let told = super::told(&at(&mut bus, 1), "d");
    assert!(told[0].contains("memory.damaged"), "{told:?}");
    assert_eq!(std::fs::read(folder.path().join("memory.damaged")).unwrap(), b"dear diary");
}

//! What the buses of a plant carry, recorded while they run.

use std::path::Path;
use std::time::{Duration, Instant};

use codewheel_capture::{Condition, Content, Medium, Reader, WriteError};
use codewheel_plant::{RecordError, StartError};

use super::plant;

const PATIENCE: Duration = Duration::from_secs(20);

const BOTH: &str = r#"
    [[bus]]
    name = "can"
    baud = "500k"
    [[bus]]
    name = "line"
    kind = "profibus"
    broken = 0.001
    [[master]]
    bus = "can"
    address = 0
    [[master]]
    bus = "line"
    address = 2
    [[device]]
    bus = "can"
    model = "amg11-d29"
    address = 5
    [[device]]
    bus = "line"
    model = "amg11-p29"
    address = 7
"#;

/// Records a plant for a while.
fn record(text: &str, path: &Path, lasts: Duration) -> u64 {
    let (running, recording) = plant(text).start_recorded(PATIENCE, path).unwrap();
    std::thread::sleep(lasts);
    running.stop().1.unwrap();
    let recorded = recording.finish().unwrap();
    assert_eq!(recorded.lost, 0);
    recorded.records
}

#[test]
fn each_simulated_bus_is_there_with_its_name_its_rate_and_times_of_the_wall() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("both.pcapng");
    let before = codewheel_capture::Timestamp::from(std::time::SystemTime::now());
    let records = record(BOTH, &path, Duration::from_secs(1));
    let after = codewheel_capture::Timestamp::from(std::time::SystemTime::now());
    let mut reader = Reader::open(&path).unwrap();
    let (mut count, mut broken, mut last) = (0, 0, [before; 2]);
    while let Some((_, record)) = reader.read().unwrap() {
        count += 1;
        let last = &mut last[usize::from(record.bus)];
        assert!(*last <= record.at && record.at <= after, "{record:?}");
        *last = record.at;
        if let Content::Telegram { condition: Condition::Broken, .. } = record.content {
            broken += 1;
        }
    }
    assert_eq!(count, records);
    assert!(broken > 0, "a disturbed line shows");
    let [can, line] = reader.buses() else { panic!("{:?}", reader.buses()) };
    assert_eq!((can.name.as_str(), can.medium), ("can", Medium::DeviceNet));
    assert_eq!(can.bits_per_second, Some(500_000));
    assert_eq!((line.name.as_str(), line.medium), ("line", Medium::Profibus));
    assert_eq!(line.bits_per_second, Some(1_500_000));
}

#[test]
fn a_scanner_and_an_encoder_that_share_a_port_are_recorded_once_each() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shared.log");
    let text = r#"
        [[bus]]
        name = "b"
        uri = "slcan-listen:127.0.0.1:0"
        [[master]]
        address = 0
        [[device]]
        model = "amg11-d29"
        address = 5
        shaft = "still angle=74565"
    "#;
    record(text, &path, Duration::from_secs(4));
    let text = std::fs::read_to_string(&path).unwrap();
    let frames = |frame: &str| text.lines().filter(|line| line.contains(frame)).count();
    let (polls, answers) = (frames(" b 42D#"), frames(" b 3C5#45230100"));
    assert!(answers > 3 && polls.abs_diff(answers) <= 1, "{polls} polls, {answers} answers");
}

#[test]
fn a_file_that_cannot_be_is_refused_and_an_older_one_stays_where_a_port_cannot_be_had() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("both.asc");
    let refused = |text: &str, path: &Path| plant(text).start_recorded(PATIENCE, path).unwrap_err();
    let error = refused(BOTH, &path);
    assert!(
        matches!(
            &error,
            StartError::Record(RecordError { reason: WriteError::Format(_), path: told })
                if *told == path
        ),
        "{error}"
    );
    assert!(!path.exists());

    let error = refused(BOTH, &folder.path().join("missing/both.log")).to_string();
    assert!(error.contains("both.log") && error.contains("cannot be written"), "{error}");

    let path = folder.path().join("older.log");
    std::fs::write(&path, "older").unwrap();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    let text = format!("[[bus]]\nname = \"b\"\nuri = \"slcan-listen:{address}\"\n");
    assert!(matches!(refused(&text, &path), StartError::Link(_)));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "older");
}

#[test]
fn a_plant_stops_at_once_while_it_is_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let begin = Instant::now();
    record(BOTH, &folder.path().join("short.log"), Duration::ZERO);
    assert!(begin.elapsed() < Duration::from_secs(2));
}

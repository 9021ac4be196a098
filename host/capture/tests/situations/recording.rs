//! Recording while buses run.

use codewheel_capture::{Condition, Direction, Format, Reader, Recorder, Timestamp};
use codewheel_station::can::Frame;
use codewheel_station::{Duration, Instant};

use crate::bench::{BEGIN, Kept, Said, can0, pb0};

fn read(path: &std::path::Path) -> Vec<Kept> {
    let mut reader = Reader::open(path).unwrap();
    let mut records = Vec::new();
    while let Some((_, record)) = reader.read().unwrap() {
        records.push(Kept::of(&record));
    }
    records
}

#[test]
fn two_bus_threads_record_into_one_file_and_nothing_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    for format in [Format::Log, Format::Pcapng] {
        let path = folder.path().join(format!("both{format}"));
        let recorder = Recorder::create(&path, vec![can0(), pb0()]).unwrap();
        let (frames, telegrams) = (recorder.bus(0, BEGIN), recorder.bus(1, BEGIN));
        let count = 20_000_u64;
        let at = |number| Instant::ZERO + Duration::from_micros(number);
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for number in 0..count {
                    let frame = Frame::standard(0x3C5, &(number as u32).to_le_bytes());
                    frames.frame(at(number), &frame, Direction::Received);
                }
            });
            scope.spawn(move || {
                for number in 0..count {
                    let octets = (number as u32).to_le_bytes();
                    telegrams.telegram(at(number), &octets, Condition::Broken, Direction::Sent);
                }
            });
        });
        let recorded = recorder.finish().unwrap();
        assert_eq!((recorded.records, recorded.lost), (2 * count, 0));
        let records = read(&path);
        for bus in 0..2 {
            let own: Vec<_> = records.iter().filter(|record| record.bus == bus).collect();
            assert_eq!(own.len() as u64, count);
            assert!(own.iter().is_sorted_by_key(|record| record.at), "{format}");
            assert_eq!(own[7].at, BEGIN.at(at(7)));
        }
        let broken =
            |record: &&Kept| matches!(record.content, Said::Telegram(_, Condition::Broken));
        assert_eq!(records.iter().filter(broken).count() as u64, count);
    }
}

#[test]
fn the_file_grows_while_the_bus_runs_and_is_whole_when_the_recorder_is_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grows.log");
    let recorder = Recorder::create(&path, vec![can0()]).unwrap();
    let bus = recorder.bus(0, Timestamp::origin_of(Instant::ZERO));
    bus.frame(Instant::ZERO, &Frame::standard(0x42D, &[]), Direction::Received);
    let patience = std::time::Instant::now();
    while std::fs::metadata(&path).unwrap().len() == 0 {
        assert!(patience.elapsed().as_secs() < 20, "nothing reaches the file");
        std::thread::yield_now();
    }
    bus.frame(Instant::ZERO, &Frame::standard(0x3C5, &[0; 4]), Direction::Sent);
    drop(recorder);
    bus.frame(Instant::ZERO, &Frame::standard(0x000, &[]), Direction::Sent);
    let said: Vec<Said> = read(&path).into_iter().map(|record| record.content).collect();
    let frames = [Frame::standard(0x42D, &[]), Frame::standard(0x3C5, &[0; 4])];
    assert_eq!(said, frames.map(Said::Frame));
}

#[test]
fn times_are_those_of_the_wall_when_the_bus_began_and_of_the_bus_from_there() {
    let before = Timestamp::from(std::time::SystemTime::now());
    let hour = Instant::ZERO + Duration::from_secs(3_600);
    let origin = Timestamp::origin_of(hour);
    let after = Timestamp::from(std::time::SystemTime::now());
    assert!(before <= origin.at(hour) && origin.at(hour) <= after);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said_at_the_end_and_what_is_lost_is_counted() {
    // /dev/full takes nothing; its name must have a suffix of ours.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("full.log");
    std::os::unix::fs::symlink("/dev/full", &path).unwrap();
    let recorder = Recorder::create(&path, vec![can0()]).unwrap();
    let bus = recorder.bus(0, BEGIN);
    let frame = Frame::standard(0x42D, &[]);
    let patience = std::time::Instant::now();
    while recorder.recorded().lost == 0 {
        assert!(patience.elapsed().as_secs() < 20, "nothing is lost on a full disk");
        bus.frame(Instant::ZERO, &frame, Direction::Received);
        std::thread::yield_now();
    }
    let error = recorder.finish().unwrap_err().to_string();
    assert!(error.starts_with("the capture cannot be written: "), "{error}");
}

//! What recording costs the thread of a bus, for each frame and telegram.
//!
//! A full CAN segment at 500k carries a frame in 110 µs at least (55 bits), a PROFIBUS at 12M a telegram in
//! 5.5 µs (66 bits): a twentieth of that is 5.5 µs and 275 ns.
//!
//! Recorded is in portions that fit the memory, and the time between them, in which the file gets them, does
//! not count: whoever records more than any bus carries measures how fast records are lost.

use std::hint::black_box;
use std::thread::sleep;
use std::time::{Duration, Instant as Clock};

use codewheel_capture::{Bus, Condition, Direction, Format, Recorder, Timestamp};
use codewheel_station::can::{BitRate, Frame};
use codewheel_station::rs485::BaudRate;
use codewheel_station::{self as station, Instant};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// As many records fit the memory several times.
const PORTION: u64 = 30_000;
/// As long the file takes for a portion at the most.
const WRITING: Duration = Duration::from_millis(200);

/// How long `count` portions take, without the time to write them.
fn portions(count: u64, mut record: impl FnMut()) -> Duration {
    let mut took = Duration::ZERO;
    for _ in 0..count {
        let begin = Clock::now();
        for _ in 0..PORTION {
            record();
        }
        took += begin.elapsed();
        sleep(WRITING);
    }
    took
}

fn recording(criterion: &mut Criterion) {
    let folder = std::env::temp_dir().join(format!("codewheel-record-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for files that nobody needs");
    let mut group = criterion.benchmark_group("record");
    group.throughput(Throughput::Elements(PORTION)).sample_size(10);
    group.warm_up_time(Duration::from_millis(10)).measurement_time(Duration::from_millis(50));
    for format in [Format::Log, Format::Pcapng] {
        let path = folder.join(format!("record{format}"));
        let buses =
            vec![Bus::devicenet("can0", BitRate::Kbit500), Bus::profibus("pb0", BaudRate::Mbit12)];
        let recorder = Recorder::create(&path, buses).expect("a file");
        let origin = Timestamp::origin_of(Instant::ZERO);
        let (can, line) = (recorder.bus(0, origin), recorder.bus(1, origin));
        let frame = Frame::standard(0x3C5, &[0, 0x10, 0, 0]);
        let telegram = [0x68, 7, 7, 0x68, 2, 7, 8, 0, 0, 0x10, 0, 0x21, 0x16];
        let mut at = Instant::ZERO;
        group.bench_function(format!("{PORTION} frames to {format}"), |bencher| {
            bencher.iter_custom(|count| {
                portions(count, || {
                    at += station::Duration::from_micros(110);
                    can.frame(at, black_box(&frame), Direction::Received);
                })
            });
        });
        group.bench_function(format!("{PORTION} telegrams to {format}"), |bencher| {
            bencher.iter_custom(|count| {
                portions(count, || {
                    at += station::Duration::from_micros(6);
                    let octets = black_box(&telegram);
                    line.telegram(at, octets, Condition::Intact, Direction::Received);
                })
            });
        });
        let recorded = recorder.finish().expect("room on the disk");
        assert_eq!(recorded.lost, 0, "what was measured is not recording");
    }
    group.finish();
    // What stays in the folder of temporary files harms nobody.
    let _ = std::fs::remove_dir_all(&folder);
}

criterion_group!(benches, recording);
criterion_main!(benches);

//! How fast a capture becomes lines: frames a second, from file to text, beside tshark where it is
//! installed.
//!
//! The files are sessions of our own devices, repeated until there are enough frames.

use std::hint::black_box;
use std::io;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant as Clock};

use codewheel_capture::{
    Assume, Bus, Condition, Content, Decoder, Direction, Format, Output, Reader, Record, Timestamp,
    Writer, replay,
};
use codewheel_station::Instant;
use codewheel_station::can::Frame;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

#[path = "../tests/sessions/mod.rs"]
mod sessions;

const RECORDS: u64 = 200_000;
const BEGIN: Timestamp = Timestamp::from_nanos(1_795_334_400_000_000_000);

struct Session {
    bus: Bus,
    records: Vec<(Instant, Vec<u8>, Option<Frame>, Condition)>,
}

fn devicenet() -> Session {
    let mut records = Vec::new();
    sessions::devicenet(&mut |at, frame| {
        records.push((at, Vec::new(), Some(*frame), Condition::Intact));
    });
    Session { bus: Bus::devicenet("can0", sessions::BIT_RATE), records }
}

fn profibus() -> Session {
    let mut records = Vec::new();
    sessions::profibus(&mut |at, octets, condition| {
        records.push((at, octets.to_vec(), None, condition));
    });
    Session { bus: Bus::profibus("pb0", sessions::BAUD_RATE), records }
}

impl Session {
    /// A file of [`RECORDS`] records.
    fn file(&self, format: Format) -> Vec<u8> {
        let buses = vec![self.bus.clone()];
        let mut writer = Writer::new(Vec::new(), format, buses, BEGIN).expect("it carries them");
        for (at, octets, frame, condition) in self.records.iter().cycle().take(RECORDS as usize) {
            let content = match frame {
                Some(frame) => Content::Frame(*frame),
                None => Content::Telegram { octets, condition: *condition },
            };
            let at = BEGIN.at(*at);
            writer
                .write(&Record { at, bus: 0, direction: Direction::Received, content })
                .expect("memory takes everything");
        }
        writer.finish().expect("memory takes everything")
    }
}

/// Counts what is written to it, and keeps nothing.
#[derive(Default)]
struct Counted(u64);

impl io::Write for Counted {
    fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
        self.0 += black_box(octets).len() as u64;
        Ok(octets.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn tell(file: &[u8], format: Format, output: Output) {
    let mut reader = Reader::new(file, format);
    let mut decoder = Decoder::new(output, Assume::Encoders);
    let mut out = Counted::default();
    let complain = &mut |error: &_| panic!("{error}");
    let replayed = replay(&mut reader, &mut decoder, &mut out, complain).expect("memory");
    assert_eq!(replayed.records, RECORDS);
    assert!(out.0 > 50 * RECORDS);
}

fn replaying(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("replay");
    group.throughput(Throughput::Elements(RECORDS)).sample_size(10);
    for (name, session) in [("DeviceNet", devicenet()), ("PROFIBUS", profibus())] {
        for format in Format::ALL.into_iter().filter(|format| format.carries(session.bus.medium)) {
            let file = session.file(format);
            for (output, word) in [(Output::Text, "text"), (Output::Json, "JSON")] {
                group.bench_function(format!("{name} {format} to {word}"), |bencher| {
                    bencher.iter(|| tell(&file, format, output));
                });
            }
        }
        beside_tshark(name, &session.file(Format::Pcapng));
    }
    group.finish();
}

/// The same file through tshark, once, since it takes its time.
fn beside_tshark(name: &str, file: &[u8]) {
    let folder = std::env::temp_dir().join(format!("codewheel-replay-{}", std::process::id()));
    let path = folder.join("replay.pcapng");
    if std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, file)).is_err() {
        return;
    }
    let lua =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/wireshark/codewheel_profibus.lua");
    let begin = Clock::now();
    let done = Command::new("tshark")
        .args(["-n", "-d", "can.subdissector,devicenet", "-X"])
        .arg(format!("lua_script:{}", lua.display()))
        .arg("-r")
        .arg(&path)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    let took = begin.elapsed();
    match done {
        Ok(status) if status.success() && took > Duration::ZERO => {
            let rate = RECORDS as f64 / took.as_secs_f64();
            println!("tshark, {name} .pcapng: {rate:.0} records a second");
        }
        _ => println!("tshark, {name}: not installed, or it failed"),
    }
    // What stays in the folder of temporary files harms nobody.
    let _ = std::fs::remove_dir_all(&folder);
}

criterion_group!(benches, replaying);
criterion_main!(benches);

//! Writes sample captures of both buses in all formats: `cargo run --example make_samples FOLDER`.
//!
//! The devices and masters are ours, in virtual time, so the files are the same each time.

use std::error::Error;
use std::path::Path;

use codewheel_capture::{Bus, Condition, Content, Direction, Format, Medium, Record};
use codewheel_capture::{Timestamp, Writer};
use codewheel_station::Instant;
use codewheel_station::can::Frame;

#[path = "../tests/sessions/mod.rs"]
mod sessions;

/// 2026-11-22 08:00 UTC.
const BEGIN: Timestamp = Timestamp::from_nanos(1_795_334_400_000_000_000);

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).ok_or("say the folder to write to")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let mut frames: Vec<(Instant, Frame)> = Vec::new();
    sessions::devicenet(&mut |at, frame| frames.push((at, *frame)));
    let mut telegrams: Vec<(Instant, Vec<u8>, Condition)> = Vec::new();
    sessions::profibus(&mut |at, octets, condition| {
        telegrams.push((at, octets.to_vec(), condition));
    });
    let record =
        |at, content| Record { at: BEGIN.at(at), bus: 0, direction: Direction::Received, content };
    for format in Format::ALL {
        let path = folder.join(format!("devicenet{format}"));
        let bus = Bus::devicenet("can0", sessions::BIT_RATE);
        let mut writer = Writer::create(&path, vec![bus], BEGIN)?;
        for (at, frame) in &frames {
            writer.write(&record(*at, Content::Frame(*frame)))?;
        }
        writer.finish()?;
        println!("{} {} frames", path.display(), frames.len());
        if !format.carries(Medium::Profibus) {
            continue;
        }
        let path = folder.join(format!("profibus{format}"));
        let bus = Bus::profibus("pb0", sessions::BAUD_RATE);
        let mut writer = Writer::create(&path, vec![bus], BEGIN)?;
        for (at, octets, condition) in &telegrams {
            let content = Content::Telegram { octets, condition: *condition };
            writer.write(&record(*at, content))?;
        }
        writer.finish()?;
        println!("{} {} telegrams", path.display(), telegrams.len());
    }
    Ok(())
}

//! `codewheel run`: a plant from its file, and `codewheel` alone: the demo.

use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use codewheel_plant::{BusSnapshot, Plant, Running};

use crate::arguments::{Chatter, RunArguments};
use crate::failure::Failure;
use crate::page::{self, PageArguments};
use crate::record;
use crate::show::{self, Show};
use crate::signals::stop_flag;
use crate::tell;

/// What `codewheel` alone runs.
const DEMO: &str = include_str!("../../examples/demo.toml");

/// The longest time until an end by signal or by the clock is noticed.
const PATIENCE: Duration = Duration::from_millis(100);

pub(crate) fn run(arguments: &RunArguments, chatter: Chatter) -> Result<(), Failure> {
    let plant = Plant::load(&arguments.file)?;
    if arguments.print_config {
        std::io::stdout().lock().write_all(plant.to_text().as_bytes())?;
        return Ok(());
    }
    let lasts = arguments.lasts.map(|time| time.0.into());
    let name = arguments.file.display().to_string();
    let (page, record) = (&arguments.page, arguments.record.as_deref());
    play(plant, &name, lasts, arguments.json, record, page, chatter)
}

pub(crate) fn demo(page: &PageArguments, chatter: Chatter) -> Result<(), Failure> {
    let name = "examples/demo.toml";
    let plant = Plant::parse(DEMO, name, Path::new(""))
        .map_err(|complaint| Failure::Plant(complaint.into()))?;
    if chatter > Chatter::Quiet {
        eprintln!(
            "codewheel: a virtual DeviceNet at 500k and a virtual PROFIBUS at 1.5M, each with three \
             encoders and a master; Ctrl-C ends it, `codewheel --help` shows what else there is"
        );
    }
    play(plant, name, None, false, None, page, chatter)
}

/// `codewheel schema`.
pub(crate) fn schema() -> Result<(), Failure> {
    std::io::stdout().lock().write_all(codewheel_plant::schema().as_bytes())?;
    Ok(())
}

fn play(
    plant: Plant,
    name: &str,
    lasts: Option<Duration>,
    json: bool,
    record: Option<&Path>,
    page: &PageArguments,
    chatter: Chatter,
) -> Result<(), Failure> {
    let stop = stop_flag(|| {})?;
    let port = page.port(name)?;
    let mut show = show::choose(json, plant.buses.len());
    let crews: Vec<_> = plant
        .buses
        .iter()
        .map(|bus| {
            let devices = count(bus.devices(), "device");
            format!("{devices}, {}", count(bus.masters(), "master"))
        })
        .collect();
    let names: Vec<_> = plant.buses.iter().map(|bus| bus.name().to_owned()).collect();
    let (running, recording) = match record {
        None => (plant.start(show.period())?, None),
        Some(path) => {
            let (running, recording) = plant.start_recorded(show.period(), path)?;
            (running, Some(recording))
        }
    };
    let running = Arc::new(running);
    if chatter > Chatter::Quiet {
        for ((name, uri), crew) in names.iter().zip(running.uris()).zip(crews) {
            eprintln!("codewheel: {name} on {uri}: {crew}");
        }
    }
    let page = port.map(|port| page::serve(&running, port, chatter)).transpose()?;
    let until = lasts.and_then(|lasts| Instant::now().checked_add(lasts));
    let shown = watch(&running, show.as_mut(), until, &stop, chatter);
    drop(page);
    // Whatever became of the output: the memories finish first.
    let (rest, ended) = running.stop();
    drop(show);
    rest.iter().for_each(|(_, snapshot)| tell::snapshot(snapshot, chatter));
    let recorded = recording.map_or(Ok(()), |recording| record::end(recording, chatter));
    ended?;
    shown?;
    recorded
}

fn count(number: usize, of: &str) -> String {
    format!("{number} {of}{}", if number == 1 { "" } else { "s" })
}

fn watch(
    running: &Running,
    show: &mut dyn Show,
    until: Option<Instant>,
    stop: &Arc<AtomicBool>,
    chatter: Chatter,
) -> std::io::Result<()> {
    let mut newest: Vec<Option<BusSnapshot>> = vec![None; running.uris().len()];
    while !stop.load(Ordering::Relaxed) && !running.has_ended() {
        let now = Instant::now();
        let left = until.map_or(PATIENCE, |until| until.saturating_duration_since(now));
        if left.is_zero() {
            break;
        }
        let fresh = running.snapshots(left.min(PATIENCE));
        if fresh.is_empty() {
            continue;
        }
        if fresh.iter().any(|(_, snapshot)| tell::has_something(snapshot, chatter)) {
            show.make_room()?;
            fresh.iter().for_each(|(_, snapshot)| tell::snapshot(snapshot, chatter));
        }
        let places: Vec<usize> = fresh.iter().map(|(place, _)| *place).collect();
        for (place, snapshot) in fresh {
            newest[place] = Some(snapshot);
        }
        show.draw(&newest, &places)?;
    }
    Ok(())
}

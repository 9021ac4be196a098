//! How fast an encoder of this program answers on this machine: one is played on a loopback, and
//! asked as a master asks.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use codewheel_device::Product;
use codewheel_device::profibus::Switches;
use codewheel_link::{BusUri, Clock, Waker};
use codewheel_plant::{BusPlan, DevicePlan, PortBus, Profibus};
use codewheel_sim::shaft::Shaft;
use codewheel_station::rs485::BaudRate;

use super::finding::{Finding, Times};

/// FDL status, master 2 asks slave 7: answered in every state (EN 50170-2).
const REQUEST: [u8; 6] = [0x10, 0x07, 0x02, 0x49, 0x52, 0x16];
const ANSWER: [u8; 6] = [0x10, 0x02, 0x07, 0x00, 0x09, 0x16];
const SLAVE: u8 = 7;

/// Octets have no rate on a loopback; at this one T_SDR is as good as nothing.
const RATE: BaudRate = BaudRate::Mbit12;
/// Default T_SDR, in bits.
const STATION_DELAY: u32 = 11;

const REQUESTS: usize = 1_000;
const WARM_UP: usize = 50;
/// Between two requests, as a master has other slaves too: a machine that fell asleep answers later.
const PAUSE: Duration = Duration::from_millis(1);
/// For one answer, and for all of them.
const PATIENCE: Duration = Duration::from_secs(2);
const LONGEST: Duration = Duration::from_secs(30);

/// A loopback.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    Tcp,
    #[cfg(unix)]
    Pty,
}

/// All that this system has.
pub(super) const WAYS: &[Way] = &[
    Way::Tcp,
    #[cfg(unix)]
    Way::Pty,
];

/// What was measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answers {
    way: Way,
    times: Times,
    /// 99 of 100 answers begin within this time.
    pub(super) most: Duration,
}

impl Way {
    /// Whether a port of this kind leads to `bus`; each does where none is named.
    pub(super) const fn leads_to(self, bus: Option<&BusUri>) -> bool {
        match self {
            Self::Tcp => !matches!(bus, Some(BusUri::Rs485Device(_) | BusUri::Rs485ListenPty(_))),
            #[cfg(unix)]
            Self::Pty => !matches!(bus, Some(BusUri::Rs485(_) | BusUri::Rs485Listen(_))),
        }
    }

    const fn about(self) -> &'static str {
        match self {
            Self::Tcp => "answers, TCP",
            #[cfg(unix)]
            Self::Pty => "answers, pty",
        }
    }
}

impl Answers {
    pub(super) fn new(way: Way, times: Times) -> Self {
        Self { way, times, most: times.most }
    }

    pub(super) fn finding(&self) -> Finding {
        Finding::fine(self.way.about(), self.times.to_string()).values(self.times.values())
    }
}

pub(super) fn failed(way: Way, why: &str) -> Finding {
    Finding::trouble(way.about(), format!("could not be measured: {why}"))
        .remedy("allow connections to 127.0.0.1 and files in the temporary folder")
}

/// Plays an encoder and asks it, over and over.
pub(super) fn measure(way: Way) -> Result<Answers, String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let uri = match way {
        Way::Tcp => "rs485-listen:127.0.0.1:0".to_owned(),
        #[cfg(unix)]
        Way::Pty => format!("rs485-listen:pty:{}", folder.path().join("line").display()),
    };
    let uri: BusUri = uri.parse().map_err(|error| format!("{error}"))?;
    let (ready, is_ready) = mpsc::channel();
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    let station = thread::spawn(move || play(uri, &ready, &stopped));
    let (place, waker) = is_ready.recv().map_err(|_| "the encoder did not start")??;
    // A port that says nothing more is left to the thread that waits in it.
    let (done, is_done) = mpsc::channel();
    thread::spawn(move || done.send(connect(&place).and_then(|mut stream| ask(stream.as_mut()))));
    let times = is_done.recv_timeout(LONGEST);
    stop.store(true, Ordering::Relaxed);
    waker.wake();
    let _ = station.join();
    let times = times.map_err(|_| "no answers")?.map_err(|error| error.to_string())?;
    Times::of(times).map(|times| Answers::new(way, times)).ok_or_else(|| "no answers".to_owned())
}

/// Where the encoder is, and what stops it; or why there is none.
type Ready = Result<(String, Waker), String>;

/// Plays an encoder until it is told to stop, and woken.
fn play(uri: BusUri, ready: &mpsc::Sender<Ready>, stop: &AtomicBool) {
    let opened = Product::find("amg11-p29").ok_or_else(|| "no such model".to_owned());
    let opened = opened.and_then(|product| {
        let mut plan = BusPlan::<Profibus>::new("", uri, RATE);
        let shaft = Shaft::parse("turn rpm=60", 8_192, 65_536).map_err(|e| e.to_string())?;
        plan.devices.push(DevicePlan::new(product, Switches::set_to(SLAVE), shaft));
        PortBus::power_up(plan, Clock::new()).map_err(|error| error.to_string())
    });
    let mut bus = match opened {
        Ok(bus) => bus,
        Err(why) => {
            let _ = ready.send(Err(why));
            return;
        }
    };
    let _ = ready.send(Ok((bus.uri().to_owned(), bus.waker())));
    while !stop.load(Ordering::Relaxed) && bus.turn(None).is_ok() {}
}

/// Both directions of the loopback.
trait Stream: Read + Write {}
impl<T: Read + Write> Stream for T {}

fn connect(place: &str) -> std::io::Result<Box<dyn Stream>> {
    let place = place.trim_start_matches("rs485-listen:");
    if let Some(path) = place.strip_prefix("pty:") {
        let file = std::fs::File::options().read(true).write(true).open(path)?;
        return Ok(Box::new(file));
    }
    let stream = TcpStream::connect(place)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    Ok(Box::new(stream))
}

/// From each request to the first octet of its answer, without T_SDR.
fn ask(stream: &mut dyn Stream) -> std::io::Result<Vec<Duration>> {
    let station_delay = RATE.bits(STATION_DELAY).into();
    let mut times = Vec::with_capacity(REQUESTS);
    for request in 0..WARM_UP + REQUESTS {
        thread::sleep(PAUSE);
        let begun = Instant::now();
        stream.write_all(&REQUEST)?;
        let mut answer = [0; ANSWER.len()];
        stream.read_exact(&mut answer[..1])?;
        let taken = begun.elapsed();
        stream.read_exact(&mut answer[1..])?;
        if answer != ANSWER {
            return Err(std::io::Error::other("an answer to something else"));
        }
        if request >= WARM_UP {
            times.push(taken.saturating_sub(station_delay));
        }
    }
    Ok(times)
}

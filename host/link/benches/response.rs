//! How long an RS-485 port takes to answer: from the last octet in to the first octet out, as a client
//! sees it, against a thread that does nothing but read and write.
//!
//! ```text
//! cargo bench -p codewheel-link --bench response
//! ```
//!
//! Each figure is the median of five runs; the two sides take turns within a run, so that whatever
//! else the machine does meets both. A request has 13 octets, as a data exchange of four octets
//! has, and is answered after T_SDR at 12 Mbit/s (11 bits, 917 ns), which is taken off.

#![allow(missing_docs, clippy::unwrap_used)]

use std::fs::File;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use codewheel_link::{Clock, Rs485Loop, open_rs485};
use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Instant as Time, Station};

const RUNS: usize = 5;
const REQUESTS: usize = 5_000;
const WARM_UP: usize = 500;
const REQUEST: [u8; 13] = [0x68, 7, 7, 0x68, 7, 2, 0x7D, 0, 0, 0, 0, 0x86, 0x16];
const T_SDR_BITS: u32 = 11;

/// Answers thirteen octets with thirteen.
#[derive(Debug, Default)]
struct Toy {
    heard: usize,
    due: Option<Time>,
}

impl Station for Toy {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Time, input: Input<'_>) {
        if let Input::Octets(octets) = input {
            self.heard += octets.len();
        }
        if self.heard >= REQUEST.len() {
            self.heard = 0;
            self.due = Some(now + BaudRate::Mbit12.bits(T_SDR_BITS));
        }
    }

    fn advance(&mut self, _: Time) {}

    fn transmit(&mut self, now: Time) -> Option<Transmission> {
        self.due.take_if(|due| *due <= now)?;
        Transmission::new(&REQUEST)
    }

    fn deadline(&self) -> Option<Time> {
        self.due
    }
}

impl Node for Toy {
    fn baud_rate(&self) -> BaudRate {
        BaudRate::Mbit12
    }
}

/// Both directions of one client's stream.
trait Stream: Read + Write + Send {}
impl<T: Read + Write + Send> Stream for T {}

/// The nanoseconds that each of `REQUESTS` took, in ascending order.
fn ask(stream: &mut dyn Stream) -> Vec<u64> {
    let mut taken = Vec::with_capacity(REQUESTS);
    for request in 0..WARM_UP + REQUESTS {
        let start = Instant::now();
        stream.write_all(&REQUEST).unwrap();
        let mut answer = [0; REQUEST.len()];
        let mut first = None;
        let mut length = 0;
        while length < answer.len() {
            length += stream.read(&mut answer[length..]).unwrap();
            first.get_or_insert_with(|| start.elapsed());
        }
        assert_eq!(answer, REQUEST);
        if request >= WARM_UP {
            taken.push(first.unwrap().as_nanos() as u64);
        }
    }
    taken.sort_unstable();
    taken
}

/// A pty pair: the port that a program opens, and the other side.
#[cfg(unix)]
fn pty() -> (File, File) {
    use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    unlockpt(&master).unwrap();
    let name = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
    let slave = File::options().read(true).write(true).open(name).unwrap();
    let mut settings = tcgetattr(&slave).unwrap();
    settings.make_raw();
    tcsetattr(&slave, OptionalActions::Now, &settings).unwrap();
    (slave, File::from(master))
}

/// Reads and writes until the other side is gone.
fn echo(mut stream: impl Read + Write) {
    let mut buffer = [0; 512];
    while let Ok(count @ 1..) = stream.read(&mut buffer) {
        stream.write_all(&buffer[..count]).unwrap();
    }
}

/// What `uri` takes through the loop, with `connect` to make its client from what it calls itself.
fn through_the_loop(uri: &str, connect: impl FnOnce(&str) -> Box<dyn Stream>) -> Vec<u64> {
    let mut port = open_rs485(&uri.parse().unwrap(), BaudRate::Mbit12).unwrap();
    let (name, waker) = (port.describe(), port.waker());
    let station = thread::spawn(move || {
        let (mut toy, mut drive) = (Toy::default(), Rs485Loop::new(Clock::new()));
        while !drive.turn(&mut toy, port.as_mut(), None).unwrap().woken {}
    });
    let taken = ask(connect(&name).as_mut());
    waker.wake();
    station.join().unwrap();
    let t_sdr = BaudRate::Mbit12.bits(T_SDR_BITS).as_nanos();
    taken.into_iter().map(|taken| taken - t_sdr).collect()
}

fn tcp_loop() -> Vec<u64> {
    through_the_loop("rs485-listen:127.0.0.1:0", |name| {
        let stream = TcpStream::connect(name.strip_prefix("rs485-listen:").unwrap()).unwrap();
        stream.set_nodelay(true).unwrap();
        Box::new(stream)
    })
}

fn tcp_echo() -> Vec<u64> {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    stream.set_nodelay(true).unwrap();
    let (other, _) = listener.accept().unwrap();
    other.set_nodelay(true).unwrap();
    let thread = thread::spawn(move || echo(other));
    let taken = ask(&mut stream);
    drop(stream);
    thread.join().unwrap();
    taken
}

#[cfg(unix)]
fn pty_loop() -> Vec<u64> {
    let folder = tempfile::tempdir().unwrap();
    let uri = format!("rs485-listen:pty:{}", folder.path().join("line").display());
    through_the_loop(&uri, |name| {
        let path = name.strip_prefix("rs485-listen:pty:").unwrap();
        Box::new(File::options().read(true).write(true).open(path).unwrap())
    })
}

#[cfg(unix)]
fn pty_echo() -> Vec<u64> {
    let (mut slave, master) = pty();
    let thread = thread::spawn(move || echo(master));
    let taken = ask(&mut slave);
    drop(slave);
    thread.join().unwrap();
    taken
}

fn micros(nanos: u64) -> f64 {
    Duration::from_nanos(nanos).as_secs_f64() * 1e6
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Prints a row of the table.
fn compare(name: &str, ours: fn() -> Vec<u64>, bare: fn() -> Vec<u64>) {
    let mut columns: [Vec<f64>; 6] = Default::default();
    for _ in 0..RUNS {
        let (ours, bare) = (ours(), bare());
        for (place, part) in [(0, 50), (1, 99)] {
            let [ours, bare] = [&ours, &bare].map(|taken| micros(taken[REQUESTS * part / 100]));
            columns[place].push(ours);
            columns[2 + place].push(bare);
            columns[4 + place].push(ours / bare);
        }
    }
    let [median_ours, p99_ours, median_bare, p99_bare, ratio, ratio_p99] = columns.map(median);
    println!(
        "{name:<5} {median_ours:>8.1} {p99_ours:>8.1} {median_bare:>8.1} {p99_bare:>8.1} \
         {ratio:>8.2} {ratio_p99:>8.2}"
    );
}

fn main() {
    println!("µs from the last octet in to the first octet out, medians of {RUNS} runs");
    println!("           through the loop        bare echo             ratio");
    println!("        median      p99   median      p99   median      p99");
    compare("TCP", tcp_loop, tcp_echo);
    #[cfg(unix)]
    compare("pty", pty_loop, pty_echo);
}

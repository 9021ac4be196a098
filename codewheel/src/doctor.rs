//! `codewheel doctor`: what this machine and its adapter can honestly hold.

mod adapter;
mod answers;
mod clock;
mod finding;
mod interface;
mod rates;

use std::io::Write;
use std::net::{TcpStream, ToSocketAddrs};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use codewheel_link::{BusUri, Endpoint, Medium};

use self::finding::{Finding, State};
use self::rates::Promises;
use crate::arguments::DoctorArguments;
use crate::failure::Failure;

/// How long a connection may take.
const PATIENCE: Duration = Duration::from_secs(5);

/// Looks at the machine, and at the bus that was named.
pub(crate) fn run(arguments: &DoctorArguments) -> Result<ExitCode, Failure> {
    let mut worst = State::Fine;
    let mut tell = |finding: &Finding| -> Result<(), Failure> {
        worst = worst.max(finding.state);
        let mut out = std::io::stdout().lock();
        if arguments.json {
            let text = serde_json::to_string(finding).map_err(std::io::Error::from)?;
            writeln!(out, "{text}")?;
        } else {
            write!(out, "{finding}")?;
        }
        Ok(())
    };
    tell(&clock::waits())?;
    let about_bus = arguments.bus.as_ref().map(look_at);
    for finding in about_bus.iter().flat_map(|bus| &bus.findings) {
        tell(finding)?;
    }
    let medium = arguments.bus.as_ref().map(BusUri::medium);
    if medium == Some(Medium::Can) || about_bus.as_ref().is_some_and(|bus| bus.is_unusable()) {
        return Ok(worst.exit_code());
    }
    let delay = about_bus.and_then(|bus| bus.delay);
    let mut slowest: Option<answers::Answers> = None;
    for way in answers::WAYS.iter().copied().filter(|way| way.leads_to(arguments.bus.as_ref())) {
        match answers::measure(way) {
            Ok(answers) => {
                tell(&answers.finding())?;
                slowest = slowest.into_iter().chain([answers]).max_by_key(|one| one.most);
            }
            Err(why) => tell(&answers::failed(way, &why))?,
        }
    }
    if let Some(answers) = slowest {
        tell(&Promises::of(&answers, delay).finding())?;
    }
    Ok(worst.exit_code())
}

/// What there is to say of a bus.
#[derive(Debug, Default)]
struct AboutBus {
    findings: Vec<Finding>,
    /// What the way to the line adds to the answers of this machine, where there is one.
    delay: Option<Duration>,
}

impl AboutBus {
    fn one(finding: Finding) -> Self {
        Self { findings: vec![finding], delay: None }
    }

    fn is_unusable(&self) -> bool {
        self.findings.iter().any(|finding| finding.state == State::Cannot)
    }
}

fn look_at(bus: &BusUri) -> AboutBus {
    match bus {
        BusUri::Rs485Device(path) => adapter::line(bus, path),
        BusUri::SlcanDevice { path, .. } => adapter::slcan(path),
        BusUri::SocketCan(name) => AboutBus::one(interface::look_at(bus, name)),
        BusUri::Rs485(endpoint) | BusUri::Slcan(endpoint) => connection(bus, endpoint),
        _ => AboutBus::one(opens(bus)),
    }
}

/// Whether a bus that this program makes itself can be made.
fn opens(bus: &BusUri) -> Finding {
    let opened = match bus.medium() {
        Medium::Can => {
            codewheel_link::open(bus, codewheel_station::can::BitRate::Kbit125).map(drop)
        }
        Medium::Rs485 => {
            let rate = codewheel_station::rs485::BaudRate::Mbit1_5;
            codewheel_link::open_rs485(bus, rate).map(drop)
        }
        Medium::Any => Ok(()),
    };
    match opened {
        Ok(()) => Finding::fine("bus", format!("{bus} can be had")),
        Err(error) => Finding::cannot("bus", error.to_string()),
    }
}

/// How far away somebody else's port is.
fn connection(bus: &BusUri, endpoint: &Endpoint) -> AboutBus {
    let begun = Instant::now();
    let address = (endpoint.host(), endpoint.port()).to_socket_addrs();
    let connected = address.and_then(|mut addresses| {
        let address = addresses.next().ok_or(std::io::ErrorKind::NotFound)?;
        TcpStream::connect_timeout(&address, PATIENCE)
    });
    match connected {
        Ok(_) => {
            // A connection is made in one round trip.
            let delay = begun.elapsed();
            let says = format!("{bus} answers in {}", finding::milliseconds(delay));
            AboutBus { findings: vec![Finding::fine("bus", says)], delay: Some(delay) }
        }
        Err(error) => AboutBus::one(
            Finding::cannot("bus", format!("nobody answers at {bus}: {error}"))
                .remedy("start what listens there, and check address and network"),
        ),
    }
}

//! A serial port, and the adapter behind it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use codewheel_link::{BusUri, LinkError, Notice, Rs485Port, Rs485Received, open_rs485};
use codewheel_station::rs485::BaudRate;
use serde_json::json;

use super::AboutBus;
use super::finding::{Finding, milliseconds};

/// Where Linux tells about its serial ports.
const PORTS: &str = "/sys/class/tty";
/// USB carries octets in frames of 1 ms, one way and the other.
const USB_FRAMES: Duration = Duration::from_millis(2);
/// The fastest rate at which a PC is any good as a slave, with a long slot time.
const FASTEST: BaudRate = BaudRate::Kbit500;
/// Above this an adapter that collects octets spoils the answers.
const SHORT_TIMER: u64 = 1;

/// An adapter at an RS-485 line. Opening it sends nothing.
pub(super) fn line(bus: &BusUri, path: &Path) -> AboutBus {
    let mut port = match open_rs485(bus, BaudRate::Kbit9_6) {
        Ok(port) => port,
        Err(error) => return AboutBus::one(not_opened(path, &error)),
    };
    if !port.has_rate() {
        let says = format!("{} is a pty: octets have neither rate nor parity", path.display());
        return AboutBus::one(Finding::fine("serial port", says));
    }
    let notices = notices_at_every_rate(port.as_mut());
    let way = Way::to(Path::new(PORTS), path);
    let mut findings = vec![way.finding(path)];
    findings.extend(way.timer_finding(path));
    findings.push(rates(&notices));
    findings.extend(notices.iter().filter_map(|notice| judged(notice, way.is_usb)));
    AboutBus { findings, delay: Some(way.delay()) }
}

/// An adapter that speaks SLCAN. It is not opened: its controller would take part in the bus.
pub(super) fn slcan(path: &Path) -> AboutBus {
    let finding = match usable(path) {
        Ok(()) => Finding::fine("serial port", format!("{} may be used", path.display())),
        Err(reason) => {
            let error = LinkError::Device { path: path.to_owned(), reason };
            return AboutBus::one(not_opened(path, &error));
        }
    };
    let way = Way::to(Path::new(PORTS), path);
    let mut findings = vec![finding];
    findings.extend(way.timer_finding(path));
    AboutBus { findings, delay: Some(way.delay()) }
}

#[cfg(unix)]
fn usable(path: &Path) -> io::Result<()> {
    use rustix::fs::{Access, access};
    Ok(access(path, Access::READ_OK | Access::WRITE_OK)?)
}

#[cfg(not(unix))]
fn usable(path: &Path) -> io::Result<()> {
    fs::metadata(path).map(drop)
}

fn not_opened(path: &Path, error: &LinkError) -> Finding {
    let finding = Finding::cannot("serial port", error.to_string());
    match error {
        LinkError::Device { reason, .. } if reason.kind() == io::ErrorKind::PermissionDenied => {
            match group(path) {
                Some(group) => finding.remedy(format!(
                    "type: sudo usermod -aG {group} $USER, then log out and in again"
                )),
                None => finding,
            }
        }
        _ => finding,
    }
}

/// The group that a file belongs to.
#[cfg(unix)]
fn group(path: &Path) -> Option<String> {
    use std::os::unix::fs::MetadataExt;
    let number = fs::metadata(path).ok()?.gid();
    group_called(&fs::read_to_string("/etc/group").ok()?, number)
}

#[cfg(not(unix))]
fn group(_: &Path) -> Option<String> {
    None
}

/// The name of group `number` in a file like /etc/group; not root's, which is for nobody.
fn group_called(groups: &str, number: u32) -> Option<String> {
    groups.lines().find_map(|line| {
        let mut parts = line.split(':');
        let name = parts.next()?;
        let matches = parts.nth(1)? == number.to_string() && number != 0;
        matches.then(|| name.to_owned())
    })
}

/// What the port says while it is set to every rate there is.
fn notices_at_every_rate(port: &mut dyn Rs485Port) -> Vec<Notice> {
    let mut notices = Vec::new();
    for rate in BaudRate::ALL {
        if port.set_baud_rate(rate).is_err() {
            break;
        }
        // A line that is alive brings octets as well.
        for _ in 0..64 {
            match port.receive(Some(Duration::ZERO)) {
                Ok(Some(Rs485Received::Notice(notice))) => notices.push(notice),
                Ok(Some(_)) => {}
                Ok(None) | Err(_) => break,
            }
        }
    }
    notices
}

/// Which rates the port can make.
fn rates(notices: &[Notice]) -> Finding {
    let missed: Vec<BaudRate> = notices
        .iter()
        .filter_map(|notice| match notice {
            Notice::RateNotTaken { asked, .. } => Some(*asked),
            _ => None,
        })
        .collect();
    let names = |missing: bool| {
        let rates = BaudRate::ALL.into_iter().filter(|rate| missed.contains(rate) == missing);
        rates.map(|rate| rate.to_string()).collect::<Vec<_>>().join(", ")
    };
    let values = json!({
        "missed": missed.iter().map(|rate| rate.bits_per_second()).collect::<Vec<_>>(),
    });
    let some = format!("the port takes {}, not {}", names(false), names(true));
    let finding = if missed.is_empty() {
        Finding::fine("rates", "the port takes every rate")
    } else if missed.iter().all(|rate| *rate > FASTEST) {
        Finding::fine("rates", format!("{some}, which is faster than a PC answers"))
    } else {
        Finding::trouble("rates", some)
            .remedy("another adapter, where one of the missing rates is needed")
    };
    finding.values(values)
}

/// What else the port told.
fn judged(notice: &Notice, is_usb: bool) -> Option<Finding> {
    match notice {
        // Adapters with a USB plug do it themselves, and no driver can tell.
        Notice::TransmitterNotSwitched { .. } if is_usb => {
            Some(Finding::fine("RS-485 mode", notice.to_string()))
        }
        Notice::TransmitterNotSwitched { .. } => {
            Some(Finding::trouble("RS-485 mode", notice.to_string()).remedy(
                "a converter that does, or a driver that can (device tree: \
                 linux,rs485-enabled-at-boot-time)",
            ))
        }
        Notice::ParityNotTaken => Some(
            Finding::trouble("parity", notice.to_string())
                .remedy("another adapter: PROFIBUS characters have even parity"),
        ),
        // The first is told with the rates, the second with the timer.
        Notice::RateNotTaken { .. } | Notice::AdapterHoldsBack { .. } => None,
        other if other.is_trouble() => Some(Finding::trouble("serial port", other.to_string())),
        _ => None,
    }
}

/// The driver of a device.
fn driver_of(device: &Path) -> Option<String> {
    let driver = fs::canonicalize(device.join("driver")).ok()?;
    Some(driver.file_name()?.to_str()?.to_owned())
}

/// What lies between this machine and the line.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Way {
    is_usb: bool,
    driver: Option<String>,
    /// How long the adapter collects octets, in milliseconds, and where that is set.
    timer: Option<(u64, PathBuf)>,
}

impl Way {
    fn to(ports: &Path, path: &Path) -> Self {
        let device = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let device = ports.join(device.file_name().unwrap_or_default()).join("device");
        let real = fs::canonicalize(&device).unwrap_or_default();
        let driver = real.ancestors().filter_map(driver_of).find(|driver| {
            // The kernel's own layers between the port and its driver.
            !["port", "ctrl"].contains(&driver.as_str())
        });
        let timer = device.join("latency_timer");
        let milliseconds = fs::read_to_string(&timer).ok();
        Self {
            is_usb: real
                .components()
                .any(|part| part.as_os_str().to_str().is_some_and(|part| part.starts_with("usb"))),
            driver,
            timer: milliseconds.and_then(|text| Some((text.trim().parse().ok()?, timer))),
        }
    }

    /// What it adds to an answer at most, as far as that is known.
    fn delay(&self) -> Duration {
        let timer = self.timer.as_ref().map_or(0, |(milliseconds, _)| *milliseconds);
        let usb = if self.is_usb { USB_FRAMES } else { Duration::ZERO };
        Duration::from_millis(timer) + usb
    }

    fn finding(&self, path: &Path) -> Finding {
        let driver = self.driver.as_deref().unwrap_or("unknown driver");
        let says = if self.is_usb {
            format!(
                "{} is a USB adapter ({driver}) that adds up to {} to an answer",
                path.display(),
                milliseconds(self.delay())
            )
        } else {
            format!("{} is a port of this machine ({driver})", path.display())
        };
        Finding::fine("serial port", says).values(json!({
            "usb": self.is_usb,
            "driver": self.driver,
            "delay_ms": self.delay().as_millis() as u64,
        }))
    }

    fn timer_finding(&self, path: &Path) -> Option<Finding> {
        let (milliseconds, timer) = self.timer.as_ref()?;
        let says = format!("the adapter collects octets for {milliseconds} ms");
        if *milliseconds <= SHORT_TIMER {
            return Some(Finding::fine("latency timer", says));
        }
        let remedy = format!(
            "type: setserial {} low_latency, or as root: echo 1 > {}; for good, a udev rule: \
             ACTION==\"add\", SUBSYSTEM==\"usb-serial\", DRIVER==\"ftdi_sio\", \
             ATTR{{latency_timer}}=\"1\"",
            path.display(),
            timer.display()
        );
        Some(Finding::trouble("latency timer", says).remedy(remedy))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::finding::State;

    /// A port `ttyUSB0` of a made-up machine, whose adapter collects for so many milliseconds.
    #[cfg(unix)]
    fn usb_port(folder: &Path, milliseconds: &str) -> Way {
        use std::os::unix::fs::symlink;
        let adapter = folder.join("devices/pci0/usb1/1-2/ttyUSB0");
        let drivers = folder.join("drivers/ftdi_sio");
        for made in [&adapter, &drivers, &folder.join("tty/ttyUSB0")] {
            fs::create_dir_all(made).unwrap();
        }
        fs::write(adapter.join("latency_timer"), milliseconds).unwrap();
        symlink(&drivers, adapter.join("driver")).unwrap();
        symlink(&adapter, folder.join("tty/ttyUSB0/device")).unwrap();
        Way::to(&folder.join("tty"), Path::new("/dev/ttyUSB0"))
    }

    #[cfg(unix)]
    #[test]
    fn a_latency_timer_of_16_ms_is_found_and_a_way_out_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let way = usb_port(folder.path(), "16\n");
        assert!(way.is_usb);
        assert_eq!(way.driver.as_deref(), Some("ftdi_sio"));
        assert_eq!(way.delay(), Duration::from_millis(18));
        let finding = way.timer_finding(Path::new("/dev/ttyUSB0")).unwrap();
        assert_eq!(finding.state, State::Finding);
        let remedy = finding.remedy.unwrap();
        assert!(remedy.contains("setserial /dev/ttyUSB0 low_latency"), "{remedy}");
        assert!(remedy.contains("ttyUSB0/device/latency_timer"), "{remedy}");
    }

    #[cfg(unix)]
    #[test]
    fn a_timer_of_1_ms_is_fine_and_leaves_the_frames_of_usb() {
        let folder = tempfile::tempdir().unwrap();
        let way = usb_port(folder.path(), "1\n");
        let finding = way.timer_finding(Path::new("/dev/ttyUSB0")).unwrap();
        assert_eq!(finding.state, State::Fine);
        assert_eq!(way.delay(), Duration::from_millis(3));
    }

    #[test]
    fn a_port_of_the_machine_itself_adds_nothing_that_is_known() {
        let folder = tempfile::tempdir().unwrap();
        let way = Way::to(folder.path(), Path::new("/dev/ttyS0"));
        assert_eq!(way, Way { is_usb: false, driver: None, timer: None });
        assert_eq!(way.delay(), Duration::ZERO);
        assert!(way.timer_finding(Path::new("/dev/ttyS0")).is_none());
    }

    #[test]
    fn the_group_of_a_port_is_named_and_that_of_root_is_not() {
        let groups = "root:x:0:\ndialout:x:20:ann,bob\nbroken\n";
        assert_eq!(group_called(groups, 20).as_deref(), Some("dialout"));
        assert_eq!(group_called(groups, 0), None);
        assert_eq!(group_called(groups, 21), None);
    }

    #[test]
    fn rates_that_a_port_does_not_take_are_named() {
        let missed = |asked| Notice::RateNotTaken { asked, taken: 9_600 };
        let finding = rates(&[missed(BaudRate::Kbit45_45), missed(BaudRate::Mbit12)]);
        assert_eq!(finding.state, State::Finding);
        assert!(finding.says.ends_with("3M, 6M, not 45.45k, 12M"), "{}", finding.says);
        let finding = rates(&[missed(BaudRate::Mbit6), missed(BaudRate::Mbit12)]);
        assert_eq!(finding.state, State::Fine, "no PC answers that fast");
        assert_eq!(rates(&[]).state, State::Fine);
    }

    #[test]
    fn what_the_port_tells_is_a_finding_only_where_something_is_wrong() {
        let reason = "Inappropriate ioctl for device".to_owned();
        let mode = Notice::TransmitterNotSwitched { reason };
        assert_eq!(judged(&mode, true).unwrap().state, State::Fine);
        assert_eq!(judged(&mode, false).unwrap().state, State::Finding);
        assert_eq!(judged(&Notice::ParityNotTaken, true).unwrap().state, State::Finding);
        assert!(judged(&Notice::AdapterHoldsBack { milliseconds: 16 }, true).is_none());
    }
}

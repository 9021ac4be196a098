//! The live table, on a terminal.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

use crate::prompt::example;

/// The program on a terminal of its own.
pub(crate) struct Terminal {
    child: Child,
    screen: File,
    seen: String,
}

impl Terminal {
    fn start(arguments: &[&str], rows: u16) -> Self {
        Self::start_with(arguments, rows, false)
    }

    /// Starts it with a keyboard.
    pub(crate) fn start_with_keyboard(arguments: &[&str]) -> Self {
        Self::start_with(arguments, 24, true)
    }

    fn start_with(arguments: &[&str], rows: u16, has_keyboard: bool) -> Self {
        let screen = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a terminal");
        grantpt(&screen).expect("ours");
        unlockpt(&screen).expect("ours");
        tcsetwinsize(&screen, Winsize { ws_row: rows, ws_col: 80, ws_xpixel: 0, ws_ypixel: 0 })
            .expect("a size");
        let name = ptsname(&screen, Vec::new()).expect("a name");
        let open = || File::options().read(true).write(true).open(name.to_str().expect("text"));
        let child = Command::new(env!("CARGO_BIN_EXE_codewheel"))
            .args(arguments)
            .stdin(if has_keyboard {
                Stdio::from(open().expect("the terminal"))
            } else {
                Stdio::null()
            })
            .stdout(OwnedFd::from(open().expect("the terminal")))
            .stderr(OwnedFd::from(open().expect("the terminal")))
            .spawn()
            .expect("the program starts");
        Self { child, screen: File::from(screen), seen: String::new() }
    }

    fn read(&mut self) -> bool {
        let mut octets = [0; 65_536];
        // The last one to close the terminal makes reading an error.
        let count = self.screen.read(&mut octets).unwrap_or(0);
        self.seen.push_str(&String::from_utf8_lossy(&octets[..count]));
        count > 0
    }

    /// Presses the keys.
    pub(crate) fn press(&mut self, keys: &str) {
        self.screen.write_all(keys.as_bytes()).expect("the terminal");
    }

    pub(crate) fn read_until(&mut self, text: &str) {
        let deadline = Instant::now() + Duration::from_secs(20);
        while !self.seen.contains(text) {
            assert!(Instant::now() < deadline && self.read(), "no {text:?} in {}", self.seen);
        }
    }

    /// Ends it, by `signal` or by itself, and gives all that was on the screen.
    fn end(self, signal: Option<Signal>) -> String {
        self.end_with(signal, 0)
    }

    /// [`end`](Self::end) with an exit code.
    #[track_caller]
    pub(crate) fn end_with(mut self, signal: Option<Signal>, code: i32) -> String {
        if let Some(signal) = signal {
            kill_process(Pid::from_child(&self.child), signal).expect("it lives");
        }
        while self.read() {}
        assert_eq!(self.child.wait().expect("a child").code(), Some(code), "{}", self.seen);
        std::mem::take(&mut self.seen)
    }
}

const HIDE_CURSOR: &str = "\x1b[?25l";
const SHOW_CURSOR: &str = "\x1b[?25h";
const WRAP_LINES: &str = "\x1b[?7h";

#[test]
fn the_terminal_is_given_back_as_it_was_however_the_table_ends() {
    for signal in [Some(Signal::INT), Some(Signal::TERM), None] {
        let plant = example("demo.toml");
        let mut arguments = vec!["run", plant.to_str().expect("text")];
        if signal.is_none() {
            arguments.extend(["--for", "500ms"]);
        }
        let mut terminal = Terminal::start(&arguments, 24);
        terminal.read_until("AMG 81 D29");
        let seen = terminal.end(signal);
        assert!(seen.contains(HIDE_CURSOR), "{seen}");
        let rest = seen.rsplit(HIDE_CURSOR).next().expect("the rest");
        assert!(rest.contains(WRAP_LINES) && rest.ends_with(SHOW_CURSOR), "{rest:?}");
        assert!(!seen.contains("\x1b[3") && !seen.contains("\x1b[0m"), "no colours: {seen:?}");
    }
}

#[test]
fn a_low_terminal_shows_what_fits() {
    let mut terminal = Terminal::start(&["--quiet"], 6);
    terminal.read_until("AMG 11 D29");
    terminal.read_until("\x1b[5F");
    let seen = terminal.end(Some(Signal::INT));
    assert!(!seen.contains("AMG 81 D29"), "the third row does not fit: {seen}");
}

#[test]
fn messages_come_above_the_table() {
    let plant = example("faults.toml");
    let arguments = ["run", plant.to_str().expect("text"), "--for", "1s"];
    let seen = Terminal::start(&arguments, 40).end(None);
    let message = seen.find("address switches at 99").expect("the message");
    let table = seen.find("PMG10").expect("the table");
    assert!(message < table, "{seen}");
}

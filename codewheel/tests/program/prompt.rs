//! Starting the program and talking to it.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, ChildStdout, Command, ExitStatus, Output, Stdio};
use std::time::{Duration, Instant};

/// Runs the program to its end.
pub(crate) fn codewheel(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_codewheel"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program runs")
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What the program prints where it succeeds.
#[track_caller]
pub(crate) fn printed(arguments: &[&str]) -> String {
    let output = codewheel(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
    String::from_utf8(output.stdout).expect("text")
}

/// The path of an example plant.
pub(crate) fn example(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name)
}

/// The program while it runs; killed when dropped.
pub(crate) struct Running {
    child: Child,
    out: Option<BufReader<ChildStdout>>,
}

impl Running {
    pub(crate) fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_codewheel"))
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let out = child.stdout.take().map(BufReader::new);
        Self { child, out }
    }

    /// Plays `model` on a free TCP port; the program and its address.
    pub(crate) fn encoder(model: &str, more: &[&str]) -> (Self, String) {
        let bus = ["encoder", model, "--bus", "slcan-listen:127.0.0.1:0", "--address", "5"];
        let mut running = Self::start(&[&bus, more].concat());
        let line = running.line();
        let prefix = format!("ready {model} address 5 on slcan-listen:");
        let address = line.strip_prefix(&prefix).unwrap_or_else(|| panic!("not ready: {line:?}"));
        (running, address.to_owned())
    }

    /// The next line of its stderr.
    pub(crate) fn message(&mut self) -> String {
        let err = self.child.stderr.as_mut().expect("a pipe");
        let mut line = Vec::new();
        let mut octet = [0];
        // Octet by octet, so that what follows is still there for `end`.
        while err.read(&mut octet).expect("stderr") == 1 && octet != *b"\n" {
            line.push(octet[0]);
        }
        String::from_utf8(line).expect("stderr is text")
    }

    /// Closes our end of its stdout.
    pub(crate) fn close_stdout(&mut self) {
        self.out = None;
    }

    /// Reads away what it prints from now on, so that it never waits for us.
    #[cfg(unix)]
    pub(crate) fn ignore_stdout(&mut self) {
        let out = self.out.take();
        std::thread::spawn(move || {
            out.map(|mut out| std::io::copy(&mut out, &mut std::io::sink()))
        });
    }

    /// The next line of its stdout.
    pub(crate) fn line(&mut self) -> String {
        let mut line = String::new();
        let out = self.out.as_mut().expect("stdout is open");
        out.read_line(&mut line).expect("stdout");
        line.trim_end().to_owned()
    }

    #[cfg(unix)]
    pub(crate) fn signal(&self, signal: rustix::process::Signal) {
        let id = rustix::process::Pid::from_child(&self.child);
        rustix::process::kill_process(id, signal).expect("the program lives");
    }

    /// Waits for its end and returns what it wrote to stderr.
    pub(crate) fn end(mut self) -> (ExitStatus, String) {
        let deadline = Instant::now() + Duration::from_secs(20);
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                break status;
            }
            assert!(Instant::now() < deadline, "the program does not end");
            std::thread::sleep(Duration::from_millis(5));
        };
        let mut text = String::new();
        if let Some(mut err) = self.child.stderr.take() {
            err.read_to_string(&mut text).expect("stderr is text");
        }
        (status, text)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A SLCAN client written for these tests: octets out, lines in.
pub(crate) struct Client {
    stream: BufReader<TcpStream>,
}

impl Client {
    pub(crate) fn connect(address: &str) -> Self {
        let stream = TcpStream::connect(address).expect("the encoder listens");
        stream.set_read_timeout(Some(Duration::from_secs(10))).expect("a time-out");
        let mut client = Self { stream: BufReader::new(stream) };
        client.send("O");
        assert_eq!(client.line(), "", "O is answered with CR");
        client
    }

    pub(crate) fn send(&mut self, line: &str) {
        self.stream.get_mut().write_all(format!("{line}\r").as_bytes()).expect("connected");
    }

    /// The next line, without its CR.
    pub(crate) fn line(&mut self) -> String {
        let mut octets = Vec::new();
        self.stream.read_until(b'\r', &mut octets).expect("a line in time");
        assert_eq!(octets.pop(), Some(b'\r'), "the connection was closed");
        String::from_utf8(octets).expect("ASCII")
    }

    /// The next line that is a frame with `identifier`.
    pub(crate) fn frame(&mut self, identifier: &str) -> String {
        loop {
            let line = self.line();
            if let Some(frame) = line.strip_prefix(&format!("t{identifier}")) {
                return frame.to_owned();
            }
        }
    }

    /// Waits until the encoder at address 5 is on-line: it asks for duplicates twice, and answers
    /// an allocation by master 10 a second later.
    pub(crate) fn allocate(&mut self) {
        let deadline = Instant::now() + Duration::from_secs(10);
        self.stream.get_ref().set_read_timeout(Some(Duration::from_millis(100))).expect("set");
        loop {
            assert!(Instant::now() < deadline, "no answer to Allocate");
            self.send("t42E60A4B0301030A");
            let mut octets = Vec::new();
            while let Ok(1..) = self.stream.read_until(b'\r', &mut octets) {}
            if String::from_utf8_lossy(&octets).contains("t42B30ACB00") {
                break;
            }
        }
        self.stream.get_ref().set_read_timeout(Some(Duration::from_secs(10))).expect("set");
    }

    /// The body of the response to an unfragmented request.
    pub(crate) fn ask(&mut self, request: &str) -> String {
        self.send(&format!("t42C{}0A{request}", request.len() / 2 + 1));
        self.frame("42B")[3..].to_owned()
    }

    /// Sets a four-octet attribute of class 2Fh, in the two fragments it takes.
    pub(crate) fn set(&mut self, attribute: u8, value: u32) -> String {
        let octets: String = value.to_le_bytes().iter().map(|o| format!("{o:02X}")).collect();
        let (first, last) = octets.split_at(4);
        self.send(&format!("t42C88A00102F01{attribute:02X}{first}"));
        assert_eq!(self.frame("42B"), "38AC000");
        self.send(&format!("t42C48A81{last}"));
        assert_eq!(self.frame("42B"), "38AC100");
        self.frame("42B")[3..].to_owned()
    }
}

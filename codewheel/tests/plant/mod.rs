//! A plant that another process runs, for conversations on paper that need somebody to talk to.
//!
//! On paper `127.0.0.1:4001` stands for the port of its DeviceNet and `127.0.0.1:4002` for that of
//! its PROFIBUS; the plant takes free ones.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;

/// The ports on paper, by the kind of their bus.
const PORTS: [(&str, &str); 2] =
    [("slcan-listen:", "127.0.0.1:4001"), ("rs485-listen:", "127.0.0.1:4002")];

/// A plant that runs; killed when dropped.
pub(crate) struct Plant {
    child: Child,
    /// The port of each kind of bus.
    ports: BTreeMap<&'static str, String>,
}

impl Plant {
    /// Runs the plant of `file` with `codewheel`, on free ports where it says port 0.
    pub(crate) fn start(codewheel: &str, file: &Path) -> Self {
        let mut child = Command::new(codewheel)
            .args(["run", file.to_str().expect("text")])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
        let text = fs::read_to_string(file).expect("a plant");
        let mut ports = BTreeMap::new();
        for _ in text.lines().filter(|line| line.starts_with("[[bus]]")) {
            let line = lines.next().expect("a line for each bus").expect("text");
            let port = PORTS.into_iter().find_map(|(kind, _)| {
                let uri = line.split_whitespace().find_map(|word| word.strip_prefix(kind))?;
                Some((kind, uri.strip_suffix(':')?.to_owned()))
            });
            ports.extend([port.unwrap_or_else(|| panic!("{}: {line}", file.display()))]);
        }
        // What else it says must not fill the pipe.
        thread::spawn(move || lines.for_each(drop));
        Self { child, ports }
    }

    /// `text` with the ports that it has in place of those on paper.
    pub(crate) fn at_its_ports(&self, text: &str) -> String {
        self.each_port().fold(text.to_owned(), |text, (port, named)| text.replace(named, port))
    }

    /// `text` with the ports on paper in place of those that it has.
    #[allow(dead_code, reason = "not every test writes down what it has heard")]
    pub(crate) fn on_paper(&self, text: &str) -> String {
        self.each_port().fold(text.to_owned(), |text, (port, named)| text.replace(port, named))
    }

    fn each_port(&self) -> impl Iterator<Item = (&str, &'static str)> {
        PORTS.into_iter().filter_map(|(kind, named)| Some((self.ports.get(kind)?.as_str(), named)))
    }
}

impl Drop for Plant {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

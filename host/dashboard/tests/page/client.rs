//! A plant with a page, and a client of a few lines that knows nothing of the server.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use codewheel_dashboard::{Dashboard, Settings};
use codewheel_plant::{Plant, Running};
use serde_json::{Map, Value};

/// Two buses with a device and a master each, and one device alone.
const PLANT: &str = r#"
[[bus]]
name = "line"
baud = "500k"

[[device]]
bus = "line"
name = "drive"
model = "amg11-d29"
address = 5

[[device]]
bus = "line"
name = "spare/1"
model = "hmg10-d13"
address = 9
termination = true

[[master]]
bus = "line"
kind = "scanner"
name = "scanner"
address = 0

[[bus]]
name = "field"
kind = "profibus"

[[device]]
bus = "field"
name = "table"
model = "amg81-p29"
address = 3

[[master]]
bus = "field"
kind = "dp-master"
name = "master"
address = 2
"#;

/// The longest that anything may take on a busy machine.
const PATIENCE: Duration = Duration::from_secs(20);

/// A plant with a page.
pub(crate) struct Page {
    dashboard: Dashboard,
    plant: Arc<Running>,
}

/// An answer.
pub(crate) struct Answer {
    pub(crate) status: u16,
    /// Names in lower case.
    head: Vec<(String, String)>,
    pub(crate) body: String,
}

/// A stream of events.
pub(crate) struct Events {
    lines: BufReader<TcpStream>,
    pub(crate) state: Value,
}

impl Page {
    pub(crate) fn start() -> Self {
        Self::with(Settings::default())
    }

    pub(crate) fn with(settings: Settings) -> Self {
        let plant = Plant::parse(PLANT, "test.toml", Path::new("")).expect("a plant");
        let plant = Arc::new(plant.start(Duration::from_secs(1)).expect("it runs"));
        let listen = settings.listen.or(Some(SocketAddr::from(([127, 0, 0, 1], 0))));
        let settings = Settings { listen, name: "test.toml".into(), ..settings };
        let dashboard = Dashboard::start(Arc::clone(&plant), settings).expect("a page");
        Self { dashboard, plant }
    }

    pub(crate) fn address(&self) -> SocketAddr {
        self.dashboard.address()
    }

    /// What the plant is without its page: nobody else may hold it then.
    pub(crate) fn close(self) -> Running {
        drop(self.dashboard);
        let deadline = Instant::now() + PATIENCE;
        let mut plant = self.plant;
        loop {
            // A question under way lets go of it when its bus answers.
            match Arc::try_unwrap(plant) {
                Ok(running) => return running,
                Err(held) => plant = held,
            }
            assert!(Instant::now() < deadline, "the page holds the plant");
            std::thread::yield_now();
        }
    }

    /// Sends a request as it stands, with line feeds as people write them.
    pub(crate) fn send(&self, head: &str, body: &str) -> Answer {
        let stream = self.connect(head, body);
        Answer::read(BufReader::new(stream))
    }

    fn connect(&self, head: &str, body: &str) -> TcpStream {
        let mut stream = TcpStream::connect(self.address()).expect("the page is there");
        stream.set_read_timeout(Some(PATIENCE)).expect("a time-out");
        let head = head.trim_end().replace('\n', "\r\n");
        let length = body.len();
        // A server that has read enough may answer and close before it has read all.
        let _ =
            write!(stream, "{head}\r\nConnection: close\r\nContent-Length: {length}\r\n\r\n{body}");
        stream
    }

    pub(crate) fn get(&self, path: &str) -> Answer {
        self.send(&format!("GET {path} HTTP/1.1\nHost: {}", self.address()), "")
    }

    /// What `GET path` answers.
    pub(crate) fn json(&self, path: &str) -> Value {
        let answer = self.get(path);
        assert_eq!(answer.status, 200, "{path}: {}", answer.body);
        answer.json()
    }

    /// Sends `body` as the page does.
    pub(crate) fn ask(&self, method: &str, path: &str, body: &str) -> Answer {
        let address = self.address();
        let head = format!(
            "{method} /api/v1/buses/{path} HTTP/1.1\nHost: {address}\nOrigin: http://{address}\n\
             Sec-Fetch-Site: same-origin\nContent-Type: application/json"
        );
        self.send(&head, body)
    }

    /// Does something that succeeds, and gives the message.
    #[track_caller]
    pub(crate) fn done(&self, method: &str, path: &str, body: &str) -> String {
        let answer = self.ask(method, path, body);
        assert_eq!(answer.status, 200, "{method} {path} {body}: {}", answer.body);
        let json = answer.json();
        assert_eq!(json["ok"], true);
        json["message"].as_str().expect("a message").to_owned()
    }

    pub(crate) fn events(&self, query: &str) -> Events {
        let address = self.address();
        let head = format!("GET /api/v1/events{query} HTTP/1.1\nHost: {address}");
        let mut lines = BufReader::new(self.connect(&head, ""));
        let (status, head) = read_head(&mut lines);
        assert_eq!(status, 200);
        assert!(head.contains(&("content-type".into(), "text/event-stream".into())), "{head:?}");
        Events { lines, state: Value::Null }
    }
}

impl Answer {
    fn read(mut stream: BufReader<TcpStream>) -> Self {
        let (status, head) = read_head(&mut stream);
        let mut body = String::new();
        stream.read_to_string(&mut body).expect("a text");
        Self { status, head, body }
    }

    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        self.head.iter().find_map(|(known, value)| (known == name).then_some(value.as_str()))
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.body))
    }

    /// The detail of the problem that this is.
    #[track_caller]
    pub(crate) fn problem(&self, status: u16) -> String {
        assert_eq!(self.status, status, "{}", self.body);
        assert_eq!(self.header("content-type"), Some("application/problem+json"));
        let json = self.json();
        assert_eq!(json["status"], status);
        for member in ["type", "title"] {
            assert!(json[member].as_str().is_some_and(|text| !text.is_empty()), "{json}");
        }
        json["detail"].as_str().expect("a detail").to_owned()
    }
}

fn read_head(lines: &mut impl BufRead) -> (u16, Vec<(String, String)>) {
    let mut line = String::new();
    lines.read_line(&mut line).expect("a status");
    let status = line.split(' ').nth(1).and_then(|code| code.parse().ok());
    let status = status.unwrap_or_else(|| panic!("no status: {line:?}"));
    let mut head = Vec::new();
    loop {
        line.clear();
        lines.read_line(&mut line).expect("a header");
        match line.trim_end().split_once(": ") {
            Some((name, value)) => head.push((name.to_lowercase(), value.to_owned())),
            None => return (status, head),
        }
    }
}

impl Events {
    /// The next event and its data. What belongs to the chunks of HTTP is passed over.
    pub(crate) fn next(&mut self) -> (String, Value) {
        let mut name = String::new();
        let mut line = String::new();
        loop {
            line.clear();
            assert_ne!(self.lines.read_line(&mut line).expect("a line"), 0, "the stream has ended");
            if let Some(event) = line.strip_prefix("event: ") {
                name = event.trim_end().to_owned();
            } else if let Some(data) = line.strip_prefix("data: ") {
                let data: Value = serde_json::from_str(data.trim_end()).expect("JSON");
                if name == "state" {
                    let state = std::mem::take(&mut self.state);
                    self.state = merged(state, &data);
                }
                return (name, data);
            }
        }
    }

    /// The data of the next event with this name.
    pub(crate) fn next_of(&mut self, wanted: &str) -> Value {
        let deadline = Instant::now() + PATIENCE;
        while Instant::now() < deadline {
            let (name, data) = self.next();
            if name == wanted {
                return data;
            }
        }
        panic!("no event {wanted}");
    }

    /// Reads on until the state is as `wanted` has it.
    #[track_caller]
    pub(crate) fn until(&mut self, what: &str, wanted: impl Fn(&Value) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !wanted(&self.state) {
            assert!(Instant::now() < deadline, "{what}: not in {:#}", self.state);
            self.next_of("state");
        }
    }

    pub(crate) fn device(&self, bus: &str, device: &str) -> &Value {
        &self.state["buses"][bus]["devices"][device]
    }
}

/// What the merge patch `patch` makes of `target`: the pseudocode of RFC 7396, section 2.
fn merged(target: Value, patch: &Value) -> Value {
    let Value::Object(patch) = patch else { return patch.clone() };
    let mut target = match target {
        Value::Object(members) => members,
        _ => Map::new(),
    };
    for (name, value) in patch {
        let older = target.remove(name).unwrap_or(Value::Null);
        if !value.is_null() {
            target.insert(name.clone(), merged(older, value));
        }
    }
    Value::Object(target)
}

//! A device of twenty lines, and a bench that talks to it in candump's notation.

use codewheel_devicenet::explicit::{Error, GeneralStatus, Path, Service};
use codewheel_devicenet::{
    Application, Class, Done, Event, Identity, MacId, NetworkSettings, Request, Reset, Server,
    SwitchPositions,
};
use codewheel_station::can::{self, BitRate, Frame, Identifier};
use codewheel_station::{Duration, Instant, Station, Writer};

/// A counter with a settable value (class 64h, instance 1: attribute 1 UINT, attribute 2 a text of
/// 40 octets, service 16h done later) and two assemblies of four and five octets.
#[derive(Clone, Debug, Default)]
pub(crate) struct Toy {
    pub(crate) value: u16,
    pub(crate) kept: Option<NetworkSettings>,
    pub(crate) events: Vec<Event>,
    pub(crate) produced: u32,
    pub(crate) reset: Option<Reset>,
    /// Whether the data have changed since they were produced.
    pub(crate) moved: bool,
    /// Whether the next look at the data, for whatever production, finds them changed.
    pub(crate) moves_when_produced: bool,
}

pub(crate) const TEXT: &[u8; 40] = b"a text that does not fit a single frame.";

impl Application for Toy {
    fn identity(&self) -> Identity {
        Identity {
            vendor: 0x1234,
            device_type: 0,
            product_code: 0x0B,
            major_revision: 1,
            minor_revision: 2,
            serial: 0xCAFE_F00D,
            product_name: "Toy",
        }
    }
    fn switches(&self) -> SwitchPositions {
        SwitchPositions { mac: 7, bit_rate: BitRate::Kbit500 }
    }
    fn assembly_size(&self, instance: u8) -> Option<usize> {
        [None, Some(4), Some(5)].get(usize::from(instance)).copied().flatten()
    }
    fn produce(&mut self, _: Instant, instance: u8, octets: &mut [u8; 8]) -> usize {
        self.produced += 1;
        self.moved |= std::mem::take(&mut self.moves_when_produced);
        octets[..4].copy_from_slice(&self.produced.to_le_bytes());
        usize::from(instance) + 3
    }
    fn highest_assembly(&self) -> u8 {
        2
    }
    fn has_changed(&mut self, _: u8) -> bool {
        self.moved
    }
    fn change_produced(&mut self, _: u8) {
        self.moved = false;
    }
    fn class(&self, class: u8) -> Option<Class> {
        (class == 0x64).then_some(Class { revision: 3, max_instance: 1 })
    }
    fn get(&mut self, _: Instant, path: Path, out: &mut Writer<'_>) -> Result<(), Error> {
        match (path.instance, path.attribute) {
            (1, 1) => out.u16_le(self.value).expect("room"),
            (1, 2) => out.octets(TEXT).expect("room"),
            (0 | 1, _) => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into()),
            _ => return Err(GeneralStatus::OBJECT_DOES_NOT_EXIST.into()),
        }
        Ok(())
    }
    fn set(&mut self, _: Instant, path: Path, data: &[u8]) -> Result<Done, Error> {
        match (path.attribute, data) {
            (1, &[low, high, ..]) => self.value = u16::from_le_bytes([low, high]),
            (1, _) => return Err(GeneralStatus::NOT_ENOUGH_DATA.into()),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE.into()),
        }
        Ok(Done::Now)
    }
    fn serve(
        &mut self,
        _: Instant,
        request: Request<'_>,
        _: &mut Writer<'_>,
    ) -> Result<Done, Error> {
        if request.service == Service::SAVE {
            return Ok(Done::Later);
        }
        Err(GeneralStatus::SERVICE_NOT_SUPPORTED.into())
    }
    fn reset(&mut self, _: Instant, reset: Reset) -> Result<Done, Error> {
        self.reset = Some(reset);
        Ok(if reset == Reset::Defaults { Done::Later } else { Done::Now })
    }
    fn keep(&mut self, _: Instant, settings: NetworkSettings) {
        self.kept = Some(settings);
    }
    fn notice(&mut self, _: Instant, event: Event) {
        self.events.push(event);
    }
}

/// A server with its toy, as one station.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) server: Server,
    pub(crate) toy: Toy,
}

impl Node {
    pub(crate) fn new(mac: u8) -> Self {
        let mac = MacId::new(mac).expect("a MAC ID");
        let server = Server::new(mac, BitRate::Kbit500, NetworkSettings::default());
        Self { server, toy: Toy::default() }
    }
}

impl Station for Node {
    type Input<'a> = can::Input<'a>;
    type Output = Frame;
    fn handle(&mut self, now: Instant, input: can::Input<'_>) {
        self.server.handle(now, input, &mut self.toy);
    }
    fn advance(&mut self, now: Instant) {
        self.server.advance(now, &mut self.toy);
    }
    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        self.server.transmit(now, &mut self.toy)
    }
    fn deadline(&self) -> Option<Instant> {
        self.server.deadline()
    }
}

/// Reads `42E#0A4B0301030A`; blanks in the data are allowed.
pub(crate) fn frame(candump: &str) -> Frame {
    let (identifier, data) = candump.split_once('#').expect("identifier#data");
    let identifier = u16::from_str_radix(identifier, 16).expect("a hexadecimal identifier");
    let digits: String = data.chars().filter(|c| !c.is_whitespace()).collect();
    let octets: Vec<u8> = digits
        .as_bytes()
        .chunks(2)
        .map(|pair| std::str::from_utf8(pair).expect("ASCII"))
        .map(|pair| u8::from_str_radix(pair, 16).expect("hexadecimal data"))
        .collect();
    Frame::new(Identifier::Standard(identifier), &octets).expect("a CAN frame")
}

/// One node on a medium that takes every frame at once and acknowledges it.
#[derive(Clone, Debug)]
pub(crate) struct Bench {
    pub(crate) node: Node,
    pub(crate) now: Instant,
}

impl Bench {
    /// The node at MAC ID 5, switched on just now.
    pub(crate) fn power_up() -> Self {
        Self { node: Node::new(5), now: Instant::ZERO }
    }

    /// The node at MAC ID 5, on-line.
    pub(crate) fn on_line() -> Self {
        let mut bench = Self::power_up();
        bench.collect();
        bench.wait(Duration::from_millis(2_000));
        assert!(bench.node.toy.events.contains(&Event::OnLine));
        bench
    }

    /// On-line, explicit and poll connection allocated by master 10.
    pub(crate) fn allocated() -> Self {
        let mut bench = Self::on_line();
        bench.says("42E#0A4B0301030A", &["42B#0ACB00"]);
        bench
    }

    /// Allocated, and the poll connection established with 100 ms.
    pub(crate) fn polled() -> Self {
        let mut bench = Self::allocated();
        bench.asks("10 05 02 09 6400", "90 6400");
        bench
    }

    /// On-line, `choice` allocated by master 10, and the explicit connection without a time-out.
    pub(crate) fn with(choice: u8) -> Self {
        let mut bench = Self::on_line();
        bench.says(&format!("42E#0A4B0301{choice:02X}0A"), &["42B#0ACB00"]);
        bench.asks("10 05 01 09 00 00", "90 0000");
        bench
    }

    /// A frame arrives; what the node has to say waits for the wire.
    pub(crate) fn hears(&mut self, candump: &str) {
        self.node.handle(self.now, can::Input::Frame(&frame(candump)));
    }

    /// One frame goes from the node to its controller, which does not report it as sent.
    pub(crate) fn hands_out(&mut self) -> Option<Frame> {
        self.node.transmit(self.now)
    }

    /// The controller reports `frame` as sent.
    pub(crate) fn is_sent(&mut self, frame: &Frame) {
        self.node.handle(self.now, can::Input::Sent(frame));
    }

    /// Takes everything the node has to send now.
    pub(crate) fn collect(&mut self) -> Vec<String> {
        let mut sent = Vec::new();
        while let Some(frame) = self.node.transmit(self.now) {
            sent.push(frame.to_string());
            self.node.handle(self.now, can::Input::Sent(&frame));
            assert!(sent.len() < 100, "the node does not stop sending: {sent:?}");
        }
        sent
    }

    /// A frame arrives; what the node sends in return must be `expected`.
    #[track_caller]
    pub(crate) fn says(&mut self, candump: &str, expected: &[&str]) {
        self.node.handle(self.now, can::Input::Frame(&frame(candump)));
        assert_eq!(self.collect(), expected, "in answer to {candump}");
    }

    /// Sends an explicit request of master 10 (fragmented if it must be) and checks the body that
    /// comes back (put together if it was fragmented). Both in hexadecimal digits.
    #[track_caller]
    pub(crate) fn asks(&mut self, request: &str, expected: &str) {
        let answer = self.ask(request);
        let expected: String = expected.chars().filter(|c| !c.is_whitespace()).collect();
        assert_eq!(answer.as_deref(), Some(expected.as_str()), "in answer to {request}");
    }

    /// The body of the response to an explicit request of master 10, or `None` for silence.
    pub(crate) fn ask(&mut self, request: &str) -> Option<String> {
        let body = frame(&format!("000#{}", &hex(request)[..hex(request).len().min(16)]));
        let octets: Vec<u8> = if hex(request).len() > 16 {
            hex(request)
                .as_bytes()
                .chunks(2)
                .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap())
                .collect()
        } else {
            body.data().to_vec()
        };
        let mut frames = Vec::new();
        if octets.len() <= 7 {
            let mut data = vec![0x0A];
            data.extend_from_slice(&octets);
            frames.push(Frame::standard(0x42C, &data));
        } else {
            let last = octets.len().div_ceil(6) - 1;
            for (index, chunk) in octets.chunks(6).enumerate() {
                let kind = if index == 0 {
                    0
                } else if index == last {
                    0x80
                } else {
                    0x40
                };
                let mut data = vec![0x8A, kind | index as u8];
                data.extend_from_slice(chunk);
                frames.push(Frame::standard(0x42C, &data));
            }
        }
        let count = frames.len();
        let mut answer: Option<Vec<u8>> = None;
        let mut incoming = Vec::new();
        for (index, frame) in frames.iter().enumerate() {
            self.node.handle(self.now, can::Input::Frame(frame));
            incoming = self.collect();
            if count > 1 {
                let acknowledge = format!("42B#8A{:02X}00", 0xC0 | index);
                assert_eq!(incoming.remove(0), acknowledge);
            }
        }
        // Acknowledge the fragments of the response until it is whole.
        while !incoming.is_empty() {
            assert_eq!(incoming.len(), 1, "one explicit frame at a time");
            let piece = frame(&incoming.remove(0));
            assert_eq!(piece.identifier(), Identifier::Standard(0x42B));
            match piece.data() {
                [0x0A, whole @ ..] => return Some(to_hex(whole)),
                [0x8A, octet, rest @ ..] => {
                    answer.get_or_insert_default().extend_from_slice(rest);
                    let acknowledge = format!("42C#8A{:02X}00", 0xC0 | octet & 0x3F);
                    self.node.handle(self.now, can::Input::Frame(&frame(&acknowledge)));
                    if octet >> 6 == 2 {
                        assert!(self.collect().is_empty(), "nothing follows the last fragment");
                        return answer.as_deref().map(to_hex);
                    }
                    incoming = self.collect();
                }
                other => panic!("not an explicit message: {other:02X?}"),
            }
        }
        None
    }

    /// Lets time pass from deadline to deadline and returns what the node sent meanwhile.
    pub(crate) fn wait(&mut self, span: Duration) -> Vec<String> {
        self.log(span).into_iter().map(|(_, frame)| frame).collect()
    }

    /// The same, with the time of each frame.
    pub(crate) fn log(&mut self, span: Duration) -> Vec<(Instant, String)> {
        let end = self.now + span;
        let mut sent = Vec::new();
        while let Some(deadline) = self.node.deadline().filter(|deadline| *deadline <= end) {
            assert!(deadline >= self.now, "a deadline lies in the past");
            self.now = deadline;
            self.node.advance(self.now);
            sent.extend(self.collect().into_iter().map(|frame| (self.now, frame)));
            assert!(
                self.node.deadline() != Some(deadline),
                "the deadline {deadline} is not served"
            );
        }
        self.now = end;
        self.node.advance(self.now);
        sent.extend(self.collect().into_iter().map(|frame| (self.now, frame)));
        sent
    }
}

fn hex(text: &str) -> String {
    text.chars().filter(|c| !c.is_whitespace()).collect()
}

pub(crate) fn to_hex(octets: &[u8]) -> String {
    octets.iter().map(|octet| format!("{octet:02X}")).collect()
}

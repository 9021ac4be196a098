//! One DeviceNet encoder on an ideal medium, at rest, with a master that asks it explicitly.

use codewheel_device::{DeviceNetEncoder, Factory, Product, Switches};
use codewheel_encoder::{Sample, Sensor, choose};
use codewheel_station::can::{BitRate, Frame, Input};
use codewheel_station::{Duration, Instant, Station};

/// A shaft that stands at code 0.
#[derive(Clone, Debug)]
pub(crate) struct AtRest;

impl Sensor for AtRest {
    fn sample(&mut self, _: Instant) -> Sample {
        Sample::default()
    }
    fn changes_at(&self, _: Instant) -> Option<Instant> {
        None
    }
}

/// The encoder has MAC 5, the master MAC 10.
const TO_ENCODER: u16 = 0x42C;
const UNCONNECTED: u16 = 0x42E;
const FROM_ENCODER: u16 = 0x42B;
const MASTER: u8 = 10;

const GET: u8 = 0x0E;
const SET: u8 = 0x10;

pub(crate) struct Bench {
    device: DeviceNetEncoder<AtRest>,
    now: Instant,
}

impl Bench {
    /// A new encoder, on-line, not allocated.
    pub(crate) fn on_line(model: &str) -> Self {
        let product = Product::find(model).expect("a model of the catalogue");
        let device = DeviceNetEncoder::power_up(
            Instant::ZERO,
            product,
            Factory::with_serial(1),
            Switches::set_to(5, BitRate::Kbit500),
            &choose(&[], &[]),
            AtRest,
        );
        let mut bench = Self { device, now: Instant::ZERO };
        bench.sent();
        let end = bench.now + Duration::from_secs(2);
        while let Some(deadline) = bench.device.deadline().filter(|deadline| *deadline <= end) {
            bench.now = deadline;
            bench.device.advance(deadline);
            bench.sent();
        }
        bench
    }

    /// A new encoder with an explicit connection that never times out.
    pub(crate) fn allocated(model: &str) -> Self {
        let mut bench = Self::on_line(model);
        assert_eq!(bench.allocates(0x01), Ok(()));
        assert_eq!(bench.sets([0x05, 1, 9], &[0, 0]), Ok(()));
        bench
    }

    /// Allocates what `choice` says; otherwise general status and additional code.
    pub(crate) fn allocates(&mut self, choice: u8) -> Result<(), [u8; 2]> {
        self.hears(UNCONNECTED, &[MASTER, 0x4B, 0x03, 0x01, choice, MASTER]);
        match *self.answer() {
            [0xCB, ..] => Ok(()),
            [0x94, general, additional] => Err([general, additional]),
            ref other => panic!("no answer to Allocate: {other:02X?}"),
        }
    }

    /// Get_Attribute_Single.
    #[track_caller]
    pub(crate) fn get(&mut self, [class, instance, attribute]: [u8; 3]) -> Vec<u8> {
        let answer = self.ask(&[GET, class, instance, attribute]);
        assert_eq!(answer[0], GET | 0x80, "{class:02X}/{instance}/{attribute}: {answer:02X?}");
        answer[1..].to_vec()
    }

    /// Set_Attribute_Single; otherwise the general status.
    pub(crate) fn sets(
        &mut self,
        [class, instance, attribute]: [u8; 3],
        data: &[u8],
    ) -> Result<(), u8> {
        let answer = self.ask(&[&[SET, class, instance, attribute], data].concat());
        match *answer {
            [0x94, general, _] => Err(general),
            [first, ..] if first == SET | 0x80 => Ok(()),
            ref other => panic!("no answer to Set: {other:02X?}"),
        }
    }

    /// The answer to an explicit request.
    pub(crate) fn ask(&mut self, request: &[u8]) -> Vec<u8> {
        if request.len() <= 7 {
            self.hears(TO_ENCODER, &[&[MASTER], request].concat());
            return self.answer();
        }
        let last = request.len().div_ceil(6) - 1;
        for (count, part) in request.chunks(6).enumerate() {
            let kind = if count == 0 {
                0x00
            } else if count == last {
                0x80
            } else {
                0x40
            };
            self.hears(TO_ENCODER, &[&[MASTER | 0x80, kind | count as u8], part].concat());
            if count < last {
                let acknowledge = [MASTER | 0x80, 0xC0 | count as u8, 0];
                assert_eq!(self.sent(), [acknowledge.to_vec()]);
            }
        }
        // The acknowledge of the last part goes ahead of the answer.
        let mut sent = self.sent();
        sent.remove(0);
        self.put_together(sent)
    }

    fn answer(&mut self) -> Vec<u8> {
        let sent = self.sent();
        self.put_together(sent)
    }

    /// Puts the parts of an answer together and acknowledges each.
    fn put_together(&mut self, mut sent: Vec<Vec<u8>>) -> Vec<u8> {
        let mut answer = Vec::new();
        loop {
            match sent.first().map(Vec::as_slice) {
                Some([MASTER, whole @ ..]) => return whole.to_vec(),
                Some([0x8A, part, octets @ ..]) => {
                    answer.extend_from_slice(octets);
                    let part = *part;
                    self.hears(TO_ENCODER, &[0x8A, 0xC0 | part & 0x3F, 0]);
                    if part >> 6 == 2 {
                        return answer;
                    }
                    sent = self.sent();
                }
                other => panic!("no explicit answer: {other:02X?}"),
            }
        }
    }

    fn hears(&mut self, id: u16, data: &[u8]) {
        self.device.handle(self.now, Input::Frame(&Frame::standard(id, data)));
    }

    /// The data of what the encoder says on its explicit connection.
    fn sent(&mut self) -> Vec<Vec<u8>> {
        let mut sent = Vec::new();
        while let Some(frame) = self.device.transmit(self.now) {
            self.device.handle(self.now, Input::Sent(&frame));
            let own = frame.to_string().starts_with(&format!("{FROM_ENCODER:03X}#"));
            if own {
                sent.push(frame.data().to_vec());
            }
        }
        sent
    }
}

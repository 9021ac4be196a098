//! An encoder that exchanges data with a master, for the benches.

use codewheel_device::profibus::{Factory, Switches};
use codewheel_device::{Product, ProfibusEncoder};
use codewheel_encoder::{Sample, Sensor, Start};
use codewheel_profibus::{Baud, State, Timing};
use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Instant, Station};

/// A sensor that costs next to nothing: its code moves on from sample to sample, at 1 500 rpm or so.
pub(crate) struct Moving {
    code: u32,
}

impl Sensor for Moving {
    fn sample(&mut self, _: Instant) -> Sample {
        self.code += 100;
        Sample { code: self.code, ..Sample::default() }
    }

    fn changes_at(&self, now: Instant) -> Option<Instant> {
        Some(now)
    }
}

/// Slave 7 of master 2, class 2, 3600 steps and 256 turns, configuration F1h, watchdog 200 ms.
pub(crate) struct Exchanging {
    pub(crate) device: ProfibusEncoder<Moving>,
    pub(crate) now: Instant,
    frame_count: bool,
}

/// Without and with FCB, outputs 0; the same with the preset 5.
const REQUESTS: [[[u8; 13]; 2]; 2] = [
    [request(0x5D, [0, 0, 0, 0]), request(0x7D, [0, 0, 0, 0])],
    [request(0x5D, [0x80, 0, 0, 5]), request(0x7D, [0x80, 0, 0, 5])],
];

/// Data_Exchange of master 2 with slave 8.
#[allow(dead_code, reason = "not every bench asks for it")]
pub(crate) const OF_OTHERS: [u8; 13] =
    [0x68, 7, 7, 0x68, 8, 2, 0x7D, 0, 0, 0, 0, 8 + 2 + 0x7D, 0x16];

const fn request(function: u8, outputs: [u8; 4]) -> [u8; 13] {
    let [a, b, c, d] = outputs;
    let sum = 7_u8.wrapping_add(2).wrapping_add(function).wrapping_add(a).wrapping_add(d);
    [0x68, 7, 7, 0x68, 7, 2, function, a, b, c, d, sum, 0x16]
}

impl Exchanging {
    pub(crate) fn new() -> Box<Self> {
        let product = Product::find("amg11-p29").expect("in the catalogue");
        let factory = Factory {
            model: product.encoder,
            serial: 1,
            baud: Baud::Fixed(BaudRate::Mbit12),
            timing: Timing::Exact,
        };
        let device = ProfibusEncoder::power_up(
            Instant::ZERO,
            product,
            factory,
            Switches::set_to(7),
            &Start::Fresh { interrupted: false },
            Moving { code: 1_000 },
        );
        let mut exchanging = Self { device, now: Instant::ZERO, frame_count: false };
        let set_prm = [
            0x68, 0x16, 0x16, 0x68, 0x87, 0x82, 0x5C, 0x3D, 0x3E, 0xB8, 0x01, 0x14, 0x0B, 0x05,
            0x9B, 0x00, 0x00, 0x0A, 0x00, 0x00, 0x0E, 0x10, 0x00, 0x0E, 0x10, 0x00, 0x9E, 0x16,
        ];
        let chk_cfg = [0x68, 6, 6, 0x68, 0x87, 0x82, 0x7C, 0x3E, 0x3E, 0xF1, 0xF2, 0x16];
        for telegram in [&set_prm[..], &chk_cfg] {
            exchanging.pause();
            assert!(exchanging.asks(telegram));
        }
        assert_eq!(exchanging.device.slave().state(), State::DataExchange);
        for _ in 0..10 {
            exchanging.pause();
            assert!(exchanging.exchange(false));
        }
        Box::new(exchanging)
    }

    /// To the end of the next request: 33 idle bits and 13 characters.
    pub(crate) fn pause(&mut self) {
        self.now += BaudRate::Mbit12.bits(33);
        self.now += BaudRate::Mbit12.characters(13);
    }

    /// A request in, its answer out, a T_SDR of 11 bits later.
    #[inline]
    fn asks(&mut self, octets: &[u8]) -> bool {
        self.device.handle(self.now, Input::Octets(octets));
        self.now += Duration::from_nanos(1_000);
        self.device.transmit(self.now).is_some()
    }

    /// A Data_Exchange with a new FCB in, its answer out; whether there was one.
    #[inline]
    pub(crate) fn exchange(&mut self, preset: bool) -> bool {
        self.frame_count = !self.frame_count;
        let [without, with] = &REQUESTS[usize::from(preset)];
        self.asks(if self.frame_count { with } else { without })
    }

    /// Slave_Diag in, its answer out.
    #[allow(dead_code, reason = "not every bench asks for it")]
    pub(crate) fn diagnosis(&mut self) -> bool {
        self.asks(&[0x68, 5, 5, 0x68, 0x87, 0x82, 0x7C, 0x3C, 0x3E, 0xFF, 0x16])
    }
}

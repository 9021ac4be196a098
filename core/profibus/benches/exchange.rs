//! What a Data_Exchange costs, in instructions: counted under valgrind, so the same on a busy
//! machine as on a quiet one.
//!
//! ```text
//! cargo install gungraun-runner --version 0.20.0      # once; as the gungraun in Cargo.lock
//! cargo bench -p codewheel-profibus --bench exchange  # needs valgrind
//! ```
//!
//! The first figure is the one that matters: a request of four outputs in and the answer with four
//! inputs out. At most 380 instructions are wanted on a link that knows no bit times, 420 on one that
//! does; a device that does something adds its own. Beside it, what both this crate and `profirust`
//! do: the request taken apart, the answer built.

// The macros make public items without documentation.
#![allow(missing_docs)]

use std::hint::black_box;

use codewheel_profibus::function_code::{FunctionCode, Reply};
use codewheel_profibus::telegram::{Head, Telegram};
use codewheel_profibus::{
    Application, Baud, Event, Lengths, Refused, Settings, Slave, State, Timing,
};
use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Instant, Writer};
use gungraun::{library_benchmark, library_benchmark_group, main};
use profirust::fdl;

/// A device that costs next to nothing.
struct Echo([u8; 4]);

impl Application for Echo {
    fn parameterize(&mut self, _: Instant, _: &[u8]) -> Result<(), Refused> {
        Ok(())
    }
    fn parameters_refused(&mut self, _: Instant) {}
    fn configure(&mut self, _: Instant, _: &[u8]) -> Result<Lengths, Refused> {
        Ok(Lengths { inputs: 4, outputs: 4 })
    }
    fn configuration(&self, out: &mut Writer<'_>) {
        out.u8(0xF1).expect("room");
    }
    fn data_exchange_begins(&mut self, _: Instant) {}
    fn inputs(&mut self, _: Instant, octets: &mut [u8]) {
        if let Some(inputs) = octets.first_chunk_mut() {
            *inputs = self.0;
        }
    }
    fn outputs(&mut self, _: Instant, octets: &[u8]) {
        if let Some(outputs) = octets.first_chunk() {
            self.0 = *outputs;
        }
    }
    fn clear(&mut self, _: Instant) {}
    fn diagnosis(&mut self, _: Instant, out: &mut Writer<'_>) {
        out.u8(1).expect("room");
    }
    fn has_diagnosis(&self) -> bool {
        false
    }
    fn diagnosis_version(&self) -> u16 {
        0
    }
    fn notice(&mut self, _: Instant, _: Event) {}
}

/// Data_Exchange of master 2 with station 7, four octets of outputs.
const REQUEST: [u8; 13] =
    [0x68, 0x07, 0x07, 0x68, 0x07, 0x02, 0x5D, 0x00, 0x00, 0x12, 0x34, 0xAC, 0x16];

/// A slave in data exchange, at the moment before its next request.
struct Exchanging {
    slave: Slave<4>,
    device: Echo,
    now: Instant,
}

impl Exchanging {
    fn new(timing: Timing, baud: Baud) -> Box<Self> {
        let settings = Settings { address: 7, ident_number: 0x059B, baud, timing };
        let now = Instant::from_nanos(1_000_000_000);
        let mut exchanging =
            Box::new(Self { slave: Slave::new(settings), device: Echo([0; 4]), now });
        exchanging.slave.advance(now, &mut exchanging.device);
        let saps = [Some((61, 62)), Some((62, 62)), None, None];
        let data: [&[u8]; 4] = [&[0x88, 1, 20, 11, 0x05, 0x9B, 0], &[0xF1], &[0; 4], &[0; 4]];
        for ((saps, data), code) in saps.into_iter().zip(data).zip([0x6D, 0x5D, 0x7D, 0x5D]) {
            let saps = saps.map(|(destination, source)| codewheel_profibus::telegram::Saps {
                destination,
                source,
            });
            let function_code = FunctionCode(code);
            let request = Head { destination: 7, source: 2, function_code, saps };
            exchanging.answer(request.transmission(data).expect("a request").octets());
        }
        let request =
            Head { destination: 7, source: 2, function_code: FunctionCode(0x7D), saps: None };
        exchanging.answer(request.transmission(&[0; 4]).expect("a request").octets());
        assert_eq!(exchanging.slave.state(), State::DataExchange);
        exchanging.now += Duration::from_millis(1);
        exchanging
    }

    fn answer(&mut self, request: &[u8]) {
        self.now += Duration::from_millis(2);
        self.slave.handle(self.now, Input::Octets(request), &mut self.device);
        self.now = self.slave.deadline().expect("an answer is owed");
        assert!(self.slave.transmit(self.now, &mut self.device).is_some());
    }
}

fn on_a_pc() -> Box<Exchanging> {
    Exchanging::new(Timing::Coarse, Baud::Fixed(BaudRate::Mbit12))
}

fn with_bit_times() -> Box<Exchanging> {
    Exchanging::new(Timing::Exact, Baud::Fixed(BaudRate::Mbit12))
}

fn with_a_found_rate() -> Box<Exchanging> {
    Exchanging::new(Timing::Exact, Baud::Search)
}

// Returns the slave, so that what it costs to get rid of it is not counted.
#[library_benchmark]
#[bench::on_a_pc(on_a_pc())]
#[bench::with_bit_times(with_bit_times())]
#[bench::with_a_found_rate(with_a_found_rate())]
fn request_in_answer_out(mut exchanging: Box<Exchanging>) -> Box<Exchanging> {
    let Exchanging { slave, device, now } = &mut *exchanging;
    slave.handle(*now, Input::Octets(black_box(&REQUEST)), device);
    let due = *now + Duration::from_micros(1);
    assert!(black_box(&slave.transmit(due, device)).is_some());
    exchanging
}

#[library_benchmark]
fn request_taken_apart() -> u8 {
    match Telegram::decode(black_box(&REQUEST)) {
        Ok(Some(Telegram::Data(data))) => data.destination() ^ data.data()[3],
        _ => 0,
    }
}

#[library_benchmark]
fn request_taken_apart_by_profirust() -> u8 {
    match fdl::Telegram::deserialize(black_box(&REQUEST)) {
        Some(Ok((fdl::Telegram::Data(data), _))) => data.h.da ^ data.pdu[3],
        _ => 0,
    }
}

fn room() -> Box<[u8; 256]> {
    Box::new([0; 256])
}

#[library_benchmark]
#[bench::of_four_inputs(room())]
fn answer_built(mut buffer: Box<[u8; 256]>) -> (Box<[u8; 256]>, usize) {
    let function_code = FunctionCode::reply(Reply::DataLow);
    let head = Head { destination: black_box(2), source: black_box(7), function_code, saps: None };
    // As below: the octets are hidden from the compiler, how many they are is not.
    let inputs: &[u8; 4] = black_box(&[0, 0, 0x12, 0x34]);
    let mut out = Writer::new(&mut buffer[..]);
    let written = head.encode(inputs, &mut out);
    let length = written.map_or(0, |()| out.len());
    (buffer, length)
}

#[library_benchmark]
#[bench::of_four_inputs(room())]
fn answer_built_by_profirust(mut buffer: Box<[u8; 256]>) -> (Box<[u8; 256]>, usize) {
    let header = fdl::DataTelegramHeader {
        da: black_box(2),
        sa: black_box(7),
        dsap: None,
        ssap: None,
        fc: fdl::FunctionCode::Response {
            state: fdl::ResponseState::Slave,
            status: fdl::ResponseStatus::DataLow,
        },
    };
    let inputs: &[u8; 4] = black_box(&[0, 0, 0x12, 0x34]);
    let sent =
        fdl::TelegramTx::new(&mut buffer[..])
            .send_data_telegram(header, inputs.len(), |pdu| pdu.copy_from_slice(inputs));
    (buffer, sent.bytes_sent())
}

library_benchmark_group!(
    name = exchange;
    benchmarks =
        request_in_answer_out,
        request_taken_apart,
        request_taken_apart_by_profirust,
        answer_built,
        answer_built_by_profirust
);

main!(library_benchmark_groups = exchange);

//! A device that never changes and allocates nothing, and station 7 that it stands behind.

use codewheel_profibus::function_code::FunctionCode;
use codewheel_profibus::telegram::{Head, Saps};
use codewheel_profibus::{
    Application, Baud, Event, Lengths, Refused, Settings, Slave, State, Timing,
};
use codewheel_station::rs485::{BaudRate, Input, Transmission};
use codewheel_station::{Duration, Instant, Writer};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Still;

pub(crate) const INPUTS: [u8; 4] = [0, 0, 0x12, 0x34];

impl Application for Still {
    fn parameterize(&mut self, _: Instant, user: &[u8]) -> Result<(), Refused> {
        if user.len() > 18 { Err(Refused) } else { Ok(()) }
    }
    fn parameters_refused(&mut self, _: Instant) {}
    fn configure(&mut self, _: Instant, identifiers: &[u8]) -> Result<Lengths, Refused> {
        match identifiers {
            [0xF1] => Ok(Lengths { inputs: 4, outputs: 4 }),
            _ => Err(Refused),
        }
    }
    fn configuration(&self, out: &mut Writer<'_>) {
        out.u8(0xF1).expect("room");
    }
    fn data_exchange_begins(&mut self, _: Instant) {}
    fn inputs(&mut self, _: Instant, octets: &mut [u8]) {
        octets.copy_from_slice(&INPUTS);
    }
    fn outputs(&mut self, _: Instant, octets: &[u8]) {
        assert_eq!(octets.len(), 4);
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

pub(crate) const NOW: Instant = Instant::from_nanos(1_000_000_000);
pub(crate) const GOOD_PARAMETERS: [u8; 7] = [0x80, 0, 0, 11, 0x05, 0x9B, 0];

/// Station 7 in `state`, owned by master 2, without a watchdog.
pub(crate) fn station(state: State) -> Slave<4> {
    let mut slave = Slave::new(Settings {
        address: 7,
        ident_number: 0x059B,
        baud: Baud::Fixed(BaudRate::Mbit12),
        timing: Timing::Coarse,
    });
    if state != State::WaitPrm {
        answer(&mut slave, &request(7, 0x6D, Some((61, 62)), &GOOD_PARAMETERS));
    }
    if state == State::DataExchange {
        answer(&mut slave, &request(7, 0x7D, Some((62, 62)), &[0xF1]));
    }
    assert_eq!(slave.state(), state);
    slave
}

/// A request of master 2.
pub(crate) fn request(
    destination: u8,
    code: u8,
    saps: Option<(u8, u8)>,
    data: &[u8],
) -> Transmission {
    let saps = saps.map(|(destination, source)| Saps { destination, source });
    let head = Head { destination, source: 2, function_code: FunctionCode(code), saps };
    head.transmission(data).expect("a telegram")
}

/// The answer to a telegram; `None` for silence.
pub(crate) fn answer(slave: &mut Slave<4>, telegram: &Transmission) -> Option<Transmission> {
    slave.handle(NOW, Input::Octets(telegram.octets()), &mut Still);
    slave.transmit(NOW + Duration::from_millis(1), &mut Still)
}

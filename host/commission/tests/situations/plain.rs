//! profirust as it comes, on the microsecond and with nothing in between.

use codewheel_commission::profibus::shortest_slot;
use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Instant, Station};
use profirust::Baudrate;
use profirust::dp::{DpMaster, Peripheral, PeripheralOptions};
use profirust::fdl::{FdlActiveStation, ParametersBuilder};
use profirust::phy::ProfibusPhy;
use profirust::time;

pub(crate) struct Plain {
    rate: BaudRate,
    fdl: FdlActiveStation,
    dp: DpMaster<'static>,
    phy: Phy,
}

#[derive(Default)]
struct Phy {
    received: Vec<u8>,
    outgoing: Vec<u8>,
}

impl Plain {
    /// Master 2 with slaves like those of the bench.
    pub(crate) fn new(rate: BaudRate, slaves: &[u8]) -> Self {
        let told = match rate {
            BaudRate::Kbit9_6 => Baudrate::B9600,
            BaudRate::Kbit19_2 => Baudrate::B19200,
            BaudRate::Kbit45_45 => Baudrate::B45450,
            BaudRate::Kbit93_75 => Baudrate::B93750,
            BaudRate::Kbit187_5 => Baudrate::B187500,
            BaudRate::Kbit500 => Baudrate::B500000,
            BaudRate::Mbit1_5 => Baudrate::B1500000,
            BaudRate::Mbit3 => Baudrate::B3000000,
            BaudRate::Mbit6 => Baudrate::B6000000,
            BaudRate::Mbit12 => Baudrate::B12000000,
        };
        let mut dp = DpMaster::new(Vec::new());
        for address in slaves {
            let options = PeripheralOptions {
                ident_number: 0x059B,
                sync_mode: true,
                freeze_mode: true,
                user_parameters: Some(&[0x00, 0x0A, 0, 0, 0x20, 0, 0x20, 0, 0, 0]),
                config: Some(&[0xF1]),
                ..PeripheralOptions::default()
            };
            dp.add(Peripheral::new(*address, options, vec![0; 4], vec![0; 4]));
        }
        dp.enter_operate();
        let mut builder = ParametersBuilder::new(2, told);
        builder
            .slot_bits(shortest_slot(rate))
            .highest_station_address(126)
            .watchdog_timeout(time::Duration::from_millis(200));
        let mut fdl = FdlActiveStation::new(builder.build());
        fdl.set_online();
        Self { rate, fdl, dp, phy: Phy::default() }
    }

    fn poll(&mut self, now: Instant) {
        let micros = i64::try_from(now.as_nanos() / 1_000).unwrap();
        self.fdl.poll(time::Instant::from_micros(micros), &mut self.phy, &mut self.dp);
    }
}

impl Station for Plain {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        if let Input::Octets(octets) = input {
            self.phy.received.extend_from_slice(octets);
        }
        self.poll(now);
    }

    fn advance(&mut self, _now: Instant) {}

    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        if self.phy.outgoing.is_empty() {
            self.poll(now);
        }
        let telegram = std::mem::take(&mut self.phy.outgoing);
        (!telegram.is_empty()).then(|| Transmission::new(&telegram).unwrap())
    }

    fn deadline(&self) -> Option<Instant> {
        None
    }
}

impl Node for Plain {
    fn baud_rate(&self) -> BaudRate {
        self.rate
    }
}

impl ProfibusPhy for Phy {
    fn poll_transmission(&mut self, _now: time::Instant) -> bool {
        false
    }

    fn transmit_data<F, R>(&mut self, _now: time::Instant, write: F) -> R
    where
        F: FnOnce(&mut [u8]) -> (usize, R),
    {
        let mut buffer = [0; 256];
        let (length, result) = write(&mut buffer);
        self.outgoing.extend_from_slice(&buffer[..length]);
        result
    }

    fn receive_data<F, R>(&mut self, _now: time::Instant, read: F) -> R
    where
        F: FnOnce(&[u8]) -> (usize, R),
    {
        let (taken, result) = read(&self.received);
        self.received.drain(..taken);
        result
    }
}

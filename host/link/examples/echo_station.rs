//! A station of thirty lines on any bus: it answers each poll of MAC ID 5 with the number of polls.
//!
//! ```text
//! cargo run -p codewheel-link --example echo_station -- slcan-listen:127.0.0.1:4001
//! python -c "import can; b = can.Bus(interface='slcan', channel='socket://127.0.0.1:4001'); \
//!     b.send(can.Message(arbitration_id=0x42D, is_extended_id=False)); print(b.recv(1))"
//! ```

use codewheel_link::{BusUri, Clock, Loop, open};
use codewheel_station::can::{BitRate, Frame, Identifier, Input};
use codewheel_station::{Instant, Station};

#[derive(Debug, Default)]
struct Echo {
    polls: u32,
    owed: bool,
}

impl Station for Echo {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _now: Instant, input: Input<'_>) {
        if let Input::Frame(frame) = input
            && frame.identifier() == Identifier::Standard(0x42D)
        {
            self.polls = self.polls.wrapping_add(1);
            self.owed = true;
        }
    }

    fn advance(&mut self, _now: Instant) {}

    fn transmit(&mut self, _now: Instant) -> Option<Frame> {
        std::mem::take(&mut self.owed).then(|| Frame::standard(0x3C5, &self.polls.to_le_bytes()))
    }

    fn deadline(&self) -> Option<Instant> {
        None
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let bus = std::env::args().nth(1).unwrap_or_else(|| "slcan-listen:127.0.0.1:4001".to_owned());
    let mut port = open(&bus.parse::<BusUri>()?, BitRate::Kbit125)?;
    println!("ready on {}", port.describe());
    let (mut station, mut drive) = (Echo::default(), Loop::new(Clock::new()));
    loop {
        for notice in drive.turn(&mut station, port.as_mut(), None)?.notices {
            eprintln!("{notice}");
        }
    }
}

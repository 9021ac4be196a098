//! The proof that the core crates need neither an allocator nor an operating system: they are
//! linked into one archive with nothing else, and `check.sh` looks at its symbols.
//!
//! Only what [`exercise`] reaches is linked, so what a firmware calls belongs there.
#![no_std]

use codewheel_station::can::{Frame, Identifier, Input};
use codewheel_station::{Instant, Reader, Station, Writer};

// Linked even while `exercise` does not call into them yet.
use codewheel_device as _;
use codewheel_devicenet as _;
use codewheel_encoder as _;

/// Calls into the core crates the way a firmware does. `input` is what the compiler cannot know, so
/// nothing is computed at compile time; the sum returned keeps everything alive.
fn exercise(input: &[u8]) -> u32 {
    let mut reader = Reader::new(input);
    let identifier = reader.u16_le().unwrap_or_default();
    let Ok(frame) = Frame::new(Identifier::Standard(identifier), reader.rest()) else { return 0 };

    let mut echo = Echo { owed: None };
    echo.handle(Instant::ZERO, Input::Frame(&frame));
    echo.advance(Instant::ZERO);
    let answer = echo.transmit(Instant::ZERO);

    let mut octets = [0; 8];
    let mut writer = Writer::new(&mut octets);
    for octet in answer.iter().flat_map(|frame| frame.data()) {
        if writer.u8(*octet).is_err() {
            break;
        }
    }
    writer.written().iter().fold(u32::from(identifier), |sum, octet| {
        sum.rotate_left(5).wrapping_add(u32::from(*octet))
    })
}

/// The smallest station: answers each frame with itself.
struct Echo {
    owed: Option<Frame>,
}

impl Station for Echo {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _: Instant, input: Input<'_>) {
        if let Input::Frame(frame) = input {
            self.owed = Some(*frame);
        }
    }

    fn advance(&mut self, _: Instant) {}

    fn transmit(&mut self, _: Instant) -> Option<Frame> {
        self.owed.take()
    }

    fn deadline(&self) -> Option<Instant> {
        None
    }
}

/// What `check.sh` looks for: the way into [`exercise`] from outside Rust.
///
/// # Safety
/// `octets` points at `length` readable octets.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn codewheel_exercise(octets: *const u8, length: usize) -> u32 {
    // SAFETY: the caller promises it.
    exercise(unsafe { core::slice::from_raw_parts(octets, length) })
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

//! What a client says to an adapter.

use codewheel_station::can::Frame;

use super::line::{CR, Gatherer, hex, parse_frame};

/// A well-formed command of a client. Whether it is allowed now is for the
/// [`Channel`](super::Channel) to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// An empty line, which clients send to flush what an earlier one left behind.
    Flush,
    /// `S0` … `S8`: the bit rate in bits per second, 10 000 … 1 000 000.
    BitRate(u32),
    /// `O`: open the channel.
    Open,
    /// `L`: open the channel to listen only.
    Listen,
    /// `C`: close the channel.
    Close,
    /// `t`, `T`, `r`, `R`: put a frame on the bus.
    Transmit(Frame),
    /// `Z0`, `Z1`: whether received frames carry a time.
    Timestamps(bool),
    /// `V`: which version are you.
    Version,
    /// `N`: which serial number have you.
    SerialNumber,
    /// `F`: which errors are there.
    Status,
    /// A setting of hardware that is not here, and that can be left as it is without harm:
    /// `s` bit timing registers, `M` `m` acceptance code and mask, `W` filter mode, `U` serial
    /// speed, `X1` hand received frames out unasked, `Q0` no automatic start.
    Hardware,
}

/// A line that is no command: an unknown letter, digits wrong in number or value, or too long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Malformed;

/// Reads a client's commands out of its octets, cut into pieces as the network likes.
#[derive(Clone, Debug, Default)]
pub struct CommandDecoder {
    line: Gatherer,
}

impl CommandDecoder {
    /// Takes the next octet and gives the command that it completes, if any.
    ///
    /// A line feed is passed over. An overlong line is [`Malformed`] once, at its CR; what follows
    /// is read again.
    pub fn push(&mut self, octet: u8) -> Option<Result<Command, Malformed>> {
        match octet {
            b'\n' => None,
            CR => {
                let command = self.line.line().and_then(parse).ok_or(Malformed);
                self.line.clear();
                Some(command)
            }
            octet => {
                self.line.push(octet);
                None
            }
        }
    }
}

fn parse(line: &[u8]) -> Option<Command> {
    let digits = |count: usize| {
        let digits = line.get(1..).filter(|digits| digits.len() == count)?;
        hex(digits)
    };
    Some(match line {
        [] => Command::Flush,
        [b'S', rate] => Command::BitRate(match rate {
            b'0' => 10_000,
            b'1' => 20_000,
            b'2' => 50_000,
            b'3' => 100_000,
            b'4' => 125_000,
            b'5' => 250_000,
            b'6' => 500_000,
            b'7' => 800_000,
            b'8' => 1_000_000,
            _ => return None,
        }),
        b"O" => Command::Open,
        b"L" => Command::Listen,
        b"C" => Command::Close,
        b"V" => Command::Version,
        b"N" => Command::SerialNumber,
        b"F" => Command::Status,
        b"Z0" => Command::Timestamps(false),
        b"Z1" => Command::Timestamps(true),
        // Automatic hand-out is what we do, automatic start what we do not; X0 and Q1 ask for the
        // contrary and are refused.
        b"X1" | b"Q0" => Command::Hardware,
        [b's', ..] => digits(4).map(|_| Command::Hardware)?,
        [b'M' | b'm', ..] => digits(8).map(|_| Command::Hardware)?,
        [b'W' | b'U', ..] => digits(1).map(|_| Command::Hardware)?,
        _ => match parse_frame(line)? {
            (frame, []) => Command::Transmit(frame),
            _ => return None,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(octets: &[u8]) -> Vec<Result<Command, Malformed>> {
        let mut decoder = CommandDecoder::default();
        octets.iter().filter_map(|octet| decoder.push(*octet)).collect()
    }

    #[test]
    fn commands_are_read_and_line_feeds_passed_over() {
        assert_eq!(
            read(b"\r\nC\r\nS4\r\nO\r\nt42D0\r\n"),
            [
                Ok(Command::Flush),
                Ok(Command::Close),
                Ok(Command::BitRate(125_000)),
                Ok(Command::Open),
                Ok(Command::Transmit(Frame::standard(0x42D, &[]))),
            ]
        );
    }

    #[test]
    fn hardware_settings_need_the_right_number_of_digits() {
        assert_eq!(
            read(b"s031C\rM00000000\rmFFFFFFFF\rW0\rU1\rX1\rQ0\r"),
            [Ok(Command::Hardware); 7]
        );
        assert_eq!(read(b"s031\rM0\rm0000000G\rW\rU12\rX0\rQ1\r"), [Err(Malformed); 7]);
    }

    #[test]
    fn what_is_no_command_is_malformed() {
        let text = b"S9\rS\rS44\rO1\rZ2\rz\rA\rP\rE\rt1001\rt10011122\rt1002112\r\x07\r\xFF\x00\r";
        assert_eq!(read(text), [Err(Malformed); 14]);
    }

    #[test]
    fn an_overlong_line_is_malformed_once_and_the_next_is_read() {
        let mut octets = vec![b't'; 100_000];
        octets.extend_from_slice(b"\rV\r");
        assert_eq!(read(&octets), [Err(Malformed), Ok(Command::Version)]);
    }
}

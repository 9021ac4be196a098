//! What a client says to the server.

use codewheel_station::can::{Frame, Identifier};

/// The longest command that is read, between its brackets; `send` with eight octets has 41.
const LONGEST: usize = 128;

/// A well-formed command of a client. Whether it is allowed now is for the
/// [`Session`](super::Session) to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `open NAME`: take part in a bus; the name has 1 … 16 characters, and here all mean the same.
    Open,
    /// `rawmode`: see every frame.
    Raw,
    /// `bcmmode`: see what is subscribed to.
    Broadcast,
    /// `controlmode`: see statistics.
    Control,
    /// `echo`: say so too.
    Echo,
    /// `send ID LENGTH OCTET…` and `sendrtr ID LENGTH`: put a frame on the bus.
    Send(Frame),
    /// `statistics INTERVAL`, in milliseconds; 0 ends them.
    Statistics(u32),
}

/// What stands between brackets and is no command: an unknown word, parts missing, wrong or too
/// many, or too long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Malformed;

/// Reads a client's commands out of its octets, cut into pieces as the network likes. What stands
/// between a `>` and the next `<` is passed over.
#[derive(Clone, Debug, Default)]
pub struct CommandDecoder {
    octets: Vec<u8>,
    state: State,
}

#[derive(Clone, Copy, Debug, Default)]
enum State {
    #[default]
    Outside,
    Inside,
    /// Inside a command that is too long.
    Overlong,
}

impl CommandDecoder {
    /// Takes the next octet and gives the command that it completes, if any.
    pub fn push(&mut self, octet: u8) -> Option<Result<Command, Malformed>> {
        match (self.state, octet) {
            // What was begun before another beginning was cut off.
            (_, b'<') => {
                self.octets.clear();
                self.state = State::Inside;
                None
            }
            (State::Outside, _) => None,
            (State::Inside, b'>') => {
                self.state = State::Outside;
                Some(parse(&self.octets).ok_or(Malformed))
            }
            (State::Overlong, b'>') => {
                self.state = State::Outside;
                Some(Err(Malformed))
            }
            (State::Inside, octet) => {
                if self.octets.len() < LONGEST {
                    self.octets.push(octet);
                } else {
                    self.state = State::Overlong;
                }
                None
            }
            (State::Overlong, _) => None,
        }
    }
}

fn parse(octets: &[u8]) -> Option<Command> {
    let mut words = std::str::from_utf8(octets).ok()?.split_ascii_whitespace();
    let command = match words.next()? {
        "open" => {
            let name = words.next()?;
            (name.len() <= 16).then_some(Command::Open)?
        }
        "rawmode" => Command::Raw,
        "bcmmode" => Command::Broadcast,
        "controlmode" => Command::Control,
        "echo" => Command::Echo,
        "send" => {
            let (identifier, length) = head(&mut words)?;
            let mut data = [0; 8];
            let data = data.get_mut(..length)?;
            for octet in data.iter_mut() {
                *octet = hex(words.next()?, 2)? as u8;
            }
            Command::Send(Frame::new(identifier, data).ok()?)
        }
        "sendrtr" => {
            let (identifier, length) = head(&mut words)?;
            Command::Send(Frame::remote(identifier, length).ok()?)
        }
        "statistics" => Command::Statistics(decimal(words.next()?)?),
        _ => return None,
    };
    words.next().is_none().then_some(command)
}

/// Identifier and length: eight digits are an identifier of 29 bits, fewer one of 11.
fn head<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<(Identifier, usize)> {
    let text = words.next()?;
    let bits = hex(text, 8)?;
    let identifier = match text.len() {
        8 => Identifier::Extended(bits),
        _ => Identifier::Standard(u16::try_from(bits).ok()?),
    };
    Some((identifier, decimal(words.next()?)? as usize))
}

/// The value of 1 … `most` hexadecimal digits.
fn hex(text: &str, most: usize) -> Option<u32> {
    let is_number = text.len() <= most && text.bytes().all(|octet| octet.is_ascii_hexdigit());
    u32::from_str_radix(text, 16).ok().filter(|_| is_number)
}

fn decimal(text: &str) -> Option<u32> {
    text.parse().ok().filter(|_| text.bytes().all(|octet| octet.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(octets: &[u8]) -> Vec<Result<Command, Malformed>> {
        let mut decoder = CommandDecoder::default();
        octets.iter().filter_map(|octet| decoder.push(*octet)).collect()
    }

    #[test]
    fn the_examples_of_the_protocol_are_understood() {
        let wide = Frame::new(Identifier::Extended(0x1AAA_AAAA), &[0x01, 0xF1]).unwrap();
        let asking = Frame::remote(Identifier::Extended(0x1AAA_AAAA), 2).unwrap();
        assert_eq!(
            read(
                b"< open can0 >< rawmode >\r\n< send 123 0 >< send 1AAAAAAA 2 1 F1 >\
                  < sendrtr 1AAAAAAA 2 >< echo >< bcmmode >< controlmode >< statistics 1000 >"
            ),
            [
                Ok(Command::Open),
                Ok(Command::Raw),
                Ok(Command::Send(Frame::standard(0x123, &[]))),
                Ok(Command::Send(wide)),
                Ok(Command::Send(asking)),
                Ok(Command::Echo),
                Ok(Command::Broadcast),
                Ok(Command::Control),
                Ok(Command::Statistics(1000)),
            ]
        );
    }

    #[test]
    fn blanks_are_as_many_as_one_likes() {
        assert_eq!(read(b"<open can0>"), [Ok(Command::Open)]);
        let frame = Frame::standard(0x42D, &[0x0B]);
        assert_eq!(read(b"<  send\t42d 1  b  >"), [Ok(Command::Send(frame))]);
    }

    #[test]
    fn what_is_no_command_is_malformed() {
        for text in [
            "< >",
            "< open >",
            "< open can0 can1 >",
            "< open a-name-that-is-too-long >",
            "< send 123 >",
            "< send 123 2 11 >",
            "< send 123 1 11 22 >",
            "< send 123 9 1 2 3 4 5 6 7 8 9 >",
            "< send 123 1 111 >",
            "< send 800 0 >",
            "< send +12 0 >",
            "< send 123 +0 >",
            "< send 20000000 0 >",
            "< send 123456789 0 >",
            "< sendrtr 123 9 >",
            "< statistics -1 >",
            "< add 1 0 123 0 >",
            "< \u{e9}cho >",
        ] {
            assert_eq!(read(text.as_bytes()), [Err(Malformed)], "{text}");
        }
        assert_eq!(read(b"< \xFF >"), [Err(Malformed)]);
    }

    #[test]
    fn an_overlong_command_is_malformed_once_and_the_next_is_read() {
        let mut octets = vec![b'<'];
        octets.extend([b'x'; 100_000]);
        octets.extend_from_slice(b"> > echo >< echo >");
        assert_eq!(read(&octets), [Err(Malformed), Ok(Command::Echo)]);
    }

    #[test]
    fn a_command_that_was_cut_off_is_forgotten_at_the_next_beginning() {
        assert_eq!(read(b"hello < send 123 1 < echo >"), [Ok(Command::Echo)]);
    }
}

//! Any octets whatever from a client of a socketcand server. The first octet says where the rest is
//! cut into pieces.

use std::time::Duration;

use codewheel_link::socketcand::{CommandDecoder, Effect, Session, Word};
use codewheel_station::can::{Frame, Identifier};

/// Does what `octets` say and fails where the server says or does what it must not.
pub(crate) fn body(octets: &[u8]) {
    let Some((&cut, octets)) = octets.split_first() else { return };
    let mut whole = Session::default();
    let mut effects = Vec::new();
    whole.receive(octets, |effect| effects.push(effect));

    let mut pieces = Session::default();
    let mut others = Vec::new();
    for piece in octets.chunks(usize::from(cut % 32) + 1) {
        pieces.receive(piece, |effect| others.push(effect));
    }
    assert_eq!(effects, others, "cut after every {} octets", cut % 32 + 1);

    let ends = octets.iter().filter(|octet| **octet == b'>').count();
    let mut decoder = CommandDecoder::default();
    let commands = octets.iter().filter_map(|octet| decoder.push(*octet)).count();
    assert!(commands <= ends, "{commands} commands with {ends} ends");
    judge(&effects, commands);

    // What stayed behind hinders nobody.
    let mut answers = Vec::new();
    whole.receive(b"< echo >", |effect| answers.push(effect));
    assert_eq!(answers, [Effect::Answer(Word::echo())]);
}

fn judge(effects: &[Effect], commands: usize) {
    let (mut is_open, mut answers, mut frames) = (false, 0, 0);
    for effect in effects {
        match effect {
            Effect::Answer(word) => {
                answers += 1;
                let text = word.as_text();
                assert!(text.starts_with("< ") && text.ends_with(" >"), "{text}");
            }
            Effect::Transmit(frame) => {
                frames += 1;
                assert!(is_open, "{frame} from a client without a bus");
                comes_back(frame);
            }
            Effect::Opened { listen_only, bit_rate } => {
                assert!(!listen_only && bit_rate.is_none() && !is_open, "opened twice");
                is_open = true;
            }
            Effect::Closed => panic!("a bus is closed with its connection alone"),
        }
    }
    assert!(answers + frames <= commands, "at most one answer or frame a command");
}

/// What the server would tell others of `frame`, said by a client, is `frame`.
fn comes_back(frame: &Frame) {
    let identifier = match frame.identifier() {
        Identifier::Standard(bits) => format!("{bits:03X}"),
        Identifier::Extended(bits) => format!("{bits:08X}"),
    };
    let data: String = frame.data().iter().map(|octet| format!(" {octet:X}")).collect();
    let kind = if frame.is_remote() { "sendrtr" } else { "send" };
    let said = format!("< {kind} {identifier} {}{data} >", frame.length());
    let mut other = Session::default();
    let mut heard = Vec::new();
    other.receive(b"< open can0 >", |_| {});
    other.receive(said.as_bytes(), |effect| heard.push(effect));
    assert_eq!(heard, [Effect::Transmit(*frame)]);
    let told = Word::frame(frame, Duration::from_micros(1));
    assert!(told.as_text().contains(&format!(" {identifier} 0.000001 ")), "{told:?}");
}

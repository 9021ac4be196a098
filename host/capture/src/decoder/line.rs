//! A line for people, or a JSON object, of the same words.

use std::ops::Range;

use super::{Caption, Output};
use crate::format::log::push_frame;
use crate::hex::{push_decimal, push_octets};
use crate::said::Listener;
use crate::{Bus, Content, Direction, Record, Said};

/// The line that is being written.
///
/// | | text | JSON |
/// |---|---|---|
/// | [`ends`](Self::ends) | `2 → 7` | `"from":2,"to":7` |
/// | [`message`](Self::message) | `poll response` | `"message":"poll response"` |
/// | [`attribute`](Self::attribute) | ` Save` | `"service":"Save"` |
/// | values | `: position 4096 step, alarm OK` | `"values":{"position":4096,"alarm":"OK"}` |
/// | [`note`](Self::note) | ` – no request seen` | `"note":"no request seen"` |
///
/// They are called in this order; each can be left out.
#[derive(Debug)]
pub(super) struct Line<'o> {
    out: &'o mut Vec<u8>,
    output: Output,
    values: bool,
    notes: bool,
    /// The name of the next value has been said already.
    told: bool,
    listener: Listener<'o>,
    /// Who speaks to whom.
    ends: (Option<u8>, Option<u8>),
    /// Where the kind of message stands.
    message: Range<usize>,
}

/// Frames are padded to this width, so that what they say stands below each other.
const FRAME_WIDTH: usize = 21;

impl<'o> Line<'o> {
    pub(super) fn begin(
        out: &'o mut Vec<u8>,
        output: Output,
        bus: &Bus,
        record: &Record<'_>,
        listener: Listener<'o>,
    ) -> Self {
        let nanos = record.at.as_nanos();
        match output {
            Output::Text => {
                push_decimal(out, nanos / 1_000_000_000, 1);
                out.push(b'.');
                push_decimal(out, nanos / 1_000 % 1_000_000, 6);
                out.push(b' ');
                out.extend_from_slice(bus.name.as_bytes());
                out.extend_from_slice(match record.direction {
                    Direction::Received => b"   ",
                    Direction::Sent => b" T ",
                });
                if let Content::Frame(frame) = &record.content {
                    let begin = out.len();
                    push_frame(out, frame);
                    out.resize(out.len().max(begin + FRAME_WIDTH), b' ');
                    out.push(b' ');
                }
            }
            Output::Json => {
                out.extend_from_slice(b"{\"time\":");
                push_decimal(out, nanos / 1_000_000_000, 1);
                out.push(b'.');
                push_decimal(out, nanos % 1_000_000_000, 9);
                out.extend_from_slice(b",\"bus\":");
                push_string(out, bus.name.as_bytes());
                out.extend_from_slice(match record.direction {
                    Direction::Received => b",\"direction\":\"received\"",
                    Direction::Sent => b",\"direction\":\"sent\"",
                });
                match &record.content {
                    Content::Frame(frame) => {
                        out.extend_from_slice(b",\"frame\":\"");
                        push_frame(out, frame);
                    }
                    Content::Telegram { octets, .. } => {
                        out.extend_from_slice(b",\"octets\":\"");
                        push_octets(out, octets, b" ");
                    }
                }
                out.push(b'"');
            }
        }
        let message = out.len()..out.len();
        Self {
            out,
            output,
            values: false,
            notes: false,
            told: false,
            listener,
            ends: (None, None),
            message,
        }
    }

    /// What the record says, for whoever hears it.
    pub(super) fn said(&mut self, said: Said<'_>) {
        self.listener.tell(said);
    }

    /// Who speaks to whom, where that is known.
    pub(super) fn ends(&mut self, from: Option<u8>, to: Option<u8>) {
        self.ends = (from, to);
        match self.output {
            Output::Text => {
                if let Some(from) = from {
                    push_decimal(self.out, from.into(), 1);
                    self.out.push(b' ');
                }
                if let Some(to) = to {
                    self.text("→ ");
                    push_decimal(self.out, to.into(), 1);
                    self.out.push(b' ');
                }
                self.out.push(b' ');
            }
            Output::Json => {
                for (key, end) in [(",\"from\":", from), (",\"to\":", to)] {
                    if let Some(address) = end {
                        self.text(key);
                        push_decimal(self.out, address.into(), 1);
                    }
                }
            }
        }
    }

    /// What kind of message it is.
    pub(super) fn message(&mut self, message: &str) {
        match self.output {
            Output::Text => {
                let begin = self.out.len();
                self.text(message);
                self.message = begin..self.out.len();
            }
            Output::Json => {
                self.text(",\"message\":\"");
                self.text(message);
                self.out.push(b'"');
            }
        }
    }

    /// One more word about the message: its service, its object.
    pub(super) fn attribute(&mut self, key: &str, parts: &[&str]) {
        match self.output {
            Output::Text => {
                self.out.push(b' ');
                parts.iter().for_each(|part| self.text(part));
            }
            Output::Json => {
                self.text(",\"");
                self.text(key);
                self.text("\":\"");
                parts.iter().for_each(|part| self.text(part));
                self.out.push(b'"');
            }
        }
    }

    /// A word about the message that has a number and no name: `service 4Eh`.
    pub(super) fn attribute_code(&mut self, key: &str, code: u8) {
        match self.output {
            Output::Text => {
                self.out.push(b' ');
                self.text(key);
                self.out.push(b' ');
            }
            Output::Json => {
                self.text(",\"");
                self.text(key);
                self.text("\":\"");
            }
        }
        push_octets(self.out, &[code], b"");
        self.out.push(b'h');
        self.quote();
    }

    /// Which fragment of a message it is.
    pub(super) fn fragment(&mut self, kind: &str, count: u8) {
        self.attribute("fragment", &[kind]);
        self.text(if self.output == Output::Text { " " } else { ",\"count\":" });
        push_decimal(self.out, count.into(), 1);
    }

    /// The name of the next value has been said already and need not be repeated to people.
    pub(super) fn name_is_told(&mut self) {
        self.told = true;
    }

    /// An attribute as the command line writes its path: `2f/1/7`.
    pub(super) fn path(&mut self, key: &str, numbers: &[u8]) {
        match self.output {
            Output::Text => self.text(" ("),
            Output::Json => {
                self.text(",\"");
                self.text(key);
                self.text("\":\"");
            }
        }
        for (place, number) in numbers.iter().enumerate() {
            if place == 0 {
                let digit = |nibble: u8| char::from_digit(nibble.into(), 16).unwrap_or('0') as u8;
                self.out.extend_from_slice(&[digit(number >> 4), digit(number & 0xF)]);
            } else {
                self.out.push(b'/');
                push_decimal(self.out, (*number).into(), 1);
            }
        }
        self.out.push(if self.output == Output::Text { b')' } else { b'"' });
    }

    /// A number with its unit.
    pub(super) fn number(&mut self, key: &str, name: &str, value: i64, unit: &str) {
        self.value(key, name);
        if value < 0 {
            self.out.push(b'-');
        }
        push_decimal(self.out, value.unsigned_abs(), 1);
        if self.output == Output::Text && !unit.is_empty() {
            self.out.push(b' ');
            self.text(unit);
        }
    }

    /// A number in the notation of the books: `059Bh`.
    pub(super) fn hex(&mut self, key: &str, name: &str, octets_be: &[u8]) {
        self.value(key, name);
        self.quote();
        push_octets(self.out, octets_be, b"");
        self.out.push(b'h');
        self.quote();
    }

    /// A word, of this program or of a peer.
    pub(super) fn word(&mut self, key: &str, name: &str, word: &[u8]) {
        self.value(key, name);
        match self.output {
            Output::Text => push_printable(self.out, word),
            Output::Json => push_string(self.out, word),
        }
    }

    /// Octets that are not taken apart.
    pub(super) fn octets(&mut self, key: &str, name: &str, octets: &[u8]) {
        if octets.is_empty() {
            return;
        }
        self.value(key, name);
        self.quote();
        push_octets(self.out, octets, b" ");
        self.quote();
    }

    /// The bits of a value that are set, by name, those without a name as `bit 3`.
    pub(super) fn bits(&mut self, key: &str, name: &str, value: u64, names: &[(u8, &str)]) {
        self.value(key, name);
        self.out.push(b'[');
        let mut rest = value;
        let mut first = true;
        while rest != 0 {
            let bit = rest.trailing_zeros() as u8;
            rest &= rest - 1;
            if !first {
                self.text(if self.output == Output::Text { ", " } else { "," });
            }
            first = false;
            self.quote();
            match names.iter().find(|(number, _)| *number == bit) {
                Some((_, name)) => self.text(name),
                None => {
                    self.text("bit ");
                    push_decimal(self.out, bit.into(), 1);
                }
            }
            self.quote();
        }
        self.out.push(b']');
    }

    /// What a person should know about it.
    pub(super) fn note(&mut self, parts: &[&str]) {
        self.close_values();
        match (self.output, self.notes) {
            (Output::Text, false) => self.text(" – "),
            (Output::Text, true) => self.text("; "),
            (Output::Json, false) => self.text(",\"note\":\""),
            (Output::Json, true) => self.text("; "),
        }
        self.notes = true;
        parts.iter().for_each(|part| self.text(part));
    }

    /// Ends a line of text that is wanted in its parts.
    pub(super) fn into_caption(self) -> Caption {
        let part = |range| String::from_utf8_lossy(self.out.get(range).unwrap_or_default());
        let (from, to) = self.ends;
        let behind = part(self.message.end..self.out.len());
        let text = behind.trim_start_matches(':').trim();
        Caption { from, to, message: part(self.message).into_owned(), text: text.to_owned() }
    }

    pub(super) fn end(mut self, content: &Content<'_>) {
        self.close_values();
        match self.output {
            Output::Text => {
                if let Content::Telegram { octets, .. } = content {
                    self.text("  | ");
                    push_octets(self.out, octets, b" ");
                }
                while self.out.last() == Some(&b' ') {
                    self.out.pop();
                }
            }
            Output::Json => {
                if self.notes {
                    self.out.push(b'"');
                }
                self.out.push(b'}');
            }
        }
        self.out.push(b'\n');
    }

    fn value(&mut self, key: &str, name: &str) {
        match (self.output, self.values) {
            (Output::Text, false) => self.text(": "),
            (Output::Text, true) => self.text(", "),
            (Output::Json, false) => self.text(",\"values\":{"),
            (Output::Json, true) => self.out.push(b','),
        }
        self.values = true;
        let name = if std::mem::take(&mut self.told) { "" } else { name };
        match self.output {
            Output::Text => {
                self.text(name);
                if !name.is_empty() {
                    self.out.push(b' ');
                }
            }
            Output::Json => {
                self.out.push(b'"');
                // Names become keys as those of the rows are: small letters and hyphens.
                for octet in key.bytes() {
                    self.out.push(match octet.to_ascii_lowercase() {
                        octet @ (b'a'..=b'z' | b'0'..=b'9') => octet,
                        _ => b'-',
                    });
                }
                self.text("\":");
            }
        }
    }

    fn close_values(&mut self) {
        if self.values && self.output == Output::Json {
            self.out.push(b'}');
        }
        self.values = false;
    }

    fn quote(&mut self) {
        if self.output == Output::Json {
            self.out.push(b'"');
        }
    }

    fn text(&mut self, text: &str) {
        self.out.extend_from_slice(text.as_bytes());
    }
}

/// Appends what a peer calls text, without what would control a terminal.
fn push_printable(out: &mut Vec<u8>, text: &[u8]) {
    out.extend(text.iter().map(|octet| if matches!(octet, b' '..=b'~') { *octet } else { b'.' }));
}

/// Appends a JSON string; what is no ASCII text becomes a dot.
fn push_string(out: &mut Vec<u8>, text: &[u8]) {
    out.push(b'"');
    match str::from_utf8(text) {
        Ok(text) => {
            for letter in text.chars() {
                match letter {
                    '"' | '\\' => out.extend_from_slice(&[b'\\', letter as u8]),
                    letter if letter.is_control() => out.push(b'.'),
                    letter => {
                        let mut octets = [0; 4];
                        out.extend_from_slice(letter.encode_utf8(&mut octets).as_bytes());
                    }
                }
            }
        }
        Err(_) => {
            for octet in text {
                match octet {
                    b'"' | b'\\' => out.extend_from_slice(&[b'\\', *octet]),
                    octet => push_printable(out, &[*octet]),
                }
            }
        }
    }
    out.push(b'"');
}

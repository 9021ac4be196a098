//! Naming what frames and telegrams say.

mod devicenet;
mod line;
mod profibus;
mod replay;

use self::devicenet::DeviceNet;
use self::line::Line;
use self::profibus::Profibus;
use crate::said::Listener;
use crate::{Bus, Condition, Content, Record, Said};

pub use self::replay::{Replayed, replay};

/// What a decoder writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Output {
    /// A line for people.
    #[default]
    Text,
    /// A JSON object, in one line.
    Json,
}

/// What stations are taken for that have not yet said what they are.
///
/// A PROFIBUS slave says it with its ident number (Slave_Diag, Set_Prm), a DeviceNet node with its
/// vendor (duplicate MAC ID check, Identity object). Once it has, it is one of our encoders or it is not,
/// and what is not has its positions, parameters and diagnoses shown as octets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Assume {
    /// For encoders: a recording that begins in the middle shows positions.
    #[default]
    Encoders,
    /// For nothing in particular.
    Nothing,
}

/// What a record says, in its parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Caption {
    /// The address of who said it, where that is known.
    pub from: Option<u8>,
    /// The address of whom it was said to, where that is known.
    pub to: Option<u8>,
    /// What kind of message it is: `poll response`.
    pub message: String,
    /// What it says, as people read it: `position 4096 step`; empty where that is all.
    pub text: String,
}

/// Names what the records of a capture say, one line each; also live, as they come.
///
/// It remembers what answers do not repeat: the request of a response, the fragments of a message, the
/// ident number of a slave. So it wants all records of a bus in their order.
#[derive(Debug, Default)]
pub struct Decoder {
    output: Output,
    assume: Assume,
    buses: Vec<State>,
    /// A line that nobody reads, since somebody hears what it says.
    unread: Vec<u8>,
}

#[derive(Debug, Default)]
struct State {
    devicenet: Option<Box<DeviceNet>>,
    profibus: Option<Box<Profibus>>,
}

impl Decoder {
    /// A decoder that has seen nothing yet.
    #[must_use]
    pub const fn new(output: Output, assume: Assume) -> Self {
        Self { output, assume, buses: Vec::new(), unread: Vec::new() }
    }

    /// Appends the line of `record`, which was carried by `bus`, with its end of line.
    pub fn decode(&mut self, bus: &Bus, record: &Record<'_>, out: &mut Vec<u8>) {
        if let Some(line) = self.line(self.output, bus, record, out, Listener(None)) {
            line.end(&record.content);
        }
    }

    /// What `record` says, in its parts, whatever output was chosen.
    #[must_use]
    pub fn caption(&mut self, bus: &Bus, record: &Record<'_>) -> Caption {
        let mut out = Vec::with_capacity(128);
        let line = self.line(Output::Text, bus, record, &mut out, Listener(None));
        line.map(Line::into_caption).unwrap_or_default()
    }

    /// Tells `listener` what `record` says, for programs that want the octets and not the names. Records
    /// that say nothing by themselves, such as a request, tell nothing.
    pub fn hear(&mut self, bus: &Bus, record: &Record<'_>, listener: &mut dyn FnMut(Said<'_>)) {
        let mut out = std::mem::take(&mut self.unread);
        out.clear();
        self.line(self.output, bus, record, &mut out, Listener(Some(listener)));
        self.unread = out;
    }

    /// The line of `record`, but for its end.
    fn line<'o>(
        &mut self,
        output: Output,
        bus: &Bus,
        record: &Record<'_>,
        out: &'o mut Vec<u8>,
        listener: Listener<'o>,
    ) -> Option<Line<'o>> {
        let place = usize::from(record.bus);
        if self.buses.len() <= place {
            self.buses.resize_with(place + 1, State::default);
        }
        let state = self.buses.get_mut(place)?;
        let assume = self.assume;
        let mut line = Line::begin(out, output, bus, record, listener);
        match &record.content {
            Content::Frame(frame) => {
                let known = state.devicenet.get_or_insert_with(|| Box::new(DeviceNet::new(assume)));
                known.decode(frame, &mut line);
            }
            Content::Telegram { octets, condition } => {
                let known = state.profibus.get_or_insert_with(|| Box::new(Profibus::new(assume)));
                known.decode(octets, *condition == Condition::Broken, &mut line);
            }
        }
        Some(line)
    }
}

//! A PROFIBUS-DP master of class 1 on any line, and what people do with it.
//!
//! | subject | |
//! |---|---|
//! | [`Console`] | the station behind all of this: ears, and a master once it is told to speak |
//! | [`Overheard`] | what the ears heard: who asks whom, for what, and what comes back |
//! | [`scan`] | who is on the bus |
//! | [`Encoder`] | a [`Session`](crate::Session) with one encoder |
//! | [`Eavesdropper`] | the positions of an encoder that another master asks, without a word |
//!
//! All of them listen first. Where a master is heard, they send nothing unless they are told to join its
//! ring; an encoder that belongs to it is looked at and not touched.
//!
//! # The master
//!
//! [`Master`] is a [`Station`](codewheel_station::Station) and a
//! [`rs485::Node`](codewheel_station::rs485::Node) around profirust's active station and DP master.
//! It brings its slaves to data exchange, keeps them there, and begins anew with those that were
//! lost or that refuse; it shares the bus with other masters by the token.
//!
//! | subject | |
//! |---|---|
//! | [`MasterSettings`], [`SlaveSettings`] | what they are told, checked before profirust could panic |
//! | [`Master::slave`] | inputs, diagnosis, where the slave stands |
//! | [`Master::set_outputs`], [`Master::request_diagnosis`] | what the slave gets |
//! | [`Master::serve`], [`Master::stop`] | slaves that come and go while it runs |
//! | [`Master::ask`], [`Master::take_answer`] | what it asks of stations that it does not serve |
//! | [`Master::take_event`] | what happened |
//! | [`Master::cycle_times`], [`Master::counters`] | how the bus does |
//!
//! ## What stands between profirust and the line
//! profirust is driven by a clock of its own (32 ticks a bit, so that no rounding shortens a pause),
//! sees whole telegrams only, and of these only such as it can deal with. It trusts its slaves
//! further than a line can be trusted:
//!
//! - two slaves that exhaust their retries by answers it did not expect, such as RS to Set_Prm
//!   because another master owns them, end in an assertion;
//! - a short confirmation after a passed token ends in an `unwrap` where a logger listens;
//! - an extended diagnosis with a block of length 0 ends in a slice out of range where it is printed;
//! - without slaves its DP master loops for ever;
//! - two tokens from its own address silence it for good;
//! - a slave that never gets ready, because noise confirmed a Chk_Cfg that it did not hear, is asked
//!   for its diagnosis for ever;
//! - a diagnosis that is asked for while an answer is awaited takes that answer for its own.
//!
//! So answers pass only from the slave that was asked, to this master, with the SAPs, the kind and
//! the length that the request calls for; other answers count as none. Requests and tokens of other
//! masters pass. After a collision of addresses the master rejoins the bus a second later; a slave that
//! two seconds and three diagnoses after its Chk_Cfg is not ready is begun anew; what users set waits
//! for the answer.

mod acyclic;
mod chosen;
mod clock;
mod console;
mod conversation;
mod eavesdropper;
mod encoder;
mod event;
mod identity;
mod judge;
mod line;
mod master;
mod overheard;
mod scan;
mod settings;
mod slave;
mod station;
mod telegram;
mod timeless;
mod values;

pub use acyclic::{Acyclic, Answer, Answered, StationKind};
pub use console::Console;
pub use eavesdropper::Eavesdropper;
pub use encoder::{Encoder, SessionSettings};
pub use event::{EVENTS, Event};
pub use master::{Counters, Master, NotParameterized, NotSet, UnknownSlave};
pub use overheard::{HeardExchange, HeardMaster, HeardSetting, HeardSlave, Overheard};
pub use scan::{ScanSettings, scan};
pub use settings::{
    DATA_OCTETS, HIGHEST_ADDRESS, LONGEST_SLOT, MasterSettings, SettingsError, SlaveSettings,
    USER_PARAMETER_OCTETS, patient_slot, shortest_slot,
};
pub use slave::{CycleTimes, Diagnosis, Service, SlaveState, SlaveView};
pub use timeless::Timeless;

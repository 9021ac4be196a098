//! The command line of the master's side: finding, asking and setting encoders that others made.

use std::path::PathBuf;

use clap::Args;
use codewheel_link::BusUri;
use codewheel_plant::TimeSpan;

/// Which bus, and how to be on it.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Bus")]
pub(crate) struct BusArguments {
    /// The bus, such as slcan:/dev/ttyACM0, socketcan:can0 or rs485:/dev/ttyUSB0; its kind says
    /// whether it is DeviceNet or PROFIBUS
    #[arg(long, value_name = "URI", required = true)]
    pub(crate) bus: Option<BusUri>,

    /// The bit rate. DeviceNet: 125k, 250k or 500k, by default 125k. PROFIBUS: 9.6k to 12M or 9600
    /// to 12000000, by default 1.5M
    #[arg(long, value_name = "RATE")]
    pub(crate) baud: Option<String>,

    /// Our own address: by default MAC ID 62 on DeviceNet, as configuration tools have, and 0 on
    /// PROFIBUS, the one of programming devices
    #[arg(long, value_name = "N")]
    pub(crate) master: Option<u8>,

    /// PROFIBUS: take part in the token ring although another master is there
    #[arg(long)]
    pub(crate) join: bool,

    /// How long to listen before anything is sent, such as 3s
    #[arg(long, value_name = "TIME")]
    pub(crate) listen_for: Option<TimeSpan>,

    /// Give up when it takes longer than this to find the bus and the encoder; without it, when
    /// nobody can be expected to answer any more
    #[arg(long, value_name = "TIME")]
    pub(crate) timeout: Option<TimeSpan>,
}

/// Which encoder.
#[derive(Args, Clone, Debug)]
pub(crate) struct EncoderAddress {
    /// The address of the encoder: its MAC ID, 0–63, or its station address, 0–125
    #[arg(long, value_name = "N", required = true)]
    pub(crate) address: Option<u8>,

    #[command(flatten)]
    pub(crate) bus: BusArguments,

    /// PROFIBUS: a parameter to work with, such as steps-per-turn=3600, in place of what the encoder
    /// works with now; can be given many times
    #[arg(long = "parameter", value_name = "KEY=VALUE", help_heading = "Bus")]
    pub(crate) parameters: Vec<String>,
}

/// What goes to stdout.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Format {
    /// JSON, one object a line; an error is one on stderr, {"error":{"kind",…}}
    #[arg(long)]
    pub(crate) json: bool,
}

/// Whether a person need be asked.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Consent {
    /// Do it without asking; needed where there is no terminal to ask on
    #[arg(short, long)]
    pub(crate) yes: bool,
}

/// Find who is on a bus: address, models, serial number, owner, lamp and state of each.
///
/// Listens first. Encoders that belong to another master are told as they were overheard, and never
/// taken from it. On a PROFIBUS with another master nothing is sent at all without --join.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel scan --bus slcan:/dev/ttyACM0 --baud 250k
  codewheel scan --bus rs485:/dev/ttyUSB0 --join
  codewheel scan --bus socketcan:can0 --json | jq 'select(.owner == null).address'

Exit codes: 0 somebody is there, 2 usage, 3 nobody is, or the bus cannot be used, 5 time-out.")]
pub(crate) struct ScanArguments {
    #[command(flatten)]
    pub(crate) bus: BusArguments,

    #[command(flatten)]
    pub(crate) format: Format,
}

/// Ask an encoder who it is.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel identify --bus slcan:/dev/ttyACM0 --address 5
  codewheel identify --bus rs485:/dev/ttyUSB0 --address 7 --json")]
pub(crate) struct IdentifyArguments {
    #[command(flatten)]
    pub(crate) encoder: EncoderAddress,

    #[command(flatten)]
    pub(crate) format: Format,
}

/// Read values of an encoder.
///
/// Without a name all it can tell, as a table. With one name stdout is the value and nothing else.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel get --bus slcan:/dev/ttyACM0 --address 5
  codewheel get position --bus slcan:/dev/ttyACM0 --address 5
  codewheel get steps-per-turn 2f/1/c parameter/6 --bus socketcan:can0 --address 5 --json
  codewheel get octet/32 --bus rs485:/dev/ttyUSB0 --address 7

Names: a key, as `codewheel describe MODEL` lists them; DeviceNet also CLASS/INSTANCE/ATTRIBUTE in
       hexadecimal and parameter/N; PROFIBUS also octet/N of the diagnosis.")]
pub(crate) struct GetArguments {
    /// What to read
    #[arg(value_name = "NAME")]
    pub(crate) names: Vec<String>,

    #[command(flatten)]
    pub(crate) encoder: EncoderAddress,

    #[command(flatten)]
    pub(crate) format: Format,
}

/// Write a value of an encoder: shows old and new, asks, writes, reads back, says how to undo it.
///
/// On DeviceNet it lasts until the power goes, unless `codewheel save` follows. On PROFIBUS a
/// parameter lasts as long as this program serves the encoder: the project of its own master has to
/// carry it, and what to write there is said.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel set steps-per-turn 3600 --bus slcan:/dev/ttyACM0 --address 5
  codewheel set direction ccw --bus slcan:/dev/ttyACM0 --address 5 --yes
  codewheel set 2f/1/b 0x64 --bus socketcan:can0 --address 5
  codewheel set total-resolution 921600 --bus rs485:/dev/ttyUSB0 --address 7

Exit codes: 0 it is as wanted, 1 it reads back otherwise, 2 usage or no consent, 3 bus,
            4 the device refused, 5 time-out.")]
pub(crate) struct SetArguments {
    /// What to write; `codewheel get` lists the names
    #[arg(value_name = "NAME")]
    pub(crate) name: String,

    /// The value: a number, 0x…, the name of a value such as ccw, or octets such as 20:04:24:02
    #[arg(value_name = "VALUE", allow_hyphen_values = true)]
    pub(crate) value: String,

    #[command(flatten)]
    pub(crate) encoder: EncoderAddress,

    #[command(flatten)]
    pub(crate) consent: Consent,

    #[command(flatten)]
    pub(crate) format: Format,
}

/// Make a number the position of now.
///
/// The shaft should stand still. On DeviceNet the offset behind it lasts until the power goes,
/// unless `codewheel save` follows; a PROFIBUS encoder keeps it at once.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel preset 0 --bus slcan:/dev/ttyACM0 --address 5
  codewheel preset 1000 --bus rs485:/dev/ttyUSB0 --address 7 --yes
  codewheel preset --by=-1000 --bus slcan:/dev/ttyACM0 --address 5     1000 steps less than now")]
pub(crate) struct PresetArguments {
    /// The position, in steps
    #[arg(value_name = "VALUE", value_parser = crate::hilo::number,
        required_unless_present = "by", conflicts_with = "by")]
    pub(crate) value: Option<u32>,

    /// Move the position of now by so many steps, around the end of the measuring range
    #[arg(long, value_name = "STEPS", allow_negative_numbers = true)]
    pub(crate) by: Option<i64>,

    #[command(flatten)]
    pub(crate) encoder: EncoderAddress,

    #[command(flatten)]
    pub(crate) consent: Consent,

    #[command(flatten)]
    pub(crate) format: Format,
}

/// A service of the whole encoder.
#[derive(Args, Debug)]
pub(crate) struct ServiceArguments {
    #[command(flatten)]
    pub(crate) encoder: EncoderAddress,

    #[command(flatten)]
    pub(crate) consent: Consent,

    #[command(flatten)]
    pub(crate) format: Format,
}

pub(crate) const SAVE_EXAMPLES: &str = "\
Examples:
  codewheel save --bus slcan:/dev/ttyACM0 --address 5
  codewheel save --bus socketcan:can0 --address 5 --yes --json";

pub(crate) const RESTORE_EXAMPLES: &str = "\
Examples:
  codewheel restore --bus slcan:/dev/ttyACM0 --address 5
  codewheel restore --bus socketcan:can0 --address 5 --yes --json";

pub(crate) const RESET_EXAMPLES: &str = "\
Examples:
  codewheel reset --bus slcan:/dev/ttyACM0 --address 5
  codewheel reset --bus socketcan:can0 --address 5 --yes --json";

/// Watch the position of an encoder: turns, degrees, speed, flags, cycle, until Ctrl-C.
///
/// An encoder of another master is watched passively, from what that master asks it; nothing is
/// sent. On a terminal the picture is drawn in its place, elsewhere a line is printed each time.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel watch --bus slcan:/dev/ttyACM0 --address 5
  codewheel watch --bus socketcan:can0 --address 5 --csv --rate 50 --for 10s > turning.csv
  codewheel watch --bus rs485:/dev/ttyUSB0 --address 7 --json | jq .rpm")]
pub(crate) struct WatchArguments {
    /// End after this time, such as 3s, 500ms or 2m
    #[arg(long = "for", value_name = "TIME")]
    pub(crate) lasts: Option<TimeSpan>,

    /// How often to show it, in times a second, 0.1 to 100; by default 10 on a terminal and with
    /// --csv or --json, else 1
    #[arg(long, value_name = "RATE", value_parser = rate)]
    pub(crate) rate: Option<f64>,

    /// Comma-separated values, with a heading
    #[arg(long, conflicts_with = "json")]
    pub(crate) csv: bool,

    #[command(flatten)]
    pub(crate) encoder: EncoderAddress,

    #[command(flatten)]
    pub(crate) format: Format,
}

/// Write all that makes an encoder what it is into a file: its passport.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel backup winch.toml --bus slcan:/dev/ttyACM0 --address 5
  codewheel backup winch.toml --bus rs485:/dev/ttyUSB0 --address 7 --yes")]
pub(crate) struct BackupArguments {
    /// The file to write, whole or not at all; one that is there is replaced only after a question,
    /// or with --yes
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,

    #[command(flatten)]
    pub(crate) encoder: EncoderAddress,

    #[command(flatten)]
    pub(crate) consent: Consent,

    #[command(flatten)]
    pub(crate) format: Format,
}

/// Compare an encoder with its passport, or two passports.
#[derive(Args, Debug)]
#[command(
    mut_arg("bus", |bus| bus.required(false).required_unless_present("other")),
    mut_arg("address", |address| address.required(false).required_unless_present("other")),
    after_help = "\
Examples:
  codewheel diff winch.toml --bus slcan:/dev/ttyACM0 --address 5
  codewheel diff winch.toml spare.toml

Exit codes: 0 nothing differs, 1 something does, 2 usage, 3 bus or file, 4 the device refused,
            5 time-out.")]
pub(crate) struct DiffArguments {
    /// The passport, as `codewheel backup` writes it
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,

    /// Another passport to compare with, in place of an encoder
    #[arg(value_name = "OTHER", conflicts_with_all = ["bus", "address"])]
    pub(crate) other: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) encoder: EncoderAddress,

    #[command(flatten)]
    pub(crate) format: Format,
}

/// Make an encoder what a passport says: the same one after a mishap, or the one that replaces it.
///
/// The plan is shown before anything is written, each step is read back, and what the encoder was
/// before is written to a new file first: beside FILE, as NAME.before.toml, or where --undo says.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel apply winch.toml --bus slcan:/dev/ttyACM0 --address 5
  codewheel apply winch.toml --bus slcan:/dev/ttyACM0 --address 5 --undo before.toml --yes
  codewheel apply winch.toml --position 18000 --bus slcan:/dev/ttyACM0 --address 5

Another unit cannot know where the machine stands: it must stand where it stood at the backup, or
--position says where it is.

Exit codes: 0 it is as the passport says, 1 something is not, 2 usage or no consent, 3 bus or file,
            4 refused, 5 time-out.")]
pub(crate) struct ApplyArguments {
    /// The passport, as `codewheel backup` or `codewheel passport` writes it
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,

    /// Where the machine stands now, in steps of the passport
    #[arg(long, value_name = "STEPS", value_parser = crate::hilo::number)]
    pub(crate) position: Option<u32>,

    /// Write what the encoder was before into this new file; applying it undoes all
    #[arg(long, value_name = "FILE")]
    pub(crate) undo: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) encoder: EncoderAddress,

    #[command(flatten)]
    pub(crate) consent: Consent,

    #[command(flatten)]
    pub(crate) format: Format,
}

/// Make passports of encoders from a recording of their bus, of dead ones too.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel passport startup.pcapng
  codewheel passport startup.log -o passports
  codewheel passport startup.log --json | jq '.passport.settings'

What the recording does not show is not in the passport, which says so.")]
pub(crate) struct PassportArguments {
    /// The recording, as `codewheel encoder --record` or candump -L write it; its suffix says its
    /// format
    #[arg(value_name = "CAPTURE")]
    pub(crate) capture: PathBuf,

    #[command(flatten)]
    pub(crate) output: super::OutputArguments,

    #[command(flatten)]
    pub(crate) format: Format,
}

fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate| (0.1..=100.0).contains(rate));
    rate.ok_or_else(|| "write a number from 0.1 to 100, as in 10 or 0.5".to_owned())
}

//! The command line.

pub(crate) mod commission;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use codewheel_device::Product;
use codewheel_link::BusUri;
use codewheel_plant::TimeSpan;

use self::commission::{
    ApplyArguments, BackupArguments, DiffArguments, GetArguments, IdentifyArguments,
    PassportArguments, PresetArguments, RESET_EXAMPLES, RESTORE_EXAMPLES, SAVE_EXAMPLES,
    ScanArguments, ServiceArguments, SetArguments, WatchArguments,
};
use crate::page::PageArguments;

/// An absolute rotary encoder made of software.
///
/// Without a verb it runs the demo: a virtual DeviceNet at 500k and a virtual PROFIBUS at 1.5M with
/// three encoders each, polled by masters, shown in a live table and on a web page until Ctrl-C.
#[derive(Debug, Parser)]
#[command(
    version,
    after_help = "Exit codes: 0 ok, 1 findings, 2 usage, 3 bus or I/O, \
                                 4 the device refused, 5 time-out."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) verb: Option<Verb>,

    /// Say nothing on stderr but errors
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,

    /// Say more on stderr
    #[arg(short, long, global = true)]
    verbose: bool,

    #[command(flatten)]
    pub(crate) page: PageArguments,
}

/// How much goes to stderr.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Chatter {
    Quiet,
    Normal,
    Verbose,
}

impl Arguments {
    pub(crate) const fn chatter(&self) -> Chatter {
        match (self.quiet, self.verbose) {
            (true, _) => Chatter::Quiet,
            (false, true) => Chatter::Verbose,
            (false, false) => Chatter::Normal,
        }
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    Run(RunArguments),
    Encoder(Box<EncoderArguments>),
    Scan(ScanArguments),
    Identify(IdentifyArguments),
    Get(GetArguments),
    Set(SetArguments),
    Preset(PresetArguments),
    /// Keep the settings in force over a power-off (DeviceNet).
    #[command(after_help = SAVE_EXAMPLES)]
    Save(ServiceArguments),
    /// Bring back the settings that were saved (DeviceNet).
    #[command(after_help = RESTORE_EXAMPLES)]
    Restore(ServiceArguments),
    /// Bring back the settings of the factory; what was saved stays saved (DeviceNet).
    #[command(after_help = RESET_EXAMPLES)]
    Reset(ServiceArguments),
    Watch(WatchArguments),
    Backup(BackupArguments),
    Diff(DiffArguments),
    Apply(ApplyArguments),
    Passport(PassportArguments),
    Replay(ReplayArguments),
    Models(ModelsArguments),
    Describe(DescribeArguments),
    /// Write the EDS file of a DeviceNet model, for the configuration tool of its scanner.
    #[command(after_help = EDS_EXAMPLES)]
    Eds(SheetArguments),
    /// Write the GSD file of a PROFIBUS model, for the configuration tool of its master.
    #[command(after_help = GSD_EXAMPLES)]
    Gsd(SheetArguments),
    Hilo(HiloArguments),
    Doctor(DoctorArguments),
    /// Print the JSON Schema of plant files, for editors that complete and check them.
    Schema,
    Completions(CompletionsArguments),
    Man(ManArguments),
}

/// Run a plant: buses, devices, shafts, memories, faults and masters from one TOML file.
///
/// On a terminal it shows a live table, elsewhere a line for each device and second; and all of it
/// on a web page, where the shafts can be turned. It ends with Ctrl-C or a termination, after the
/// memories have taken what they are still to take.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel run examples/demo.toml
  codewheel run examples/faults.toml --for 16s
  codewheel run examples/demo.toml --for 10s --record demo.pcapng
  codewheel run plant.toml --json | jq 'select(.lamp == \"red\")'
  codewheel run plant.toml --listen 0.0.0.0:8080 --token \"$(openssl rand -hex 16)\"
  codewheel run plant.toml --print-config > complete.toml")]
pub(crate) struct RunArguments {
    /// The plant file; relative paths in it are meant from its folder
    pub(crate) file: PathBuf,

    /// End after this time, such as 3s, 500ms or 2m
    #[arg(long = "for", value_name = "DURATION")]
    pub(crate) lasts: Option<TimeSpan>,

    /// Print the complete plant, every default filled in, and run nothing
    #[arg(long)]
    pub(crate) print_config: bool,

    /// One JSON object a line, for each device and second
    #[arg(long, conflicts_with = "print_config")]
    pub(crate) json: bool,

    /// Record what all buses carry into one file, which is made anew: .pcapng or .log; .asc or .trc
    /// where all buses are DeviceNet
    #[arg(long, value_name = "FILE", conflicts_with = "print_config")]
    pub(crate) record: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) page: PageArguments,
}

/// Play one encoder on a bus until Ctrl-C.
///
/// Prints one line when it is ready: `ready amg11-d29 address 5 on slcan-listen:127.0.0.1:4001`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel encoder amg11-d29 --bus slcan-listen:127.0.0.1:4001 --address 5
  codewheel encoder hmg10-d13 --bus slcan-listen:127.0.0.1:4001 --address 5 \\
      --shaft 'sine amplitude=90deg period=4s' --memory encoder.memory
  codewheel encoder amg11-p29 --bus rs485-listen:pty:./pb --address 7 --baud 19200 \\
      --fault 'jump steps=4000 at=30s'
  codewheel encoder heag162-p29 --bus rs485:/dev/ttyUSB0 --address 7 --ssi-word 25
  codewheel encoder amg11-d29 --bus socketcan:can0 --address 5 --record session.pcapng

Shafts: still | turn rpm=60 | sine amplitude=90deg period=2s |
        profile 0s:0 1s:90deg 3s:2turns [repeat] | csv FILE (lines of seconds,turns).
        Each takes angle=, where it begins: raw steps (4096), 90deg or 1.5turns.

Buses:  slcan-listen:HOST:PORT       DeviceNet: play an SLCAN adapter that any number of clients share
        slcan-listen:pty:PATH        DeviceNet: play one at a serial port of this machine
        slcan:HOST:PORT              DeviceNet: be the client of an SLCAN adapter on TCP
        slcan:/dev/ttyACM0[@SPEED]   DeviceNet: an SLCAN adapter at a serial port
        socketcan:can0               DeviceNet: a CAN interface of Linux
        socketcand-listen:HOST:PORT  DeviceNet: play a socketcand server
        rs485-listen:HOST:PORT       PROFIBUS: be a line on TCP that any number of clients share
        rs485-listen:pty:PATH        PROFIBUS: be a line that is a serial port of this machine
        rs485:HOST:PORT              PROFIBUS: be the client of such a line
        rs485:/dev/tty…              PROFIBUS: a serial port
        virtual:NAME                 a bus inside this process
        `codewheel doctor --bus URI` says whether one can be used, and what it can hold.

Faults: jump steps=N | stuck | free | cell-low | cell-right | power-cut [for=T] |
        drop-answers [probability=P] [count=N] [for=T] | late-answers delay=T [for=T] |
        bus-off (DeviceNet) | ssi-unplugged | ssi-short | ssi-wrong-word bits=N |
        ssi-no-monoflop | ssi-flipped-bits bits=N | ssi-right (HEAG 162).
        Each takes at=, when it happens, from the start.")]
pub(crate) struct EncoderArguments {
    /// The model, such as amg11-d29 or amg11-p29; `codewheel models` lists them
    #[arg(value_parser = parse_model)]
    pub(crate) model: &'static Product,

    /// Where the encoder is plugged in
    #[arg(long, value_name = "URI")]
    pub(crate) bus: BusUri,

    /// The address switches: the MAC ID, 0–63, or the station address, 0–99
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub(crate) address: String,

    /// The bit rate. DeviceNet: 125k, 250k or 500k, by default 125k. PROFIBUS: 9.6k to 12M or
    /// 9600 to 12000000, by default 1.5M, and what a serial port is found to run at
    #[arg(long, value_name = "RATE")]
    pub(crate) baud: Option<String>,

    /// What the shaft does; of a HEAG 162 that of the encoder at its SSI line
    #[arg(long, value_name = "SHAFT", default_value = "still")]
    pub(crate) shaft: String,

    /// The file that holds the non-volatile memory; without it, saved settings last as long as
    /// the process
    #[arg(long, value_name = "FILE")]
    pub(crate) memory: Option<PathBuf>,

    /// The serial number; by default what the memory holds, else the address
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub(crate) serial: Option<u32>,

    /// What goes wrong, and when, such as 'jump steps=4000 at=5s'; can be given many times
    #[arg(long = "fault", value_name = "FAULT")]
    pub(crate) faults: Vec<String>,

    /// Record what the bus carries into a file, which is made anew: .pcapng or .log; .asc or .trc
    /// for DeviceNet
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) ssi: SsiArguments,
}

/// How a HEAG 162 reads its SSI line.
#[derive(Args, Debug)]
#[command(next_help_heading = "SSI line (HEAG 162)")]
pub(crate) struct SsiArguments {
    /// A real encoder at an SPI controller of Linux, spidev:/dev/spidev0.0, in place of a virtual
    /// one that --shaft moves
    #[arg(long, value_name = "LINE")]
    pub(crate) ssi: Option<String>,

    /// The bits of the SSI word: that of the product, or 25 for a heag162-p29
    #[arg(long, value_name = "BITS")]
    pub(crate) ssi_word: Option<u8>,

    /// How the code is written: gray or binary; by default gray
    #[arg(long, value_name = "CODE", value_parser = ["gray", "binary"])]
    pub(crate) ssi_code: Option<String>,

    /// The clock, 100k to 1M; by default 500k
    #[arg(long, value_name = "CLOCK")]
    pub(crate) ssi_clock: Option<String>,

    /// How long the encoder wants no clock before it latches anew; by default 20us
    #[arg(long, value_name = "TIME")]
    pub(crate) ssi_monoflop: Option<TimeSpan>,

    /// Read each word twice and compare
    #[arg(long)]
    pub(crate) ssi_double_read: bool,
}

/// Tell what a recording holds: each frame and telegram by its name, with its numbers.
///
/// Reads what --record writes, and the same formats of other tools: .log of candump -L, .asc of
/// Vector, .trc of PEAK, .pcapng of Wireshark. What cannot be read is said on stderr, with its
/// place, and passed over.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel replay session.pcapng
  codewheel replay session.log --json | jq 'select(.bus == \"can0\")'

Exit codes: 0 all was read, 1 something is damaged, 2 no such format, 3 the file cannot be read.")]
pub(crate) struct ReplayArguments {
    /// The recording; its suffix says its format
    pub(crate) file: PathBuf,

    /// One JSON object a line, for each frame and telegram
    #[arg(long)]
    pub(crate) json: bool,
}

/// List the models.
#[derive(Args, Debug)]
pub(crate) struct ModelsArguments {
    /// One JSON object a line
    #[arg(long)]
    pub(crate) json: bool,
}

/// Describe models: geometry, switches, lamp, and what their bus can read and write.
///
/// --all gives a chapter for each bus: what its models share once, what differs with the models it
/// is for. With --json, one object a line for each model.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel describe amg11-p29
  codewheel describe amg11-d29 --json | jq '.attributes[] | select(.access == \"read/write\").key'
  codewheel describe --all --markdown -o docs/book/src/reference --force")]
pub(crate) struct DescribeArguments {
    /// The model, such as amg11-d29; `codewheel models` lists them
    #[arg(value_parser = parse_model, required_unless_present = "all", conflicts_with = "all")]
    pub(crate) model: Option<&'static Product>,

    /// All models
    #[arg(long)]
    pub(crate) all: bool,

    /// Markdown, as in the book
    #[arg(long)]
    pub(crate) markdown: bool,

    /// JSON: one object a line
    #[arg(long, conflicts_with = "markdown")]
    pub(crate) json: bool,

    #[command(flatten)]
    pub(crate) output: OutputArguments,
}

/// Where files go.
#[derive(Args, Debug)]
pub(crate) struct OutputArguments {
    /// Write files into this folder and print where they are, instead of their text
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub(crate) folder: Option<PathBuf>,

    /// Replace files that are there and say something else
    #[arg(long, requires = "folder")]
    pub(crate) force: bool,
}

const EDS_EXAMPLES: &str = "\
Examples:
  codewheel eds amg11-d29
  codewheel eds amg11-d29 -o .      AMG11D29.eds, as the manual calls it
  codewheel eds -o eds              the files of all DeviceNet models";

const GSD_EXAMPLES: &str = "\
Examples:
  codewheel gsd amg11-p29
  codewheel gsd amg11-p29 -o .      PB29DPV0.GSD, as the manual calls it
  codewheel gsd -o gsd              the files of all PROFIBUS models";

/// Which data sheets.
#[derive(Args, Debug)]
pub(crate) struct SheetArguments {
    /// The model; without it all of the bus, with -o
    #[arg(value_parser = parse_model)]
    pub(crate) model: Option<&'static Product>,

    #[command(flatten)]
    pub(crate) output: OutputArguments,
}

/// Split a number into the hi and lo words that configuration tools ask for, or put it together.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel hilo 921600             hi 14 lo 4096
  codewheel hilo 14 4096            921600
  codewheel hilo 0xE1000 --json     {\"value\":921600,\"hi\":14,\"lo\":4096}")]
pub(crate) struct HiloArguments {
    /// The number to split; with LO behind it the hi word. Decimal, 0xE1000 or E1000h
    #[arg(value_name = "NUMBER", value_parser = crate::hilo::number)]
    pub(crate) value: u32,

    /// The lo word
    #[arg(value_parser = crate::hilo::number)]
    pub(crate) lo: Option<u32>,

    /// One JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

/// Say what this machine and its adapter can hold: how fast it answers, which PROFIBUS rates that
/// suits, what is missing, and what to do about it.
///
/// Nothing is sent on the bus. Each finding comes with its remedy.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel doctor
  codewheel doctor --bus rs485:/dev/ttyUSB0
  codewheel doctor --bus socketcan:can0 --json

Exit codes: 0 all is well, 1 findings, 3 the bus cannot be used.")]
pub(crate) struct DoctorArguments {
    /// A bus to look at besides
    #[arg(long, value_name = "URI")]
    pub(crate) bus: Option<BusUri>,

    /// One JSON object a line, for each finding
    #[arg(long)]
    pub(crate) json: bool,
}

/// Print what makes a shell complete the verbs and options of this program.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel completions bash > ~/.local/share/bash-completion/completions/codewheel
  codewheel completions zsh > ~/.zfunc/_codewheel
  codewheel completions fish > ~/.config/fish/completions/codewheel.fish")]
pub(crate) struct CompletionsArguments {
    /// The shell
    pub(crate) shell: clap_complete::Shell,
}

/// Print the manual page of this program, or write those of all verbs into a folder.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel man | man -l -
  codewheel man -o ~/.local/share/man/man1")]
pub(crate) struct ManArguments {
    #[command(flatten)]
    pub(crate) output: OutputArguments,
}

fn parse_model(text: &str) -> Result<&'static Product, String> {
    Product::find(text).ok_or_else(|| {
        let models: Vec<_> = Product::all().map(|product| product.model).collect();
        format!("the models are {}", models.join(", "))
    })
}

impl SsiArguments {
    /// What was given, with the keys of plant files.
    pub(crate) fn keys(&self) -> Vec<(&'static str, String)> {
        let keys = [
            ("line", self.ssi.clone()),
            ("word", self.ssi_word.map(|bits| bits.to_string())),
            ("code", self.ssi_code.clone()),
            ("clock", self.ssi_clock.clone()),
            ("monoflop", self.ssi_monoflop.map(|time| time.to_string())),
            ("double_read", self.ssi_double_read.then(|| "true".to_owned())),
        ];
        keys.into_iter().filter_map(|(key, value)| Some((key, value?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}

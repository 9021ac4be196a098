//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use codewheel_device::{Product, product};
use codewheel_link::BusUri;
use codewheel_plant::TimeSpan;
use codewheel_station::can::BitRate;

/// An absolute rotary encoder made of software.
///
/// Without a verb it runs the demo: three encoders on a virtual DeviceNet at 500k, polled by a
/// scanner, shown in a live table until Ctrl-C.
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
    Encoder(EncoderArguments),
    Models(ModelsArguments),
    Describe(DescribeArguments),
    /// Print the JSON Schema of plant files, for editors that complete and check them.
    Schema,
}

/// Run a plant: buses, devices, shafts, memories, faults and masters from one TOML file.
///
/// On a terminal it shows a live table, elsewhere a line for each device and second. It ends with
/// Ctrl-C or a termination, after the memories have taken what they are still to take.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  codewheel run examples/demo.toml
  codewheel run examples/faults.toml --for 16s
  codewheel run plant.toml --json | jq 'select(.lamp == \"red\")'
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

Shafts: still | turn rpm=60 | sine amplitude=90deg period=2s |
        profile 0s:0 1s:90deg 3s:2turns [repeat] | csv FILE (lines of seconds,turns).
        Each takes angle=, where it begins: raw steps (4096), 90deg or 1.5turns.

Buses:  slcan-listen:HOST:PORT   play a SLCAN adapter that any number of clients share
        slcan:HOST:PORT          be the client of a SLCAN adapter on TCP
        virtual:NAME             a bus inside this process")]
pub(crate) struct EncoderArguments {
    /// The model, such as amg11-d29; `codewheel models` lists them
    #[arg(value_parser = parse_model)]
    pub(crate) model: &'static Product,

    /// Where the encoder is plugged in
    #[arg(long, value_name = "URI")]
    pub(crate) bus: BusUri,

    /// The address switches, 0–63: the MAC ID
    #[arg(long, value_name = "N", value_parser = parse_address, allow_negative_numbers = true)]
    pub(crate) address: u8,

    /// The bit rate switches: 125k, 250k or 500k
    #[arg(long, value_name = "RATE", default_value = "125k", value_parser = parse_bit_rate)]
    pub(crate) baud: BitRate,

    /// What the shaft does
    #[arg(long, value_name = "SHAFT", default_value = "still")]
    pub(crate) shaft: String,

    /// The file that holds the non-volatile memory; without it, saved settings last as long as
    /// the process
    #[arg(long, value_name = "FILE")]
    pub(crate) memory: Option<PathBuf>,

    /// The serial number; by default what the memory holds, else the address
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub(crate) serial: Option<u32>,
}

/// List the models.
#[derive(Args, Debug)]
pub(crate) struct ModelsArguments {
    /// One JSON object a line
    #[arg(long)]
    pub(crate) json: bool,
}

/// Describe one model: geometry, switches, lamp, attributes.
#[derive(Args, Debug)]
pub(crate) struct DescribeArguments {
    /// The model, such as amg11-d29
    #[arg(value_parser = parse_model)]
    pub(crate) model: &'static Product,
}

fn parse_model(text: &str) -> Result<&'static Product, String> {
    Product::find(text).ok_or_else(|| {
        let models: Vec<_> = product::DEVICENET.iter().map(|product| product.model).collect();
        format!("the models are {}", models.join(", "))
    })
}

fn parse_address(text: &str) -> Result<u8, String> {
    text.parse().ok().filter(|address| *address <= 63).ok_or_else(|| "DeviceNet has 0–63".into())
}

fn parse_bit_rate(text: &str) -> Result<BitRate, String> {
    BitRate::ALL
        .into_iter()
        .find(|rate| rate.to_string().eq_ignore_ascii_case(text))
        .ok_or_else(|| "the rates are 125k, 250k and 500k".into())
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

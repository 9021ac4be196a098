//! `codewheel encoder`: one encoder on a bus.

use std::io::Write;

use codewheel_link::BusUri;
use codewheel_plant::{Player, PlayerSettings, Report};
use codewheel_sim::shaft::Shaft;

use crate::arguments::{Chatter, EncoderArguments};
use crate::failure::Failure;
use crate::signals::stop_flag;

pub(crate) fn run(arguments: EncoderArguments, chatter: Chatter) -> Result<(), Failure> {
    let EncoderArguments { model: product, bus, address, baud, shaft, memory, serial } = arguments;
    let geometry = product.encoder.geometry;
    let shaft = Shaft::parse(&shaft, geometry.singleturn_resolution(), geometry.revolutions())?;
    let is_virtual = matches!(bus, BusUri::Virtual(_));
    let mut player = Player::power_up(PlayerSettings {
        product,
        bus,
        address,
        bit_rate: baud,
        shaft,
        memory,
        serial,
    })?;
    let waker = player.waker();
    let stop = stop_flag(move || waker.wake())?;
    println!("ready {} address {address} on {}", product.model, player.bus());
    std::io::stdout().flush()?;
    if is_virtual && chatter > Chatter::Quiet {
        eprintln!(
            "codewheel: nobody else can join a virtual bus of this process, so nothing \
             acknowledges the encoder and it stays off-line; slcan-listen:HOST:PORT lets others join"
        );
    }
    player.run(&stop, &mut |report| tell(&report, chatter))?;
    Ok(())
}

/// Events of the device are for those who ask for more; trouble is for everybody.
fn tell(report: &Report, chatter: Chatter) {
    let least = match report {
        Report::Device(_, event) if !event.is_trouble() => Chatter::Verbose,
        Report::Port(notice) if !notice.is_trouble() => Chatter::Verbose,
        Report::SetAside(_) | Report::NotKept(_) => Chatter::Quiet,
        Report::Device(..) | Report::Port(_) => Chatter::Normal,
    };
    if chatter < least {
        return;
    }
    match report {
        Report::Device(at, event) => eprintln!("codewheel: {at} {event}"),
        Report::Port(notice) => eprintln!("codewheel: {notice}"),
        Report::SetAside(path) => eprintln!(
            "codewheel: the memory file was damaged: it is now {}, and the encoder runs with the \
             defaults",
            path.display()
        ),
        Report::NotKept(error) => eprintln!("codewheel: {error}"),
    }
}

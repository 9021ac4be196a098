//! `codewheel watch`: a position as it moves.

mod motion;
mod show;

use std::time::{Duration, Instant};

use codewheel_commission::{Reading, Sample, Trouble};

use self::motion::Motion;
pub(super) use self::motion::Scale;
use super::bus::{self, Listener, Way};
use super::encoder::Encoder;
use super::identify;
use crate::arguments::Chatter;
use crate::arguments::commission::WatchArguments;
use crate::failure::Failure;

pub(super) fn run(arguments: &WatchArguments, chatter: Chatter) -> Result<(), Failure> {
    match bus::open_or_listen(&arguments.encoder, chatter)? {
        Way::Serve(mut encoder) => {
            let result = serve(&mut encoder, arguments);
            encoder.end(result)
        }
        Way::Listen(mut listener) => listen(&mut listener, arguments),
    }
}

/// Watches an encoder that is ours meanwhile.
fn serve(encoder: &mut Encoder, arguments: &WatchArguments) -> Result<(), Failure> {
    let identity = encoder.session.identify()?;
    let who = format!(
        "{} at address {} of {}",
        identify::models(&identity),
        encoder.session.address(),
        encoder.session.bus()
    );
    let mut number = |key| {
        Ok::<_, Trouble>(encoder.find(key)?.and_then(|value| match value.reading {
            Reading::Number(number) => u32::try_from(number).ok(),
            _ => None,
        }))
    };
    let scale = Scale {
        steps_per_turn: number("steps-per-turn")?,
        total_resolution: number("total-resolution")?,
    };
    watch(arguments, scale, who, || match encoder.session.sample() {
        Err(_) if encoder.is_stopped() => Ok(None),
        sample => Ok(Some(sample?)),
    })
}

/// Watches an encoder of another master.
fn listen(listener: &mut Listener, arguments: &WatchArguments) -> Result<(), Failure> {
    let who = listener.who.clone();
    watch(arguments, listener.scale, who, || match (listener.next)() {
        Err(_) if listener.stop.is_wanted() => Ok(None),
        sample => Ok(Some(sample?)),
    })
}

/// Shows what `next` gives, until it gives nothing more, since a person wants an end, or time is up.
fn watch(
    arguments: &WatchArguments,
    scale: Scale,
    who: String,
    mut next: impl FnMut() -> Result<Option<Sample>, Trouble>,
) -> Result<(), Failure> {
    let begun = Instant::now();
    let lasts = arguments.lasts.map(|time| Duration::from(time.0));
    let mut show = show::choose(arguments, who);
    let period = Duration::from_secs_f64(1.0 / arguments.rate.unwrap_or_else(|| show.rate()));
    let mut motion = Motion::new(scale);
    let mut shown: Option<Instant> = None;
    while lasts.is_none_or(|lasts| begun.elapsed() < lasts) {
        let Some(sample) = next()? else { break };
        let readout = motion.take(sample);
        if shown.is_none_or(|shown| shown.elapsed() >= period) {
            // On a grid of its own, so that the rate does not lag behind the samples.
            let now = Instant::now();
            let due = shown.map_or(now, |shown| shown + period);
            shown = Some(if now.duration_since(due) > period { now } else { due });
            show.show(&readout, &motion)?;
        }
    }
    Ok(())
}

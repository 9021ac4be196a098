//! `codewheel save`, `restore` and `reset`.

use std::io::Write;

use codewheel_commission::Trouble;
use codewheel_device::product::Bus;
use serde::Serialize;

use super::encoder::Encoder;
use super::settings::{ChangeLine, Settings, tell_how_long, tell_undo};
use crate::arguments::commission::ServiceArguments;
use crate::failure::Failure;

/// What the whole encoder is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Service {
    Save,
    Restore,
    Reset,
}

#[derive(Serialize)]
struct Line<'a> {
    done: Service,
    changed: Vec<ChangeLine<'a>>,
    undo: &'a [String],
}

impl Service {
    /// What it will do to an encoder with these settings.
    fn warning(self, now: &Settings) -> String {
        let summary = now.summary();
        match self {
            Self::Save => format!(
                "these settings will be there after a power-off: {summary}; what was saved before \
                 cannot be read"
            ),
            Self::Restore => format!(
                "what was saved last, which cannot be read before, takes the place of these \
                 settings: {summary}"
            ),
            Self::Reset => format!(
                "the settings of the factory, without an offset, take the place of these: {summary}"
            ),
        }
    }

    const fn question(self) -> &'static str {
        match self {
            Self::Save => "Save them?",
            Self::Restore => "Restore?",
            Self::Reset => "Reset?",
        }
    }

    fn carry_out(self, encoder: &mut Encoder) -> Result<(), Trouble> {
        match self {
            Self::Save => encoder.session.save(),
            Self::Restore => encoder.session.restore(),
            Self::Reset => encoder.session.reset(),
        }
    }
}

pub(super) fn run(
    encoder: &mut Encoder,
    arguments: &ServiceArguments,
    service: Service,
) -> Result<(), Failure> {
    if encoder.session.bus() == Bus::Profibus {
        // The bus has no such service, and the refusal says what to do instead.
        return Ok(service.carry_out(encoder)?);
    }
    let before = Settings::of(encoder)?;
    encoder.propose(&service.warning(&before), arguments.consent);
    arguments.consent.ask(service.question(), encoder)?;
    service.carry_out(encoder)?;
    let after = Settings::of(encoder)?;
    let undo = before.undo(&after, encoder);
    let told = tell(service, arguments, (&before, &after), &undo);
    // Also where nobody reads what is told.
    tell_undo(&undo, encoder);
    if service == Service::Reset && !undo.is_empty() {
        tell_how_long(encoder);
    }
    told
}

fn tell(
    service: Service,
    arguments: &ServiceArguments,
    (before, after): (&Settings, &Settings),
    undo: &[String],
) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    if arguments.format.json {
        let line = Line { done: service, changed: before.lines(after), undo };
        writeln!(out, "{}", serde_json::to_string(&line).map_err(std::io::Error::from)?)?;
        return Ok(());
    }
    let (changes, offsets) = (before.changes(after), before.offsets(after));
    match service {
        Service::Save => writeln!(out, "saved")?,
        _ if changes.is_empty() && offsets.is_none() => writeln!(out, "nothing changed")?,
        _ => {}
    }
    for change in &changes {
        writeln!(out, "{change}")?;
    }
    if let Some((before, after)) = offsets {
        writeln!(out, "offset: {before} → {after} step")?;
    }
    Ok(())
}

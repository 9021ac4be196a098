//! `codewheel apply`: makes an encoder what a passport says.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use codewheel_commission::passport::{self, Difference, Passport, Plan, Report, Step, Verdict};
use codewheel_commission::{Kind, Trouble};
use serde::Serialize;

use super::command_line::command;
use super::encoder::Encoder;
use super::passports;
use super::progress::Bar;
use crate::arguments::commission::ApplyArguments;
use crate::failure::Failure;

#[derive(Serialize)]
struct Line<'a> {
    verdict: &'static str,
    steps: &'a [Step],
    differences: &'a [Difference],
    remarks: &'a [String],
    undo: Option<&'a str>,
}

pub(super) fn run(
    encoder: &mut Encoder,
    goal: &Passport,
    arguments: &ApplyArguments,
) -> Result<(), Failure> {
    let circumstances = passports::circumstances(encoder.bit_rate);
    let session = encoder.session.as_mut();
    let plan = passport::plan(goal, session, &circumstances, arguments.position)?;
    encoder.propose(&plan.to_string(), arguments.consent);
    if plan.is_empty() {
        let report = Report {
            steps: Vec::new(),
            verdict: Verdict::Done,
            after: None,
            remarks: Vec::new(),
            project: plan.project(),
        };
        return tell(&report, arguments, None);
    }
    arguments.consent.ask("Do it?", encoder)?;
    let undo = keep(&plan, arguments)?;
    let undo = command(&["apply", &undo.display().to_string()], encoder.at);
    let report = {
        let bar = Bar::new(encoder.chatter);
        plan.carry_out(encoder.session.as_mut(), &circumstances, &mut |progress| bar.show(progress))
    };
    let told = tell(&report, arguments, Some(&undo));
    // Also where nobody reads what is told.
    encoder.say(&format!("undo: {undo}"));
    told?;
    let address = encoder.session.address();
    match report.verdict {
        Verdict::Done => Ok(()),
        Verdict::Stopped(trouble) => Err(trouble.into()),
        Verdict::Differs(differences) => Err(Trouble::new(
            Kind::Differs,
            format!("make the encoder at address {address} what {} says", arguments.file.display()),
            format!("read back, {} of its values differ", differences.len()),
            "see whether the shaft moved and who else writes, and apply it again",
        )
        .into()),
    }
}

fn tell(report: &Report, arguments: &ApplyArguments, undo: Option<&str>) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if !arguments.format.json {
        // What stopped it is said as every error is.
        if !matches!(report.verdict, Verdict::Stopped(_)) {
            write!(out, "{report}")?;
            return Ok(());
        }
        for step in &report.steps {
            writeln!(out, "{step}")?;
        }
        for remark in &report.remarks {
            writeln!(out, "note: {remark}")?;
        }
        return Ok(());
    }
    let (verdict, differences) = match &report.verdict {
        Verdict::Done => ("done", &[][..]),
        Verdict::Differs(differences) => ("differs", differences.as_slice()),
        Verdict::Stopped(_) => ("stopped", &[][..]),
    };
    let Report { steps, remarks, .. } = report;
    let line = Line { verdict, steps, differences, remarks, undo };
    writeln!(out, "{}", serde_json::to_string(&line).map_err(io::Error::from)?)?;
    Ok(())
}

/// Writes what the encoder was before into a file of its own, which never replaces one.
fn keep(plan: &Plan, arguments: &ApplyArguments) -> Result<PathBuf, Failure> {
    let text = plan.undo().to_toml();
    if let Some(path) = &arguments.undo {
        create(path, &text).map_err(|reason| Failure::File { path: path.clone(), reason })?;
        return Ok(path.clone());
    }
    for number in 1..=u16::MAX {
        let path = beside(&arguments.file, number);
        match create(&path, &text) {
            Err(reason) if reason.kind() == io::ErrorKind::AlreadyExists => {}
            Err(reason) => return Err(Failure::File { path, reason }),
            Ok(()) => return Ok(path),
        }
    }
    Err(Failure::Usage(format!(
        "there are too many files beside {}: say with --undo where to write what the encoder was",
        arguments.file.display()
    )))
}

fn create(path: &Path, text: &str) -> io::Result<()> {
    let mut file = File::create_new(path)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()
}

/// `winch.before.toml`, then `winch.before-2.toml`.
fn beside(file: &Path, number: u16) -> PathBuf {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let number = if number == 1 { String::new() } else { format!("-{number}") };
    file.with_file_name(format!("{stem}.before{number}.toml"))
}

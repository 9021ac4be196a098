//! `codewheel scan`: who is on a bus.

use std::io::Write;

use codewheel_commission::{Found, Identity, Kind, Owner, Role, Survey, Trouble};
use comfy_table::{Table, presets};
use serde::Serialize;

use super::identify;
use crate::arguments::Chatter;
use crate::arguments::commission::ScanArguments;
use crate::failure::Failure;

#[derive(Serialize)]
struct Line<'a> {
    bus: String,
    address: u8,
    role: &'static str,
    identity: Option<identify::Line<'a>>,
    /// The address of its master; null where it belongs to nobody.
    owner: serde_json::Value,
    lamp: Option<&'a str>,
    state: &'a str,
}

#[derive(Serialize)]
struct Remark<'a> {
    remark: &'a str,
}

const fn role(found: &Found) -> &'static str {
    match found.role {
        Role::Master => "master",
        Role::Slave => "slave",
        Role::Unknown => "unknown",
    }
}

pub(super) fn tell(
    survey: &Survey,
    arguments: &ScanArguments,
    chatter: Chatter,
) -> Result<(), Failure> {
    if survey.nodes.is_empty() {
        let came = match survey.remarks.as_slice() {
            [] => "nobody is there".to_owned(),
            remarks => remarks.join("; "),
        };
        return Err(Trouble::new(Kind::Bus, "find anybody on the bus", came, "").into());
    }
    let mut out = std::io::stdout().lock();
    if arguments.format.json {
        for node in &survey.nodes {
            let line = Line {
                bus: survey.bus.to_string(),
                address: node.address,
                role: role(node),
                identity: node.identity.as_ref().map(Into::into),
                owner: match node.owner {
                    Some(Owner::Master(address)) => address.into(),
                    Some(Owner::Somebody) => "unknown".into(),
                    Some(Owner::Nobody) | None => serde_json::Value::Null,
                },
                lamp: node.lamp,
                state: &node.state,
            };
            writeln!(out, "{}", serde_json::to_string(&line).map_err(std::io::Error::from)?)?;
        }
        for remark in &survey.remarks {
            let line = serde_json::to_string(&Remark { remark }).map_err(std::io::Error::from)?;
            writeln!(out, "{line}")?;
        }
        return Ok(());
    }
    writeln!(out, "{}", table(&survey.nodes))?;
    if chatter > Chatter::Quiet {
        survey.remarks.iter().for_each(|remark| eprintln!("codewheel: {remark}"));
    }
    Ok(())
}

/// The models it may be, as short as a column must be: the first stands for those like it.
fn models(identity: &Identity) -> String {
    match identity.models.as_slice() {
        [first, others @ ..] if others.len() > 1 => {
            format!("{} or {} more", first.model, others.len())
        }
        _ => identify::models(identity),
    }
}

fn table(nodes: &[Found]) -> String {
    let unknown = || "–".to_owned();
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header([
        "ADDRESS", "ROLE", "MODEL", "NAME", "SERIAL", "REVISION", "OWNER", "LAMP", "STATE",
    ]);
    for node in nodes {
        let of = |show: fn(&Identity) -> Option<String>| {
            node.identity.as_ref().and_then(show).unwrap_or_else(unknown)
        };
        table.add_row([
            node.address.to_string(),
            role(node).to_owned(),
            of(|identity| Some(models(identity))),
            of(|identity| identity.product_name.as_deref().map(super::value::printable)),
            of(|identity| identity.serial.map(|serial| serial.to_string())),
            of(identify::revision),
            match node.owner {
                Some(Owner::Master(address)) => address.to_string(),
                Some(Owner::Somebody) => "somebody".to_owned(),
                Some(Owner::Nobody) => "nobody".to_owned(),
                None => unknown(),
            },
            node.lamp.map_or_else(unknown, str::to_owned),
            super::value::printable(&node.state),
        ]);
    }
    table.trim_fmt()
}

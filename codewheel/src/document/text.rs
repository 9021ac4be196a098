//! A document on a terminal.

use std::fmt::Write;

use super::{Body, Document, Table};

/// How wide the names of facts are at least, so that sections line up.
const NAMES: usize = 16;

pub(super) fn text(document: &Document) -> String {
    let mut out = document.title.clone();
    if let Some(model) = document.model {
        out.push_str(&format!(" ({model})"));
    }
    out.push('\n');
    for section in &document.sections {
        if !section.title.is_empty() {
            out.push_str(&format!("\n{}\n", section.title));
        }
        match &section.body {
            Body::Facts(facts) => {
                let facts = facts.iter().map(|fact| (fact.name, fact.cell.text.as_str()));
                pairs(facts, NAMES, &mut out);
            }
            Body::Table(table) if table.columns.len() == 2 => {
                let rows = table.rows.iter();
                let rows = rows.map(|row| (row[0].text.as_str(), row[1].text.as_str()));
                pairs(rows, NAMES, &mut out);
            }
            Body::Table(table) => columns(table, &mut out),
        }
        if !section.note.is_empty() {
            out.push_str(&format!("\n{}\n", section.note));
        }
    }
    out
}

/// Lines of two parts, the second ones one below the other.
fn pairs<'a>(
    pairs: impl Iterator<Item = (&'a str, &'a str)> + Clone,
    at_least: usize,
    out: &mut String,
) {
    let longest = pairs.clone().map(|(name, _)| name.chars().count()).max().unwrap_or_default();
    let width = at_least.max(longest + 2);
    for (name, text) in pairs {
        // Writing to a String does not fail.
        let _ = writeln!(out, "  {name:<width$}{text}");
    }
}

/// A table of the short columns, and below it the sentences.
fn columns(table: &Table, out: &mut String) {
    let short: Vec<_> =
        (0..table.columns.len()).filter(|at| !table.columns[*at].is_prose).collect();
    let width = |at: &usize| {
        let cells = table.rows.iter().map(|row| row[*at].text.chars().count());
        cells.chain([table.columns[*at].title.chars().count()]).max().unwrap_or_default()
    };
    let widths: Vec<_> = short.iter().map(width).collect();
    let mut line = |texts: &mut dyn Iterator<Item = &str>| {
        let mut line = String::new();
        for (text, width) in texts.zip(&widths) {
            let _ = write!(line, "  {text:<width$}");
        }
        out.push_str(line.trim_end());
        out.push('\n');
    };
    line(&mut short.iter().map(|at| table.columns[*at].title));
    for row in &table.rows {
        line(&mut short.iter().map(|at| row[*at].text.as_str()));
    }
    let name = table.naming();
    for at in (0..table.columns.len()).filter(|at| table.columns[*at].is_prose) {
        out.push('\n');
        let mut told: Vec<(&str, &str)> = Vec::new();
        for row in &table.rows {
            let sentence = (row[name].text.as_str(), row[at].text.as_str());
            // A key that stands in two rows means the same in both.
            if !told.contains(&sentence) {
                told.push(sentence);
            }
        }
        pairs(told.into_iter(), 0, out);
    }
}

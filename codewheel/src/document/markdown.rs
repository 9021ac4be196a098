//! A document as Markdown.

use super::{Body, Cell, Document};

pub(super) fn markdown(document: &Document) -> String {
    let mut out = format!("# {}\n", escaped(&document.title));
    for section in &document.sections {
        if !section.title.is_empty() {
            out.push_str(&format!("\n## {}\n", escaped(&section.title)));
        }
        out.push('\n');
        match &section.body {
            Body::Facts(facts) => {
                // Markdown knows no table without a head.
                out.push_str("| | |\n|---|---|\n");
                if let (Some(model), true) = (document.model, section.title.is_empty()) {
                    row(&["Model".into(), Cell::literal(model)], &mut out);
                }
                for fact in facts {
                    row(&[fact.name.into(), fact.cell.clone()], &mut out);
                }
            }
            Body::Table(table) => {
                let heads: Vec<_> =
                    table.columns.iter().map(|column| sentence_case(column.title).into()).collect();
                row(&heads, &mut out);
                out.push_str(&format!("|{}\n", "---|".repeat(table.columns.len())));
                for cells in &table.rows {
                    row(cells, &mut out);
                }
            }
        }
        if !section.note.is_empty() {
            out.push_str(&format!("\n{}\n", escaped(&section.note)));
        }
    }
    out
}

fn row(cells: &[Cell], out: &mut String) {
    for cell in cells {
        let text = match cell {
            Cell { text, is_literal: true, .. } if !text.is_empty() => format!("`{text}`"),
            Cell { text, .. } => escaped(text),
        };
        out.push_str(&format!("| {text} "));
    }
    out.push_str("|\n");
}

/// `STEPS/TURN` is for terminals.
fn sentence_case(title: &str) -> String {
    let mut letters = title.chars();
    match letters.next() {
        Some(first) if !title.chars().any(char::is_lowercase) => {
            first.to_string() + &letters.as_str().to_lowercase()
        }
        _ => title.to_owned(),
    }
}

/// The text with what Markdown would read otherwise made plain.
fn escaped(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for letter in text.chars() {
        if "\\`*_<>[]|#".contains(letter) {
            plain.push('\\');
        }
        plain.push(letter);
    }
    plain
}

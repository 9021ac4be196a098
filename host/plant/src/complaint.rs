//! What is wrong with a plant file, shown at its place.

use std::fmt;
use std::io;
use std::ops::Range;
use std::path::PathBuf;

use thiserror::Error;

/// Why a plant file gives no plant.
#[derive(Debug, Error)]
pub enum PlantError {
    /// The file cannot be read.
    #[error("cannot read the plant file {}: {reason}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: io::Error,
    },
    /// The file says something that makes no sense.
    #[error(transparent)]
    Wrong(#[from] Complaint),
}

/// What is wrong with a plant file: file, line and column, one sentence, the line itself with a
/// caret under what is meant.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub struct Complaint {
    name: String,
    line: usize,
    column: usize,
    text: String,
    width: usize,
    message: String,
}

impl Complaint {
    /// Complains about the octets `at` of `source`, which is called `name`.
    pub(crate) fn new(name: &str, source: &str, at: Range<usize>, message: String) -> Self {
        let start = floor(source, at.start);
        let begins = source[..start].rfind('\n').map_or(0, |place| place + 1);
        let ends = source[start..].find('\n').map_or(source.len(), |place| start + place);
        let text = source[begins..ends].trim_end();
        let marked = &source[start..floor(source, at.end).clamp(start, ends)];
        Self {
            name: name.to_owned(),
            line: line_of(source, start),
            column: source[begins..start].chars().count() + 1,
            // A tab is as wide as the caret's blank below it.
            text: text.replace('\t', " "),
            width: marked.trim_end().chars().count().max(1),
            message,
        }
    }

    /// The line, from 1.
    #[must_use]
    pub const fn line(&self) -> usize {
        self.line
    }

    /// The sentence alone.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
    }
}

/// The line of an octet of `source`, from 1.
pub(crate) fn line_of(source: &str, at: usize) -> usize {
    source[..floor(source, at)].matches('\n').count() + 1
}

fn floor(source: &str, at: usize) -> usize {
    let at = at.min(source.len());
    (0..=at).rev().find(|&at| source.is_char_boundary(at)).unwrap_or(0)
}

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, line, column, text, width, message } = self;
        let margin = line.to_string().len();
        write!(
            f,
            "{name}:{line}:{column}: {message}\n{0:margin$} |\n{line} | {text}\n{0:margin$} | {0:1$}{0:^>width$}",
            "",
            column - 1,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_complaint_shows_the_line_with_a_caret_below_what_is_meant() {
        let source = "[[bus]]\nname = \"ü\"\n\tbaud = \"1M\"\n";
        let at = source.find("\"1M\"").unwrap();
        let complaint = Complaint::new("p.toml", source, at..at + 4, "no rate".into());
        assert_eq!(
            complaint.to_string(),
            "p.toml:3:9: no rate\n  |\n3 |  baud = \"1M\"\n  |         ^^^^"
        );
        assert_eq!(complaint.line(), 3);
    }

    #[test]
    fn places_outside_the_text_or_within_a_letter_are_taken_for_the_nearest() {
        for at in [0..0, 3..900, 900..901] {
            let complaint = Complaint::new("p.toml", "a = 'ü'\n", at, "x".into());
            assert!(complaint.to_string().contains('^'));
        }
        assert!(Complaint::new("p.toml", "", 0..0, "x".into()).to_string().ends_with("| ^"));
    }
}

//! Text as configuration tools have read it for thirty years: ASCII, lines ended by CR LF.

use std::fmt;

/// The longest line of a GSD file (GSD specification), and of paragraphs.
const WIDTH: usize = 80;

/// Lines of a file.
#[derive(Debug, Default)]
pub(crate) struct Lines(String);

impl Lines {
    /// Adds a line.
    pub(crate) fn line(&mut self, text: impl fmt::Display) {
        self.0.push_str(ascii(&text.to_string()).trim_end());
        self.0.push_str("\r\n");
    }

    /// Adds a line with a remark, which begins in a column of its own where it can.
    pub(crate) fn line_with(&mut self, text: &str, remark: &str) {
        self.line(format_args!("{text:<47} {remark}"));
    }

    /// Adds `text` in lines that begin with `head` and have at most [`WIDTH`] characters.
    pub(crate) fn paragraph(&mut self, head: &str, text: &str) {
        let mut line = head.to_owned();
        for word in text.split_whitespace() {
            if line.len() + 1 + word.len() > WIDTH && line != head {
                self.line(&line);
                line = head.to_owned();
            }
            line = format!("{line} {word}");
        }
        self.line(&line);
    }

    pub(crate) fn blank(&mut self) {
        self.line("");
    }

    pub(crate) fn into_text(self) -> String {
        self.0
    }
}

/// The text with the few signs of our names and notes that ASCII lacks spelled otherwise.
fn ascii(text: &str) -> String {
    text.replace('…', "...").replace('×', "x").replace(['–', '−'], "-")
}

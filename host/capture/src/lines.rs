//! Lines of a text file, one at a time.

use std::io::{self, BufRead};

/// The longest line that is looked at; the longest of a good file has less than a thousand octets.
const LONGEST: usize = 16_384;
/// What may stand before the first line of a text in UTF-8.
const BYTE_ORDER_MARK: &[u8] = "\u{FEFF}".as_bytes();

/// Reads lines into one buffer, however long the file is.
#[derive(Debug)]
pub(crate) struct Lines<R> {
    source: R,
    buffer: Vec<u8>,
    number: u64,
    complete: bool,
}

/// A line that is too long to be one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TooLong;

impl<R: BufRead> Lines<R> {
    pub(crate) const fn new(source: R) -> Self {
        Self { source, buffer: Vec::new(), number: 0, complete: true }
    }

    /// The number of the line that was read last, from 1 on.
    pub(crate) const fn number(&self) -> u64 {
        self.number
    }

    /// Whether the line that was read last had its end.
    pub(crate) const fn is_complete(&self) -> bool {
        self.complete
    }

    /// Reads the next line; `false` at the end of the file.
    pub(crate) fn advance(&mut self) -> io::Result<Result<bool, TooLong>> {
        self.buffer.clear();
        let mut dropped = false;
        loop {
            let available = match self.source.fill_buf() {
                Ok(available) => available,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(error),
            };
            if available.is_empty() {
                self.complete = false;
                break;
            }
            let end = available.iter().position(|octet| *octet == b'\n');
            let taken = available.get(..end.unwrap_or(available.len())).unwrap_or_default();
            let used = taken.len() + usize::from(end.is_some());
            if self.buffer.len() + taken.len() > LONGEST {
                dropped = true;
                self.buffer.clear();
            } else if !dropped {
                self.buffer.extend_from_slice(taken);
            }
            self.source.consume(used);
            if end.is_some() {
                self.complete = true;
                break;
            }
        }
        if !self.complete && self.buffer.is_empty() && !dropped {
            return Ok(Ok(false));
        }
        self.number += 1;
        Ok(if dropped { Err(TooLong) } else { Ok(true) })
    }

    /// The line that was read last, without blanks around it.
    pub(crate) fn line(&self) -> &[u8] {
        let line = match self.number {
            // Editors of Windows put it there, and it is no part of the text.
            1 => self.buffer.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&self.buffer),
            _ => &self.buffer,
        };
        line.trim_ascii()
    }
}

/// The words of a line.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

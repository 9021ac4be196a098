//! What a peer has yet to read: whole lines, a bounded number of them.

use std::collections::VecDeque;
use std::io::{self, Write};

use super::line::Line;

/// Lines kept for one peer; at most 31 octets each, so below 64 KiB.
const LINES: usize = 2048;

/// Lines on their way to one peer. When it reads too slowly, the oldest are lost, always whole.
#[derive(Debug, Default)]
pub(crate) struct Output {
    lines: VecDeque<Line>,
    /// How much of the first line has been written.
    written: usize,
    /// The socket takes nothing until it says so.
    blocked: bool,
    frames_lost: u64,
}

impl Output {
    /// Appends a line and drops the oldest one where there are too many.
    pub(crate) fn push(&mut self, line: Line) {
        if self.lines.len() >= LINES {
            // A line of which a part is out must be finished, or the peer reads nonsense.
            let oldest = self.lines.remove(usize::from(self.written > 0));
            let is_frame = oldest.is_some_and(|line| {
                matches!(line.as_octets().first(), Some(b't' | b'T' | b'r' | b'R'))
            });
            self.frames_lost += u64::from(is_frame);
        }
        self.lines.push_back(line);
    }

    /// Whether everything has been written.
    pub(crate) fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// How many frames were dropped so far.
    pub(crate) const fn frames_lost(&self) -> u64 {
        self.frames_lost
    }

    /// The socket takes octets again.
    pub(crate) fn unblock(&mut self) {
        self.blocked = false;
    }

    /// Writes as much as the socket takes without waiting.
    ///
    /// # Errors
    /// What the socket said, when the connection is gone.
    pub(crate) fn flush(&mut self, socket: &mut impl Write) -> io::Result<()> {
        while !self.blocked && !self.lines.is_empty() {
            let mut buffer = [0; 4096];
            let length = self.gather(&mut buffer);
            match socket.write(buffer.get(..length).unwrap_or_default()) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(count) => self.consume(count),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.blocked = true,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Copies what comes next into `buffer`, so that many lines need one system call.
    fn gather(&self, buffer: &mut [u8]) -> usize {
        let mut length = 0;
        let mut skip = self.written;
        for line in &self.lines {
            let rest = line.as_octets().get(skip..).unwrap_or_default();
            skip = 0;
            let Some(place) = buffer.get_mut(length..length + rest.len()) else { break };
            place.copy_from_slice(rest);
            length += rest.len();
        }
        length
    }

    fn consume(&mut self, count: usize) {
        self.written += count;
        while let Some(line) = self.lines.front() {
            let length = line.as_octets().len();
            if self.written < length {
                return;
            }
            self.written -= length;
            self.lines.pop_front();
        }
        self.written = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_station::can::Frame;

    /// A socket that takes a few octets and then no more.
    struct Narrow {
        room: usize,
        taken: Vec<u8>,
    }

    impl Write for Narrow {
        fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
            let count = octets.len().min(self.room).min(7);
            if count == 0 {
                return Err(io::ErrorKind::WouldBlock.into());
            }
            self.room -= count;
            self.taken.extend_from_slice(&octets[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn numbered(number: usize) -> Line {
        Line::frame(&Frame::standard(1, &(number as u16).to_be_bytes()), None)
    }

    #[test]
    fn a_peer_that_does_not_read_loses_the_oldest_whole_lines() {
        let mut output = Output::default();
        let mut socket = Narrow { room: 5, taken: Vec::new() };
        output.push(numbered(0));
        output.flush(&mut socket).unwrap();
        for number in 1..3000 {
            output.push(numbered(number));
        }
        assert_eq!(output.frames_lost(), 3000 - LINES as u64);
        socket.room = usize::MAX;
        output.unblock();
        output.flush(&mut socket).unwrap();
        let first = 3000 - LINES + 1;
        let mut expected = numbered(0).as_octets().to_vec();
        for number in first..3000 {
            expected.extend_from_slice(numbered(number).as_octets());
        }
        assert_eq!(socket.taken, expected);
        assert!(output.is_empty());
    }
}

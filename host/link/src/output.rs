//! What a peer has yet to read: whole portions, a bounded number of them.

use std::collections::VecDeque;
use std::io::{self, Write};

/// Portions kept for one peer.
const PORTIONS: usize = 2048;

/// Octets kept for one peer. SLCAN lines have at most 31 each, so 2048 of them are less.
const OCTETS: usize = 64 * 1024;

/// What leaves whole or not at all.
pub(crate) trait Portion {
    /// What is written to the peer, at most 4096 octets.
    fn as_octets(&self) -> &[u8];

    /// What the peer misses when this is dropped, in the unit in which people hear of it.
    fn loss(&self) -> u64;
}

/// Portions on their way to one peer. When it reads too slowly, the oldest are lost, always whole.
#[derive(Debug)]
pub(crate) struct Output<P> {
    portions: VecDeque<P>,
    /// The octets of all portions.
    octets: usize,
    /// How much of the first portion has been written.
    written: usize,
    /// The socket takes nothing until it says so.
    blocked: bool,
    lost: u64,
}

impl<P> Default for Output<P> {
    fn default() -> Self {
        Self { portions: VecDeque::new(), octets: 0, written: 0, blocked: false, lost: 0 }
    }
}

impl<P: Portion> Output<P> {
    /// Appends a portion and drops the oldest ones where there are too many. Gives whether the peer
    /// has lost something by that for the first time.
    pub(crate) fn push(&mut self, portion: P) -> bool {
        let lost = self.lost;
        self.octets += portion.as_octets().len();
        self.portions.push_back(portion);
        while self.portions.len() > PORTIONS || self.octets > OCTETS {
            // A portion of which a part is out must be finished, or the peer reads nonsense.
            let Some(oldest) = self.portions.remove(usize::from(self.written > 0)) else { break };
            self.octets -= oldest.as_octets().len();
            self.lost += oldest.loss();
        }
        lost == 0 && self.lost > 0
    }

    /// Whether everything has been written.
    pub(crate) fn is_empty(&self) -> bool {
        self.portions.is_empty()
    }

    /// What was dropped so far.
    pub(crate) const fn lost(&self) -> u64 {
        self.lost
    }

    /// Forgets everything, also what is written in part, and counts it as lost. The other side has
    /// forgotten what it had not read.
    #[cfg(unix)]
    pub(crate) fn clear(&mut self) {
        self.lost += self.portions.drain(..).map(|portion| portion.loss()).sum::<u64>();
        (self.octets, self.written, self.blocked) = (0, 0, false);
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
        while !self.blocked && !self.portions.is_empty() {
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

    /// Copies what comes next into `buffer`, so that many portions need one system call.
    fn gather(&self, buffer: &mut [u8]) -> usize {
        let mut length = 0;
        let mut skip = self.written;
        for portion in &self.portions {
            let rest = portion.as_octets().get(skip..).unwrap_or_default();
            skip = 0;
            let Some(place) = buffer.get_mut(length..length + rest.len()) else { break };
            place.copy_from_slice(rest);
            length += rest.len();
        }
        length
    }

    fn consume(&mut self, count: usize) {
        self.written += count;
        while let Some(portion) = self.portions.front() {
            let length = portion.as_octets().len();
            if self.written < length {
                return;
            }
            self.written -= length;
            self.octets -= length;
            self.portions.pop_front();
        }
        self.written = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slcan::Line;
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
        assert_eq!(output.lost(), 3000 - PORTIONS as u64);
        socket.room = usize::MAX;
        output.unblock();
        output.flush(&mut socket).unwrap();
        let first = 3000 - PORTIONS + 1;
        let mut expected = numbered(0).as_octets().to_vec();
        for number in first..3000 {
            expected.extend_from_slice(numbered(number).as_octets());
        }
        assert_eq!(socket.taken, expected);
        assert!(output.is_empty());
    }

    #[cfg(unix)]
    #[test]
    fn what_was_cleared_is_never_written_not_even_its_end() {
        let mut output = Output::default();
        let mut socket = Narrow { room: 5, taken: Vec::new() };
        output.push(numbered(0));
        output.push(numbered(1));
        output.flush(&mut socket).unwrap();
        output.clear();
        assert_eq!(output.lost(), 2);
        socket.room = usize::MAX;
        output.push(numbered(2));
        output.flush(&mut socket).unwrap();
        assert_eq!(&socket.taken[5..], numbered(2).as_octets());
    }

    /// As long as a piece of a line can be.
    struct Long;

    impl Portion for Long {
        fn as_octets(&self) -> &[u8] {
            &[0x16; 512]
        }

        fn loss(&self) -> u64 {
            512
        }
    }

    #[test]
    fn long_portions_are_bounded_by_their_octets_and_the_first_loss_is_told_once() {
        let mut output = Output::default();
        let told: Vec<_> = (0..1000).filter(|_| output.push(Long)).collect();
        assert_eq!(told, [OCTETS / 512]);
        assert_eq!(output.lost(), (1000 * 512 - OCTETS) as u64);
        let mut socket = Narrow { room: usize::MAX, taken: Vec::new() };
        output.flush(&mut socket).unwrap();
        assert_eq!(socket.taken.len(), OCTETS);
        // What has been written makes room.
        assert!((0..OCTETS / 512).all(|_| !output.push(Long)));
        assert_eq!(output.lost(), (1000 * 512 - OCTETS) as u64);
    }
}

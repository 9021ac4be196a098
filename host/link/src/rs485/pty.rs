//! `rs485-listen:pty:PATH`: a serial port made of software, at which a program finds the line.

use std::collections::VecDeque;
use std::path::Path;

use codewheel_station::rs485::Transmission;

use super::port::Rs485Received;
use super::stream::{Line, STREAM, StreamPort};
use crate::LinkError;
use crate::pty::Pty;
use crate::socket::Watch;

/// Makes a pty and puts its name at `path`.
pub(super) fn listen(path: &Path) -> Result<StreamPort<Pty>, LinkError> {
    let watch = Watch::new()?;
    let pty = Pty::make(path, &watch, STREAM)?;
    Ok(StreamPort::new(pty, watch, Vec::new()))
}

impl Line for Pty {
    fn hear(&mut self, octets: &[u8], inbox: &mut VecDeque<Rs485Received>) {
        self.forget_stale();
        inbox.push_back(Rs485Received::Octets(octets.to_vec()));
    }

    fn make_room(&mut self, transmission: &Transmission) -> bool {
        self.make_room(transmission.octets().len())
    }

    fn describe(&self) -> String {
        format!("rs485-listen:pty:{}", self.path().display())
    }
}

//! Inputs and outputs, and what Global_Control does with them.

use codewheel_station::Instant;

use crate::{Application, Lengths};

/// Bits of the first octet of Global_Control.
mod command {
    pub(super) const CLEAR: u8 = 0x02;
    pub(super) const UNFREEZE: u8 = 0x04;
    pub(super) const FREEZE: u8 = 0x08;
    pub(super) const UNSYNC: u8 = 0x10;
    pub(super) const SYNC: u8 = 0x20;
}

/// The process data of a slave, at most `N` octets each way.
#[derive(Clone, Debug)]
pub(crate) struct ProcessData<const N: usize> {
    lengths: Lengths,
    /// Outputs wait in `held` for the next Sync.
    pub(crate) sync: bool,
    /// Inputs stay as they were latched in `frozen`.
    pub(crate) freeze: bool,
    /// Outputs came since they were last set to 0 by the slave itself.
    received: bool,
    /// What the device was given last.
    outputs: [u8; N],
    held: [u8; N],
    frozen: [u8; N],
}

impl<const N: usize> ProcessData<N> {
    pub(crate) const fn new() -> Self {
        Self {
            lengths: Lengths { inputs: 0, outputs: 0 },
            sync: false,
            freeze: false,
            received: false,
            outputs: [0; N],
            held: [0; N],
            frozen: [0; N],
        }
    }

    /// Whether so many octets have room.
    pub(crate) fn fits(lengths: Lengths) -> bool {
        usize::from(lengths.inputs.max(lengths.outputs)) <= N
    }

    /// Outputs 0, Sync and Freeze off, and from now on so many octets.
    pub(crate) fn begin(&mut self, lengths: Lengths) {
        *self = Self { lengths, ..Self::new() };
    }

    /// Outputs 0, Sync and Freeze off.
    pub(crate) fn reset(&mut self) {
        self.begin(self.lengths);
    }

    pub(crate) const fn lengths(&self) -> Lengths {
        self.lengths
    }

    /// Takes the outputs of a Data_Exchange; `octets` are as many as the configuration says.
    #[inline]
    pub(crate) fn receive<A: Application>(&mut self, now: Instant, octets: &[u8], app: &mut A) {
        if octets.is_empty() {
            return;
        }
        self.received = true;
        if self.sync {
            store(&mut self.held, octets);
        } else {
            store(&mut self.outputs, octets);
            app.outputs(now, octets);
        }
    }

    /// Global_Control for a group of this slave. Whether Sync and Freeze may be commanded was
    /// settled by Set_Prm. Clear comes first. Unsync and Unfreeze win over Sync and Freeze in the
    /// same telegram, which are then not looked at (EN 50170-2: both bits set switch it off).
    pub(crate) fn control<A: Application>(
        &mut self,
        now: Instant,
        commands: u8,
        may: (bool, bool),
        app: &mut A,
    ) {
        let has = |bit| commands & bit != 0;
        let (may_sync, may_freeze) = may;
        if has(command::CLEAR) {
            self.clear(now, app);
        }
        if has(command::UNSYNC) {
            if self.sync {
                self.transfer(now, app);
                self.sync = false;
            }
        } else if has(command::SYNC) && may_sync {
            // Before the first Sync outputs were transferred as they came.
            if self.sync {
                self.transfer(now, app);
            } else {
                self.held = self.outputs;
                self.sync = true;
            }
        }
        if has(command::UNFREEZE) {
            self.freeze = false;
        } else if has(command::FREEZE) && may_freeze {
            self.freeze = false;
            let mut latched = [0; N];
            if let Some(room) = latched.get_mut(..usize::from(self.lengths.inputs)) {
                app.inputs(now, room);
            }
            self.frozen = latched;
            self.freeze = true;
        }
    }

    /// All outputs are 0, those that wait for a Sync as well.
    pub(crate) fn clear<A: Application>(&mut self, now: Instant, app: &mut A) {
        self.outputs = [0; N];
        self.held = [0; N];
        app.clear(now);
    }

    fn transfer<A: Application>(&mut self, now: Instant, app: &mut A) {
        self.outputs = self.held;
        let octets = self.outputs();
        // Zeros that no master sent are not told.
        if self.received && !octets.is_empty() {
            app.outputs(now, octets);
        }
    }

    /// The outputs that the device was given last.
    pub(crate) fn outputs(&self) -> &[u8] {
        self.outputs.get(..usize::from(self.lengths.outputs)).unwrap_or_default()
    }

    /// Writes today's inputs, or the latched ones, and says how many octets they are.
    #[inline]
    pub(crate) fn inputs<A: Application>(
        &self,
        now: Instant,
        room: &mut [u8],
        app: &mut A,
    ) -> usize {
        let length = usize::from(self.lengths.inputs);
        let Some(room) = room.get_mut(..length) else { return 0 };
        if !self.freeze {
            app.inputs(now, room);
        } else if let Some(latched) = self.frozen.get(..length) {
            room.copy_from_slice(latched);
        }
        length
    }
}

/// Most configurations fill the room, and a known length needs no call.
#[inline]
fn store<const N: usize>(room: &mut [u8; N], octets: &[u8]) {
    if let Ok(all) = octets.try_into() {
        *room = all;
    } else if let Some(room) = room.get_mut(..octets.len()) {
        room.copy_from_slice(octets);
    }
}

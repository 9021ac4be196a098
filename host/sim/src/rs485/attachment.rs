//! How a station is attached to the line.

/// How a station is attached to the line. The default is a firmware station in the middle of it: no
/// terminating resistor, exact bit times, each character at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Attachment {
    /// Whether its terminating resistors are on.
    pub terminated: bool,
    /// Whether it hears itself, as behind an adapter whose receiver stays on while it sends.
    pub echo: bool,
    /// Whether it keeps time in whole microseconds. The rules then grant it 2 µs, which at 12M are
    /// 24 bits.
    pub microsecond_clock: bool,
    /// In what portions it hears.
    pub hearing: Hearing,
}

/// In what portions a station hears.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hearing {
    /// Each character at its end.
    #[default]
    Characters,
    /// Of each telegram the first character at its end, and all others at the end of the last one.
    /// This costs a fraction of the time, and is the same to a station that does not look at how
    /// far a telegram has come: the first character is what makes it hold its tongue.
    ///
    /// Where a telegram is disturbed, each character from the broken one on comes by itself, and those
    /// before it that were not handed over never come.
    Telegrams,
}

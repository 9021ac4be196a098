//! How far something long is, on a terminal.

use std::time::Duration;

use codewheel_commission::Progress;
use indicatif::{ProgressBar, ProgressStyle};

use crate::arguments::Chatter;

/// A bar on stderr, where that is a terminal and people want to hear; gone when dropped.
#[derive(Debug)]
pub(super) struct Bar(ProgressBar);

impl Bar {
    pub(super) fn new(chatter: Chatter) -> Self {
        if chatter == Chatter::Quiet {
            return Self(ProgressBar::hidden());
        }
        let bar = ProgressBar::new(100);
        if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }

    pub(super) fn show(&self, progress: Progress) {
        self.0.set_position(u64::from(progress.percent));
        self.0.set_message(progress.doing);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

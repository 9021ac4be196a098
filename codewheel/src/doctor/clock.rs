//! How exactly this machine waits.

use std::thread;
use std::time::{Duration, Instant};

use super::finding::{Finding, Times};

const WAIT: Duration = Duration::from_millis(1);
const WAITS: usize = 300;
/// A wait that ends later than this delays whatever falls due: heartbeats, cyclic productions,
/// samples of a turning shaft.
const TOO_LATE: Duration = Duration::from_millis(2);

/// How late waits of a millisecond end.
pub(super) fn waits() -> Finding {
    let late = || {
        let begun = Instant::now();
        thread::sleep(WAIT);
        begun.elapsed().saturating_sub(WAIT)
    };
    match Times::of((0..WAITS).map(|_| late()).collect()) {
        Some(times) => judged(&times),
        None => Finding::cannot("timer", "there is no clock"),
    }
}

fn judged(times: &Times) -> Finding {
    let says = format!("waits of 1 ms end late: {times}");
    let finding = if times.most > TOO_LATE {
        Finding::trouble("timer", says).remedy(
            "cyclic productions and samples come as late as that: stop what keeps the machine \
             busy, switch its power saving off, and do not use a virtual machine without need",
        )
    } else {
        Finding::fine("timer", says)
    };
    finding.values(times.values())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::finding::State;

    #[test]
    fn a_machine_that_waits_too_long_is_a_finding_with_a_remedy() {
        let times = |late| Times::of(vec![Duration::from_micros(late); 100]).unwrap();
        assert_eq!(judged(&times(60)).state, State::Fine);
        let finding = judged(&times(15_000));
        assert_eq!(finding.state, State::Finding);
        assert!(finding.remedy.is_some());
    }
}

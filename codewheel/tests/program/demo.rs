//! `codewheel` alone.

use std::collections::BTreeMap;

use crate::prompt::Running;

#[test]
fn without_a_terminal_there_is_a_line_for_each_encoder_and_second_and_positions_move() {
    let mut demo = Running::start(&["--quiet"]);
    let mut positions: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for _ in 0..30 {
        let line = demo.line();
        let words: Vec<_> = line.split(' ').collect();
        let after = |name| {
            let place = words.iter().position(|word| *word == name).expect("the word");
            words[place + 1].to_owned()
        };
        positions.entry(after("address")).or_default().push(after("position"));
    }
    assert_eq!(positions.keys().collect::<Vec<_>>(), ["11", "12", "23", "3", "5", "7"]);
    for (address, seen) in positions {
        assert!((4..=6).contains(&seen.len()), "two threads: {}", seen.len());
        assert!(seen.windows(2).all(|pair| pair[0] != pair[1]), "{address} stands still: {seen:?}");
    }
    for _ in 0..6 {
        let line = demo.line();
        let is_field = line.contains("bus field ");
        let connection = if is_field { "connection data-exch" } else { "connection polled" };
        assert!(line.contains(connection), "{line}");
        assert!(line.contains("led green "), "{line}");
    }
}

#[cfg(unix)]
#[test]
fn sigint_and_sigterm_end_the_demo_with_exit_status_0() {
    for signal in [rustix::process::Signal::INT, rustix::process::Signal::TERM] {
        let mut demo = Running::start(&[]);
        demo.line();
        demo.signal(signal);
        let (status, _) = demo.end();
        assert_eq!(status.code(), Some(0));
    }
}

use codewheel_sim::rs485::longest_cable;

use super::*;

fn terminated() -> Attachment {
    Attachment { terminated: true, ..Attachment::default() }
}

#[test]
fn a_wire_without_exactly_two_terminations_says_so() {
    let mut wire = Wire::new(1);
    assert_eq!(wire.warnings(), ["the wire has no termination; it needs two, one at each end"]);
    wire.attach("a", listener(), terminated());
    assert_eq!(
        wire.warnings(),
        ["the wire has only one termination, at a; it needs two, one at each end"]
    );
    let b = wire.attach("b", listener(), terminated());
    assert!(wire.warnings().is_empty());
    wire.attach("c", listener(), terminated());
    assert_eq!(
        wire.warnings(),
        ["the wire has 3 terminations, at a, b, c; it needs two, one at each end"]
    );
    wire.set_terminated(b, false);
    assert!(wire.warnings().is_empty());
}

#[test]
fn each_rate_has_the_longest_cable_of_the_manual() {
    let metres = BaudRate::ALL.map(longest_cable);
    // Chapter 10; 45.45k and 6M are not in its table.
    assert_eq!(metres, [1_200, 1_200, 1_200, 1_200, 1_000, 400, 200, 100, 100, 100]);
}

#[test]
fn a_cable_too_long_for_the_rate_that_is_spoken_is_told() {
    let mut wire = Wire::new(1);
    wire.attach("a", saying(micros(10), "E5"), terminated());
    wire.attach("b", listener(), terminated());
    wire.set_cable_length(201);
    assert!(wire.warnings().is_empty(), "nobody has spoken");
    events(&mut wire, millis(1));
    assert_eq!(wire.warnings(), ["the cable is 201 m long; at 1.5M it may have at most 200 m"]);
    wire.set_cable_length(200);
    assert!(wire.warnings().is_empty());
}

use codewheel_sim::{Drops, Either, Troubled};

use super::*;

type Station = Either<Troubled<Script>, Script>;

/// Station 7 with some trouble answers ten requests with its delay of 20 bits.
fn ten_answers(trouble: impl FnOnce(&mut Troubled<Script>)) -> (Vec<Event>, usize) {
    let (mut slave, mut master) = (listener(), listener());
    for poll in 0..10 {
        let at = micros(500 * poll);
        master.send(at, telegram(ASK_7));
        slave.send(bits_after(at, 66 + 20), telegram(ANSWER_OF_7));
    }
    let mut slave = Troubled::new(slave, 1);
    trouble(&mut slave);
    let mut wire: Wire<Station> = Wire::new(1);
    wire.attach("slave", Either::Left(slave), Attachment::default());
    let master = wire.attach("master", Either::Right(master), Attachment::default());
    let events = events(&mut wire, millis(6));
    (events, wire.node(master).unwrap().right().unwrap().octets().len() / 6)
}

#[test]
fn without_trouble_a_station_is_what_it_is() {
    let (events, answers) = ten_answers(|_| {});
    assert_eq!((answers, violations(&events)), (10, vec![]));
}

#[test]
fn dropped_answers_never_come() {
    let (events, answers) =
        ten_answers(|slave| slave.set_drops(Some(Drops { probability: 1.0, count: Some(4) })));
    assert_eq!((answers, violations(&events)), (6, vec![]));
}

#[test]
fn a_late_answer_is_named() {
    let (events, answers) = ten_answers(|slave| slave.set_delay(RATE.bits(131)));
    assert_eq!(answers, 10);
    assert_eq!(
        violations(&events),
        ["slave answers 151 bits after the request: max T_SDR is 150 at 1.5M"; 10]
    );
    let (events, _) = ten_answers(|slave| slave.set_delay(RATE.bits(130)));
    assert!(violations(&events).is_empty());
}

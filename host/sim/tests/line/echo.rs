use super::*;

fn echoing() -> Attachment {
    Attachment { echo: true, ..Attachment::default() }
}

#[test]
fn behind_an_adapter_with_echo_a_station_hears_itself_at_the_same_moments_as_the_others() {
    let mut wire = Wire::new(1);
    let sender = wire.attach("sender", saying(micros(0), ASK_7), echoing());
    let other = wire.attach("other", listener(), Attachment::default());
    events(&mut wire, millis(1));
    let heard = wire.node(other).unwrap().heard();
    assert_eq!(heard.len(), 6);
    assert_eq!(wire.node(sender).unwrap().heard(), heard);
}

#[test]
fn an_echo_shows_a_collision() {
    let mut wire = Wire::new(1);
    let sender = wire.attach("sender", saying(micros(0), ASK_7), echoing());
    wire.attach("other", saying(bits_after(micros(0), 25), "E5"), Attachment::default());
    events(&mut wire, millis(1));
    let heard: Vec<bool> = wire
        .node(sender)
        .unwrap()
        .heard()
        .iter()
        .map(|(_, heard)| *heard == Heard::Broken)
        .collect();
    // The other speaks from bit 25 to bit 36, in characters 3 and 4.
    assert_eq!(heard, [false, false, true, true, false, false]);
}

use codewheel_encoder::Sensor;
use codewheel_sim::shaft::{Faulty, Shaft};

use super::*;

fn faulty(text: &str) -> Faulty<Shaft> {
    let shaft = Shaft::parse(text, 8192, 1).unwrap();
    let codes = shaft.codes();
    Faulty::new(shaft, codes)
}

#[test]
fn a_stuck_sensor_holds_its_last_code_until_it_is_let_go() {
    let mut sensor = faulty("turn rpm=60");
    assert_eq!(sensor.sample(millis(250)).code, 2048);
    sensor.set_stuck(true);
    assert_eq!(sensor.sample(millis(500)).code, 2048);
    sensor.set_stuck(false);
    assert_eq!(sensor.sample(millis(750)).code, 6144);
}

#[test]
fn a_jump_wraps_and_stays() {
    let mut sensor = faulty("still angle=100");
    sensor.jump(-200);
    assert_eq!(sensor.sample(millis(0)).code, 8092);
    sensor.jump(8192 + 300);
    assert_eq!(sensor.sample(millis(1)).code, 200);
    sensor.jump(i32::MIN);
    assert_eq!(sensor.sample(millis(1)).code, 200, "2³¹ is a multiple of 8192");
}

#[test]
fn a_change_at_rest_asks_for_a_sample_once() {
    let mut sensor = faulty("still");
    assert_eq!(sensor.changes_at(millis(1)), None);
    sensor.set_cell_low(true);
    assert_eq!(sensor.changes_at(millis(1)), Some(millis(1)));
    assert!(sensor.sample(millis(1)).cell_low);
    assert_eq!(sensor.changes_at(millis(1)), None);
    *sensor.sensor_mut() = Shaft::parse("still angle=90deg", 8192, 1).unwrap();
    assert_eq!(sensor.changes_at(millis(2)), Some(millis(2)));
    assert_eq!(sensor.sample(millis(2)).code, 2048);
    assert_eq!(sensor.sensor().codes(), 8192);
}

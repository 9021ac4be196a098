//! Deadlines against brute force, and the adapted profirust against the plain one.

use codewheel_station::Duration;
use codewheel_station::rs485::{BaudRate, Node};

use crate::bench::{Bench, Sent};
use crate::plain::Plain;
use crate::scripted::Scripted;

const MICROSECOND: Duration = Duration::from_micros(1);

/// One that answers, one that is slow, one that is absent; the first loses some answers.
fn slaves() -> Vec<Scripted> {
    let mut slaves = vec![Scripted::new(7), Scripted::new(8), Scripted::new(9)];
    slaves[1].delay_bits = 58;
    slaves[1].extended = vec![0x0A, 0, 1, 2, 3, 4, 5, 6, 7, 8];
    slaves[2].present = false;
    slaves
}

/// So many telegrams, with an answer lost on the way.
fn telegrams<M: Node>(bench: &mut Bench<M>, count: usize) -> Vec<Sent> {
    while bench.slaves[0].requests.len() < 12 {
        bench.run_bits(10);
    }
    bench.slaves[0].lose = 1;
    while bench.log.len() < count {
        bench.run_bits(100);
    }
    bench.log[..count].to_vec()
}

/// The telegrams but Global_Control, which comes a cycle earlier or later where rounding adds up,
/// each with the pause before it.
fn with_pauses(rate: BaudRate, log: &[Sent]) -> Vec<(&Sent, Duration)> {
    log.windows(2)
        .filter(|pair| pair[1].octets.get(7) != Some(&0x3A))
        .map(|pair| {
            let length = u32::try_from(pair[0].octets.len()).unwrap();
            (&pair[1], pair[1].at.since(pair[0].at + rate.characters(length)))
        })
        .collect()
}

/// The same telegrams of the same stations, and between the end of each and the next the same
/// pause, give or take `allowed`.
fn compare(rate: BaudRate, one: &[Sent], other: &[Sent], allowed: Duration) {
    let (one, other) = (with_pauses(rate, one), with_pauses(rate, other));
    assert!(one.len() > 120 && other.len() > 120);
    for (place, ((one, a), (other, b))) in one.into_iter().zip(other).enumerate() {
        assert_eq!(one.hex(), other.hex(), "telegram {place} at {rate}");
        assert_eq!(one.who, other.who);
        let apart = a.as_nanos().abs_diff(b.as_nanos());
        assert!(apart <= allowed.as_nanos(), "{} after {a} and {b} at {rate}", one.hex());
    }
}

#[test]
fn deadlines_miss_nothing_that_asking_ten_times_a_bit_finds() {
    for rate in [BaudRate::Kbit187_5, BaudRate::Kbit500, BaudRate::Mbit1_5, BaudRate::Mbit12] {
        let mut deadlines = Bench::new(rate, slaves());
        let mut stepped = Bench::new(rate, slaves());
        let step = Duration::from_nanos(rate.bits(1).as_nanos() / 10);
        stepped.step = Some(step);
        let one = telegrams(&mut deadlines, 150);
        compare(rate, &one, &telegrams(&mut stepped, 150), step);
    }
}

#[test]
fn the_wire_sees_the_same_telegrams_as_from_profirust_polled_each_microsecond() {
    for rate in BaudRate::ALL {
        let mut adapted = Bench::new(rate, slaves());
        let mut plain = Bench::of(rate, vec![Plain::new(rate, &[7, 8, 9])], slaves());
        plain.step = Some(MICROSECOND);
        // What profirust leaves at 12 Mbit/s on its own.
        plain.idle_bits = if rate < BaudRate::Mbit6 { 32 } else { 24 };
        let one = telegrams(&mut adapted, 150);
        // Or a sixteenth of a bit, where that is longer: the clock of the one has 32 ticks a bit.
        let sixteenth = Duration::from_nanos(rate.bits(1).as_nanos() / 16);
        let allowed = sixteenth.max(Duration::from_micros(2));
        compare(rate, &one, &telegrams(&mut plain, 150), allowed);
    }
}

#[test]
fn a_cycle_needs_few_questions() {
    let mut bench = Bench::new(BaudRate::Mbit1_5, (7..10).map(Scripted::new).collect());
    bench.bring_up();
    let (asked, cycles) = (bench.asked, bench.master().cycle_times().count);
    bench.run(Duration::from_millis(100));
    let cycles = bench.master().cycle_times().count - cycles;
    // A request to each of three slaves, the token, the GAP and what its silence costs; with
    // Global_Control now and then.
    let asked = bench.asked - asked;
    assert!(asked <= cycles * 7, "{asked} in {cycles} cycles");
}

//! How fast a segment goes round.

use codewheel_commission::profibus::{CycleTimes, MasterSettings, shortest_slot};
use codewheel_device::Product;
use codewheel_profibus::Baud;
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::segment::{MASTER, Segment, Wanted, encoder, some_cycles};

/// The cycle of `count` encoders with four octets each way, all of them in data exchange.
fn cycle(rate: BaudRate, count: u8) -> CycleTimes {
    let mut segment = Segment::new();
    let product = Product::find("amg11-p29").expect("in the catalogue");
    let addresses = 10..10 + count;
    let now = segment.wire.now();
    for address in addresses.clone() {
        let encoder = encoder(now, product, address, "still", Baud::Fixed(rate));
        segment.attach_encoder(address, encoder);
    }
    let mut settings = MasterSettings::new(MASTER, rate);
    settings.highest_station_address = MASTER + 2;
    settings.token_rotation_bits = Some(100_000);
    settings.watchdog = None;
    let (steps_per_turn, total_resolution) = (8_192, 1 << 29);
    let all: Vec<_> = addresses
        .map(|address| Wanted {
            address,
            class_2: true,
            configuration: 0xF1,
            steps_per_turn,
            total_resolution,
        })
        .collect();
    segment.attach_master(settings, &all);
    let step = some_cycles(rate);
    assert!(segment.run_till(Duration::from_secs(200), step, |segment| segment.all_exchange(2)));
    // The cycles of the bring-up are longer, so they do not count.
    let before = segment.master().cycle_times();
    segment.run(formula_time(rate, count).times(20));
    segment.expect_peace();
    let after = segment.master().cycle_times();
    assert!(after.count > before.count + 10);
    CycleTimes {
        count: after.count - before.count,
        total: Duration::from_nanos(after.total.as_nanos() - before.total.as_nanos()),
        ..after
    }
}

/// n·(33 + 143 + T_SDR + 143), the token, one address of the GAP asked, in bits. A token after an
/// unanswered GAP request needs no pause of its own, so it is 33 bits rather than 33 + 66.
fn formula(count: u8, slot: u16) -> u32 {
    u32::from(count) * (33 + 143 + 11 + 143) + 33 + (33 + 66 + u32::from(slot))
}

fn formula_time(rate: BaudRate, count: u8) -> Duration {
    rate.bits(formula(count, shortest_slot(rate)))
}

#[test]
fn a_full_segment_goes_round_as_fast_as_its_bits_allow_up_to_1_5m() {
    for rate in BaudRate::ALL.into_iter().filter(|rate| *rate <= BaudRate::Mbit1_5) {
        let slot = shortest_slot(rate);
        let expected = formula_time(rate, 32);
        // Global_Control, 33 + 143 bits every 50 slot times, is not in the formula.
        let broadcast = formula(32, slot) * 176 / (50 * u32::from(slot));
        let mean = cycle(rate, 32).mean().as_nanos() - rate.bits(broadcast).as_nanos();
        let difference = mean.abs_diff(expected.as_nanos());
        assert!(difference * 50 <= expected.as_nanos(), "{rate}: {mean} ns, not {expected}");
    }
}

/// PROFIBUS manual §3: "1 ms with 32 users and 12 MBaud".
#[test]
fn thirty_two_encoders_at_12m_are_exchanged_with_in_about_a_millisecond() {
    let times = cycle(BaudRate::Mbit12, 32);
    assert!(times.mean() <= Duration::from_micros(1_040), "{}", times.mean());
}

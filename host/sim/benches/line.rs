//! How much faster than life a full PROFIBUS line runs: virtual seconds per wall second, printed by
//! criterion as elements per second.

#[path = "../tests/line/toys.rs"]
#[allow(unreachable_pub, dead_code, reason = "shared with the tests")]
mod toys;

use std::hint::black_box;

use codewheel_sim::rs485::{Attachment, Hearing, Wire};
use codewheel_station::rs485::BaudRate;
use codewheel_station::{Duration, Instant};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use toys::Toy;

const SLAVES: u8 = 32;

fn line(rate: BaudRate, hearing: Hearing) -> Wire<Toy> {
    let mut wire = Wire::new(1);
    wire.attach("master", Toy::master(rate, SLAVES, 37, 100), Attachment::default());
    for address in 3..3 + SLAVES {
        let attachment = Attachment { hearing, ..Attachment::default() };
        wire.attach(format!("slave {address}"), Toy::slave(rate, address, 11), attachment);
    }
    wire.run_until(Instant::ZERO + Duration::from_millis(10), &mut |_| {});
    wire
}

fn full_load(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("32 slaves polled without pause");
    group.throughput(Throughput::Elements(1)).sample_size(10);
    for rate in [BaudRate::Mbit1_5, BaudRate::Mbit12] {
        for hearing in [Hearing::Characters, Hearing::Telegrams] {
            group.bench_function(format!("{rate}, slaves hear {hearing:?}"), |bencher| {
                let mut wire = line(rate, hearing);
                bencher.iter(|| {
                    let until = wire.now() + Duration::from_secs(1);
                    wire.run_until(until, &mut |event| {
                        black_box(event);
                    });
                });
                let statistics = wire.statistics();
                assert_eq!(statistics.violations, 0);
                // Of 257 bits of a cycle 48 are silent.
                assert!(statistics.bus_load_since(&Default::default()) > 0.8);
            });
        }
    }
    group.finish();
}

criterion_group!(benches, full_load);
criterion_main!(benches);

//! How much faster than life a full segment runs: virtual seconds per wall second, printed by
//! criterion as elements per second.

use std::hint::black_box;

use codewheel_sim::can::Wire;
use codewheel_station::can::{BitRate, Filter, Frame, Identifier, Input};
use codewheel_station::{Duration, Instant, Station};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const SLAVES: u16 = 63;

/// A scanner that polls the next slave when the last has answered, or a slave that answers; each
/// with something to do every millisecond.
struct Toy {
    mac: u16,
    polls: bool,
    owed: bool,
    position: u32,
    tick: Instant,
}

impl Station for Toy {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _now: Instant, input: Input<'_>) {
        if let Input::Frame(frame) = input {
            self.owed = true;
            if let (true, Identifier::Standard(identifier)) = (self.polls, frame.identifier()) {
                self.mac = ((identifier & 0x3F) + 1) % SLAVES;
            }
        }
    }

    fn advance(&mut self, now: Instant) {
        while self.tick <= now {
            self.position = self.position.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            self.tick += Duration::from_millis(1);
        }
    }

    fn transmit(&mut self, _now: Instant) -> Option<Frame> {
        std::mem::take(&mut self.owed).then(|| match self.polls {
            true => Frame::standard(0x405 | self.mac << 3, &[]),
            false => Frame::standard(0x3C0 | self.mac, &self.position.to_le_bytes()),
        })
    }

    fn deadline(&self) -> Option<Instant> {
        Some(self.tick)
    }
}

fn segment(tick_offset: Duration) -> Wire<Toy> {
    let mut wire = Wire::new(BitRate::Kbit500, 1);
    let mut tick = Instant::ZERO;
    for mac in 0..SLAVES {
        tick += tick_offset;
        let slave = Toy { mac, polls: false, owed: false, position: u32::from(mac), tick };
        let filters = [Filter { mask: 0x7F8, value: 0x400 | mac << 3 }];
        wire.attach(format!("slave {mac}"), slave, &filters, false);
    }
    let scanner = Toy { mac: 0, polls: true, owed: true, position: 0, tick };
    wire.attach("scanner", scanner, &[Filter { mask: 0x400, value: 0 }], false);
    wire
}

fn full_load(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("63 slaves polled without pause at 500k");
    group.throughput(Throughput::Elements(1)).sample_size(20);
    for (name, offset) in [("ticks together", 0), ("ticks apart", 15_873)] {
        group.bench_function(name, |bencher| {
            let mut wire = segment(Duration::from_nanos(offset));
            let mut frames = 0_u64;
            bencher.iter(|| {
                let until = wire.now() + Duration::from_secs(1);
                wire.run_until(until, &mut |event| {
                    black_box(event);
                    frames += 1;
                });
            });
            let statistics = wire.statistics();
            assert_eq!(frames, statistics.frames);
            assert!(statistics.bus_load_since(&Default::default()) > 0.999);
        });
    }
    group.finish();
}

criterion_group!(benches, full_load);
criterion_main!(benches);

//! How long a Data_Exchange with configuration F1h lasts on this machine, in nanoseconds: request in,
//! response out, on a turning shaft.
//!
//! ```text
//! cargo bench -p codewheel-device --bench exchange_time
//! ```

// The macros make public items without documentation.
#![allow(missing_docs)]

#[path = "exchanging/mod.rs"]
mod exchanging;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};

use self::exchanging::Exchanging;

fn data_exchange(criterion: &mut Criterion) {
    let mut exchanging = Exchanging::new();
    criterion.bench_function("data_exchange_f1", |bencher| {
        bencher.iter(|| {
            exchanging.pause();
            black_box(exchanging.exchange(false))
        });
    });
}

criterion_group!(benches, data_exchange);
criterion_main!(benches);

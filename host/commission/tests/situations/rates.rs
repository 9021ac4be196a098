//! All ten rates.

use codewheel_station::rs485::{BaudRate, Node};

use crate::bench::Bench;
use crate::scripted::Scripted;

#[test]
fn slaves_are_brought_up_at_every_rate_with_33_idle_bits_before_every_request() {
    for rate in BaudRate::ALL {
        let mut bench = Bench::new(rate, vec![Scripted::new(7), Scripted::new(8)]);
        assert_eq!(bench.master().baud_rate(), rate);
        // The bench fails where a request leaves less.
        bench.bring_up();
        bench.run_bits(100_000);
        for slave in bench.masters[0].slaves() {
            assert_eq!((slave.repetitions, slave.losses), (0, 0), "{rate}");
            assert!(slave.answers > 30, "{rate}");
        }
        let counters = bench.master().counters();
        assert_eq!((counters.broken, counters.unexpected), (0, 0), "{rate}");
    }
}

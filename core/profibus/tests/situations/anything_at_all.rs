//! Arbitrary octets at arbitrary times: never a panic, always a legal state, always a way back.

use codewheel_profibus::{Baud, Slave, State, Timing};
use codewheel_station::Duration;
use codewheel_station::rs485::{BaudRate, Input};
use proptest::prelude::*;

use crate::bench::{Bench, octets, telegram};

const FDL_STATUS: &str = "10 07 02 49 52 16";

/// Telegrams that mean something, good ones and damaged ones, and noise.
fn any_octets() -> impl Strategy<Value = Vec<u8>> {
    let services = prop::sample::select(vec![0_u8, 55, 56, 57, 58, 59, 60, 61, 62]);
    let parameters = prop::sample::select(vec![
        "B8 01 14 0B 05 9B 03 00",
        "80 00 00 0B 05 9B 03 00",
        "40 00 00 00 00 00 00",
        "B8 01 14 0B 05 9C 03 00",
        "F1",
        "F0",
        "D1",
        "00 00 00 05",
        "22 00",
        "",
    ]);
    let plausible = (
        prop::sample::select(vec![7_u8, 7, 7, 127, 8]),
        prop::sample::select(vec![2_u8, 2, 3]),
        prop::sample::select(vec![0x6D_u8, 0x7D, 0x5D, 0x4D, 0x49, 0x46, 0x08]),
        prop::option::of(services),
        parameters,
    )
        .prop_map(|(destination, source, code, service, data)| {
            let saps = service.map(|service| (service, 62));
            octets(&telegram(destination, source, code, saps, data))
        });
    let damaged = (plausible.clone(), any::<prop::sample::Index>(), 0..8_u32).prop_map(
        |(mut octets, place, bit)| {
            let place = place.index(octets.len());
            octets[place] ^= 1 << bit;
            octets
        },
    );
    prop_oneof![
        4 => plausible,
        1 => damaged,
        1 => prop::collection::vec(any::<u8>(), 0..300),
        1 => Just(octets("DC 02 02")),
        1 => Just(octets("E5")),
    ]
}

#[derive(Clone, Debug)]
enum Happening {
    Octets(Vec<u8>),
    BrokenCharacter,
    Bits(u32),
    Millis(u64),
}

fn happening() -> impl Strategy<Value = Happening> {
    prop_oneof![
        5 => any_octets().prop_map(Happening::Octets),
        1 => Just(Happening::BrokenCharacter),
        3 => prop::sample::select(vec![1_u32, 11, 33, 300]).prop_map(Happening::Bits),
        1 => (0..300_u64).prop_map(Happening::Millis),
    ]
}

fn bauds_and_timings() -> impl Strategy<Value = (Baud, Timing)> {
    let bauds = vec![Baud::Search, Baud::Fixed(BaudRate::Mbit12), Baud::Fixed(BaudRate::Kbit9_6)];
    (prop::sample::select(bauds), prop::sample::select(vec![Timing::Exact, Timing::Coarse]))
}

impl Bench {
    fn suffer(&mut self, happening: &Happening) {
        match happening {
            Happening::Octets(octets) => self.hears_whatever(octets),
            Happening::BrokenCharacter => {
                self.slave.handle(self.now, Input::BrokenCharacter, &mut self.toy);
            }
            Happening::Bits(bits) => {
                self.sends(self.slave.baud_rate().bits(*bits));
            }
            Happening::Millis(millis) => {
                self.sends(Duration::from_millis(*millis));
            }
        }
    }

    fn hears_whatever(&mut self, octets: &[u8]) {
        let span = self.slave.baud_rate().characters(octets.len() as u32);
        self.sends(span);
        self.slave.handle(self.now, Input::Octets(octets), &mut self.toy);
    }
}

fn is_legal(slave: &Slave<4>) -> bool {
    let free = slave.state() == State::WaitPrm;
    let modes = slave.is_in_sync_mode() || slave.is_in_freeze_mode();
    slave.master().is_none() == free
        && !(free && slave.watchdog().is_some())
        && !(modes && slave.state() != State::DataExchange)
        && slave.station_delay() >= 11
        && (!slave.faults().parameters || free)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn whatever_arrives_the_state_stays_legal(
        (baud, timing) in bauds_and_timings(),
        happenings in prop::collection::vec(happening(), 1..60)
    ) {
        let mut bench = Bench::new(baud, timing);
        for happening in &happenings {
            bench.suffer(happening);
            prop_assert!(is_legal(&bench.slave), "{:?}", bench.slave);
        }
    }

    #[test]
    fn on_a_pc_octets_may_come_in_whatever_pieces(
        stream in prop::collection::vec(any_octets(), 1..12),
        cuts in prop::collection::vec(any::<prop::sample::Index>(), 0..12)
    ) {
        let mut whole = Bench::on_a_pc();
        let mut pieces = whole.clone();
        let stream = stream.concat();
        whole.slave.handle(whole.now, Input::Octets(&stream), &mut whole.toy);
        let mut cuts: Vec<_> = cuts.iter().map(|cut| cut.index(stream.len() + 1)).collect();
        cuts.extend([0, stream.len()]);
        cuts.sort_unstable();
        for cut in cuts.windows(2) {
            let piece = &stream[cut[0]..cut[1]];
            pieces.slave.handle(pieces.now, Input::Octets(piece), &mut pieces.toy);
        }
        prop_assert_eq!(whole.slave.counters(), pieces.slave.counters());
        prop_assert_eq!(whole.slave.deadline(), pieces.slave.deadline());
        prop_assert_eq!(&whole.toy.events, &pieces.toy.events);
        prop_assert_eq!(&whole.toy.told, &pieces.toy.told);
        prop_assert_eq!(whole.answer(), pieces.answer());
    }

    #[test]
    fn after_whatever_garbage_a_patient_master_gets_to_data_exchange_again(
        (baud, timing) in bauds_and_timings(),
        happenings in prop::collection::vec(happening(), 0..40)
    ) {
        let mut bench = Bench::new(baud, timing);
        happenings.iter().for_each(|happening| bench.suffer(happening));
        // The longest watchdog that the garbage can have set runs out, or master 2 and 3 let go.
        bench.sends(Duration::from_millis(200));
        bench.hears(FDL_STATUS);
        bench.answer();
        while !bench.slave.has_baud_rate() {
            bench.hears(FDL_STATUS);
            bench.answer();
        }
        for source in [3, 2] {
            bench.hears(&telegram(7, source, 0x4D, Some((61, 62)), "40 00 00 00 05 9B 00"));
            bench.answer();
        }
        prop_assert_eq!(bench.slave.state(), State::WaitPrm);
        let mut bench = bench.then_exchanging();
        bench.asks(2, Some(60), "", &telegram(2, 7, 8, Some((62, 60)), "00 0C 00 02 05 9B 02 00"));
        bench.exchanges("00 00 00 05", "00 00 12 34", &["00 00 00 05"]);
    }
}

use codewheel_commission::profibus::*;
use codewheel_commission::*;
use codewheel_link::*;
use codewheel_station::rs485::BaudRate;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let rate = BaudRate::ALL.into_iter().find(|r| r.to_string() == args[2]).unwrap();
    let join = args.len() > 4;
    let seat = || {
        let uri: BusUri = args[1].parse().unwrap();
        let port = open_rs485(&uri, rate).unwrap();
        Rs485Seat::new(Console::new(rate), port, Rs485Loop::new(Clock::new()))
    };
    let t = std::time::Instant::now();
    {
        let mut s = seat();
        let m = ScanSettings { join, ..ScanSettings::default() };
        println!("{:#?}", scan(&mut s, m, &mut |_| {}));
    }
    println!("scan took {:?}", t.elapsed());
    let address: u8 = args[3].parse().unwrap();
    let settings = SessionSettings {
        master: ScanSettings { join, ..ScanSettings::default() },
        ..SessionSettings::default()
    };
    let t = std::time::Instant::now();
    let mut e = match Encoder::open(seat(), address, &settings, &mut |_| {}) {
        Ok(e) => e,
        Err(e) => {
            println!("{e}");
            let mut ears = Eavesdropper::open(seat(), address, &mut |_| {}).unwrap();
            for _ in 0..3 {
                println!("{:?}", ears.sample());
            }
            return;
        }
    };
    println!("open took {:?}", t.elapsed());
    for v in e.values().unwrap() {
        println!("{} = {:?} {:?}", v.name, v.reading, v.label);
    }
    for _ in 0..3 {
        println!("{:?}", e.sample());
    }
    let t = std::time::Instant::now();
    for (k, v) in
        [("total-resolution", 921600), ("steps-per-turn", 3600), ("steps-per-turn", 90000)]
    {
        match e.write(&Name::Key(k.into()), &Reading::Number(v)) {
            Ok(v) => println!("{} {:?}", v.name, v.reading),
            Err(e) => println!("{e}"),
        }
    }
    println!("writes took {:?}", t.elapsed());
    println!("{:?}", e.preset(1000).map_err(|e| e.to_string()));
    println!("{:?}", e.save().map_err(|e| e.to_string()));
    let t = std::time::Instant::now();
    println!("{:?}", e.release());
    println!("release took {:?}", t.elapsed());
    println!("{:?}", e.take_notices());
}

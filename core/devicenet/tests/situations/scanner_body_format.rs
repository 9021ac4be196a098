//! Slaves that have class and instance in other widths than 8/8 (CIP volume 3, chapter 4).

use codewheel_devicenet::scanner::{Refusal, SlaveSettings, SlaveState};

use crate::scanner_bench::{Bench, Peer, mac, millis, secs};

#[test]
fn requests_are_written_in_the_message_body_format_of_the_slave() {
    for (format, asked) in
        [("00", "0E640102"), ("01", "0E64010002"), ("02", "0E6400010002"), ("03", "0E64000102")]
    {
        let peer = Peer::new(5).answers("4B0301", &format!("CB {format}"));
        let mut bench = Bench::running(peer, SlaveSettings::explicit(mac(5)));
        bench.peer().rule(asked, Some("8E07"));
        let ticket = bench.request("0E640102").unwrap();
        bench.run(millis(10));
        assert_eq!(bench.response(ticket).unwrap(), "07", "format {format}");
        // The unconnected port knows 8/8 alone.
        bench.scanner.remove(mac(5));
        bench.run(millis(10));
        assert_eq!(bench.peer().asked.last().unwrap(), "u4C030101");
    }
}

#[test]
fn requests_of_64_octets_go_out_whole_in_the_widest_format() {
    let mut bench =
        Bench::running(Peer::new(5).answers("4B0301", "CB02"), SlaveSettings::explicit(mac(5)));
    let body = format!("10640107{}", "A5".repeat(60));
    let ticket = bench.request(&body).unwrap();
    bench.run(millis(100));
    assert_eq!(bench.response(ticket).unwrap(), "");
    let wide = format!("10640001 0007{}", "A5".repeat(60)).replace(' ', "");
    assert_eq!(bench.peer().asked.last().unwrap(), &wide);
}

#[test]
fn a_slave_with_another_message_body_format_is_refused_by_its_name_and_asked_nothing() {
    let peer = Peer::new(5).answers("4B0301", "CB04");
    let mut bench = Bench::new(&[peer], &[SlaveSettings::poll(mac(5))]);
    bench.run(secs(3));
    assert_eq!(bench.state(), SlaveState::Refused(Refusal::BodyFormat { format: 4 }));
    assert_eq!(bench.peer().asked, ["u4B03010300", "u4C030102", "u4C030101"]);
}

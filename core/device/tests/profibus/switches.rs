//! The rotary switches (PROFIBUS manual §9.2).

use codewheel_device::Lamp;
use codewheel_device::profibus::Switches;

use crate::bench::{Bench, octets_of};

#[test]
fn turned_switches_act_at_the_next_power_up() {
    let mut bench = Bench::power_up("amg11-p29");
    bench.device.set_switches(Switches::set_to(23));
    assert_eq!(bench.device.switches().address(), 23);
    assert_eq!(bench.device.slave().settings().address, 7);
    // FDL status of 7, then of 23.
    let status = |bench: &mut Bench, request| bench.hears(&crate::bench::octets_of(request));
    assert_eq!(status(&mut bench, "10 07 02 49 52 16").as_deref(), Some("100207000916"));
    assert_eq!(status(&mut bench, "10 17 02 49 62 16"), None);
    bench.device.power_cycle(bench.now);
    assert_eq!(status(&mut bench, "10 07 02 49 52 16"), None);
    assert_eq!(status(&mut bench, "10 17 02 49 62 16").as_deref(), Some("100217001916"));
}

#[test]
fn a_power_cycle_leaves_nothing_of_parameters_and_faults() {
    let mut bench = Bench::power_up("amg11-p29");
    bench.brings_up("00", 0xD0);
    bench.asks(0x3D, &octets_of("88 01 C8 0B 05 9B 00 00 00"));
    bench.asks(0x3E, &[0x55]);
    assert_eq!(bench.lamp(), Lamp::RedFlashing);
    bench.device.power_cycle(bench.now);
    assert_eq!(bench.lamp(), Lamp::Yellow);
    assert_eq!(bench.diagnosis().len(), 57);
    assert!(!bench.state().class_2);
    assert_eq!(&bench.asks(0x3B, &[]).expect("Get_Cfg")[18..20], "F1");
}

//! Who each product says it is (AMG manual §1.2).

use codewheel_device::product;

use crate::bench::{Bench, hex};

#[test]
fn every_product_answers_with_its_name_code_and_geometry() {
    for product in &product::DEVICENET {
        let mut bench = Bench::power_up(product.model).allocated();
        let name = product.product_name.as_bytes();
        bench.asks("0E 01 01 07", &format!("8E {:02X} {}", name.len(), hex(name)));
        let multiturn = product.model.ends_with("d29");
        bench.asks("0E 01 01 03", if multiturn { "8E 0A00" } else { "8E 0B00" });
        bench.asks("0E 01 01 01", "8E D401");
        bench.asks("0E 01 01 02", "8E 0000");
        bench.asks("0E 01 01 04", "8E 0101");
        assert_eq!(bench.read(81), 8_192);
        assert_eq!(bench.read(82), if multiturn { 65_535 } else { 0 });
        assert_eq!(bench.read(95), if multiturn { 2 } else { 1 });
        assert_eq!(bench.read(8), if multiturn { 1 << 29 } else { 1 << 13 });
        assert_eq!(bench.read(89), 0x0101_0110);
    }
}

#[test]
fn get_attributes_all_of_the_identity_is_every_attribute_in_its_order() {
    for product in &product::DEVICENET {
        let mut bench = Bench::power_up(product.model).allocated();
        let mut all = String::from("81");
        for attribute in 1..=10 {
            all += &bench.ask(&format!("0E 01 01 {attribute:02X}")).expect("an answer")[2..];
        }
        bench.asks("01 01 01", &all);
    }
}

#[test]
fn the_fixed_values_of_class_2f_are_those_of_the_manual() {
    let mut bench = Bench::power_up("amg81-d29").allocated();
    for (attribute, value) in
        [(1, 24), (4, 0), (5, 1), (6, 0), (9, 0), (81, 8_192), (84, 1), (87, 0x10)]
    {
        assert_eq!(bench.read(attribute), value, "attribute {attribute}");
    }
    let mut bench = Bench::power_up("hmg11-d13").allocated();
    assert_eq!((bench.read(84), bench.read(87)), (1, 0));
}

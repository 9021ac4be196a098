//! The rows in Wireshark's dissector are those that answer the wire.

use std::fmt::Write;

use codewheel_device::profibus::{configuration, diagnosis, parameters};

const LUA: &str = include_str!("../../../../docs/wireshark/codewheel_profibus.lua");

/// The tables as the dissector shall have them.
fn tables() -> String {
    let mut lua = String::from("local PARAMETERS = {\n");
    for row in parameters::ROWS {
        let bit = match row.field {
            parameters::Field::Bit(bit) => format!(" bit = {bit},"),
            parameters::Field::Unsigned32 { .. } => String::new(),
        };
        let values: Vec<String> = row.values.iter().map(|value| format!("{value:?}")).collect();
        let values = values.join(", ");
        writeln!(
            lua,
            "  {{ first = {}, last = {},{bit} name = {:?}, unit = {:?}, values = {{ {values} }} }},",
            row.octets.first, row.octets.last, row.name, row.unit
        )
        .unwrap();
    }
    lua.push_str("}\nlocal CONFIGURATIONS = {\n");
    for row in &configuration::ROWS {
        writeln!(lua, "  [0x{:02X}] = {:?},", row.identifier, row.name).unwrap();
    }
    lua.push_str("}\nlocal DIAGNOSIS = {\n");
    for row in &diagnosis::ROWS {
        let kind = match row.data_type {
            diagnosis::DataType::Bits => "bits",
            diagnosis::DataType::Unsigned => "unsigned",
            diagnosis::DataType::Signed => "signed",
            diagnosis::DataType::Version => "version",
            diagnosis::DataType::Text => "text",
        };
        write!(
            lua,
            "  {{ first = {}, last = {}, kind = {kind:?}, name = {:?}, unit = {:?}",
            row.octets.first, row.octets.last, row.name, row.unit
        )
        .unwrap();
        if kind == "bits" {
            lua.push_str(", bits = {");
            for bit in row.bits {
                write!(lua, " {{ {}, {:?} }},", bit.bit, bit.name).unwrap();
            }
            lua.push_str(" }");
        }
        lua.push_str(" },\n");
    }
    lua.push_str("}\n");
    lua
}

#[test]
fn the_dissector_has_the_rows_of_the_device() {
    let begin = LUA.find("-- rows begin\n").expect("where the rows begin") + 14;
    let end = LUA.find("-- rows end\n").expect("where the rows end");
    let expected = tables();
    assert!(
        LUA[begin..end] == expected,
        "between `rows begin` and `rows end` the dissector must have:\n{expected}"
    );
}

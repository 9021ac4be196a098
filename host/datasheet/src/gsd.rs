//! GSD files (EN 50170-2; GSD specification for PROFIBUS, revision 1), one for all products of a
//! geometry.
//!
//! Keywords and values are those of the vendor's own PB13DPV0.GSD. Where they differ,
//! `docs/gsd-differences.md` says why.

use std::fmt::Display;

use codewheel_device::Product;
use codewheel_device::profibus::parameters::{self, FIRST_USER_OCTET, Field, Row, USER_OCTETS};
use codewheel_device::profibus::{IDENT_NUMBER, configuration};
use codewheel_encoder::Model;
use codewheel_station::rs485::BaudRate;

use crate::lines::Lines;

/// At the head of each file.
const ORIGIN: &str = "GSD file of encoders and converters made of software (Codewheel), written from \
    what they themselves answer. The vendor of those of metal has files of its own.";

/// What no row knows, as the vendor has it.
const HARDWARE: [(&str, &str); 4] =
    [("Redundancy", "0"), ("Repeater_Ctrl_Sig", "0"), ("24V_Pins", "0"), ("Slave_Family", "7")];
const PROTOCOL: [(&str, &str); 8] = [
    ("Protocol_Ident", "0"),
    ("Station_Type", "0"),
    ("FMS_supp", "0"),
    ("Hardware_Release", "\"V1.0\""),
    ("Software_Release", "\"V1.0\""),
    ("DP_Encoder_class", "2"),
    ("DP_Encoder_profile_version", "1.1"),
    ("DP_Encoder_manufacturer_specific_functions", "0"),
];
const SERVICES: [(&str, &str); 5] = [
    ("Freeze_Mode_supp", "1"),
    ("Sync_Mode_supp", "1"),
    ("Auto_Baud_supp", "1"),
    ("Set_Slave_Add_supp", "0"),
    // In steps of 100 µs.
    ("Min_Slave_Intervall", "0x0001"),
];
/// The vendor's value; the longest diagnosis that is sent has 57 octets.
const MAX_DIAGNOSIS: &str = "59";

/// The GSD file of a PROFIBUS product.
pub(crate) fn gsd(product: &Product) -> String {
    let mut out = Lines::default();
    head(product, &mut out);
    identity(product, &mut out);
    let texts = texts();
    prm_texts(&texts, &mut out);
    let references = user_prm_data(product.encoder, &texts, &mut out);
    section("Protocol and releases", &mut out);
    entries(&PROTOCOL, &mut out);
    rates(&mut out);
    section("Hardware", &mut out);
    entries(&HARDWARE, &mut out);
    section("Services", &mut out);
    entries(&SERVICES, &mut out);
    entry("Max_Diag_Data_Len", MAX_DIAGNOSIS, &mut out);
    set_prm(product.encoder, &references, &mut out);
    modules(&mut out);
    out.into_text()
}

fn head(product: &Product, out: &mut Lines) {
    out.line(format_args!("; {}", product.data_sheet));
    out.paragraph(";", ORIGIN);
    out.line("; It describes:");
    for like in Product::all().filter(|other| other.data_sheet == product.data_sheet) {
        out.line(format_args!(";   {}", like.title));
    }
    out.line("#Profibus_DP");
}

fn identity(product: &Product, out: &mut Lines) {
    let bits = product.encoder.geometry.range().trailing_zeros();
    entry("GSD_Revision", "1", out);
    entry("Vendor_Name", "\"Baumer group\"", out);
    entry("Model_Name", format_args!("\"xMG_HEAG {bits} bit\""), out);
    entry("Revision", "\"1.00\"", out);
    entry("Ident_Number", format_args!("0x{IDENT_NUMBER:04X}"), out);
}

/// The names of values, each list of them once.
fn texts() -> Vec<&'static [&'static str]> {
    let mut texts = Vec::new();
    for row in parameters::ROWS {
        if !row.values.is_empty() && !texts.contains(&row.values) {
            texts.push(row.values);
        }
    }
    texts
}

fn prm_texts(texts: &[&[&str]], out: &mut Lines) {
    section("Names of values", out);
    for (number, names) in (1..).zip(texts) {
        entry("PrmText", number, out);
        for (value, name) in names.iter().enumerate() {
            entry(format_args!("Text({value})"), format_args!("\"{name}\""), out);
        }
        out.line("EndPrmText");
    }
}

/// Writes each parameter, and gives the octet of Set_Prm that each begins in.
fn user_prm_data(model: Model, texts: &[&[&str]], out: &mut Lines) -> Vec<u8> {
    section("Parameters", out);
    let mut begins = Vec::new();
    for row in parameters::ROWS {
        match (row.field, row.words(model)) {
            (Field::Bit(bit), _) => {
                begins.push(row.octets.first);
                bit_field(begins.len(), row, bit, model, texts, out);
            }
            (Field::Unsigned32 { .. }, words) => {
                for word in words.into_iter().flatten() {
                    begins.push(word.octet);
                    let (first, last) = word.range.into_inner();
                    definition(begins.len(), word.name, out);
                    out.line(format_args!("Unsigned16 {} {first}-{last}", word.default));
                    out.line("EndExtUserPrmData");
                }
            }
        }
    }
    begins
}

fn bit_field(number: usize, row: &Row, bit: u8, model: Model, texts: &[&[&str]], out: &mut Lines) {
    let (first, last) = (row.range)(model).into_inner();
    definition(number, row.name, out);
    out.line(format_args!("Bit({bit}) {} {first}-{last}", (row.default)(model)));
    if let Some(place) = texts.iter().position(|names| *names == row.values) {
        entry("Prm_Text_Ref", place + 1, out);
    }
    out.line("EndExtUserPrmData");
}

fn definition(number: usize, name: &str, out: &mut Lines) {
    out.line(format_args!("ExtUserPrmData = {number} \"{name}\""));
}

fn rates(out: &mut Lines) {
    section("Rates", out);
    for rate in BaudRate::ALL {
        entry(format_args!("{}_supp", keyword_part(rate)), "1", out);
    }
    for rate in BaudRate::ALL {
        let bits = rate.longest_station_delay();
        entry(format_args!("MaxTsdr_{}", keyword_part(rate)), bits, out);
    }
}

/// A rate as keywords name it: thousands without a letter.
fn keyword_part(rate: BaudRate) -> String {
    rate.to_string().trim_end_matches('k').to_owned()
}

/// What Set_Prm carries from octet 8 on, for old tools and for new ones.
fn set_prm(model: Model, begins: &[u8], out: &mut Lines) {
    let octets = parameters::default_octets(model).map(|octet| format!("0x{octet:02X}"));
    let (first, rest) = octets.split_at(USER_OCTETS / 2);
    // A line of its own for each half: all together would be longer than lines may be.
    let octets = format!("{},\\\r\n    {}", first.join(","), rest.join(","));
    section("Set_Prm from octet 8 on, for tools of GSD revision 0", out);
    entry("User_Prm_Data_Len", USER_OCTETS, out);
    entry("User_Prm_Data", &octets, out);
    section("The same for tools of GSD revision 1 and later", out);
    entry("Max_User_Prm_Data_Len", USER_OCTETS, out);
    entry("Ext_User_Prm_Data_Const(0)", &octets, out);
    for (number, octet) in (1..).zip(begins) {
        let offset = octet - FIRST_USER_OCTET;
        entry(format_args!("Ext_User_Prm_Data_Ref({offset})"), number, out);
    }
}

fn modules(out: &mut Lines) {
    let rows = &configuration::ROWS;
    let most = |octets: fn(&configuration::Row) -> u8| rows.iter().map(octets).max().unwrap_or(0);
    section("Modules, one of which is exchanged", out);
    entry("Modular_Station", "1", out);
    entry("Max_Module", "1", out);
    entry("Max_Input_Len", most(|row| row.inputs), out);
    entry("Max_Output_Len", most(|row| row.outputs), out);
    entry("Max_Data_Len", most(|row| row.inputs + row.outputs), out);
    for row in rows {
        out.paragraph(";", row.help);
        out.line(format_args!("Module = \"{}\" 0x{:02X}", row.name, row.identifier));
        out.line("EndModule");
    }
}

fn section(title: &str, out: &mut Lines) {
    out.blank();
    out.line(format_args!("; {title}"));
}

fn entries(entries: &[(&str, &str)], out: &mut Lines) {
    for (keyword, value) in entries {
        entry(keyword, value, out);
    }
}

fn entry(keyword: impl Display, value: impl Display, out: &mut Lines) {
    out.line(format_args!("{keyword} = {value}"));
}

//! EDS files (CIP volume 1, chapter 7; volume 3 for DeviceNet's own section).

mod parameter;

use codewheel_device::Product;
use codewheel_device::devicenet::Factory;
use codewheel_device::devicenet::parameter::{
    CLASS_DESCRIPTOR, NO_CONFIGURATION_ASSEMBLY, descriptor, link_path, type_code,
};
use codewheel_device::devicenet::rows::{Row, Source};
use codewheel_devicenet::ProducedPath;
use codewheel_station::Writer;

use self::parameter::Parameter;
use crate::lines::Lines;

/// The revision of the files themselves, and the day it was made: a change of what they say is a
/// new revision with a new day.
const FILE_REVISION: &str = "1.0";
const FILE_DATE: &str = "11-22-2026";
const FILE_TIME: &str = "12:00:00";

/// At the head of each file.
const ORIGIN: &str = "Electronic data sheet of an encoder made of software (Codewheel), written from \
    what the encoder itself answers. The vendor of the encoders of metal has files of its own.";

/// The name behind the vendor code of [`Factory`].
const VENDOR_NAME: &str = "Baumer IVO";
/// The name of device type 0.
const DEVICE_TYPE_NAME: &str = "Generic Device";
/// Identity attribute 4: firmware 1.01.
const MAJOR_REVISION: u8 = 1;
const MINOR_REVISION: u8 = 1;

/// Connections in `[IO_Info]`.
const POLL: u16 = 1 << 0;
const CHANGE_OF_STATE: u16 = 1 << 2;
const CYCLIC: u16 = 1 << 3;

/// An I/O assembly.
struct Assembly {
    octets: u8,
    /// The attributes of class 2Fh in it.
    attributes: &'static [u8],
    help: &'static str,
}

/// The I/O assemblies by their instances, from 1 on (AMG manual §6).
static ASSEMBLIES: [Assembly; 2] = [
    Assembly { octets: 4, attributes: &[12], help: "4 octets, low octet first" },
    Assembly {
        octets: 5,
        attributes: &[12, 85, 88],
        help: "4 octets, low octet first; then bit 0 alarm, bit 1 warning",
    },
];

/// The EDS file of a DeviceNet product.
pub(crate) fn eds(product: &Product) -> String {
    let parameters = parameter::all(product);
    let mut out = Lines::default();
    head(product, &mut out);
    file(product, &mut out);
    device(product, &mut out);
    section("Device Classification", &mut out);
    entry("Class1", "DeviceNet", &mut out);
    io_info(&mut out);
    param_class(&parameters, &mut out);
    section("Params", &mut out);
    for parameter in &parameters {
        param(parameter, &mut out);
    }
    section("EnumPar", &mut out);
    for parameter in &parameters {
        enum_par(parameter, &mut out);
    }
    groups(&parameters, &mut out);
    out.into_text()
}

fn head(product: &Product, out: &mut Lines) {
    out.line(format_args!("$ {}: {}", product.data_sheet, product.title));
    out.paragraph("$", ORIGIN);
}

fn file(product: &Product, out: &mut Lines) {
    let geometry = product.encoder.geometry;
    section("File", out);
    let steps = geometry.singleturn_resolution();
    let range = match geometry.revolutions() {
        1 => format!("{steps} steps"),
        turns => format!("{steps} steps × {turns} turns"),
    };
    entry("DescText", quoted(&format!("Absolute encoder {}, {range}", product.title)), out);
    entry("CreateDate", FILE_DATE, out);
    entry("CreateTime", FILE_TIME, out);
    entry("ModDate", FILE_DATE, out);
    entry("ModTime", FILE_TIME, out);
    entry("Revision", FILE_REVISION, out);
}

fn device(product: &Product, out: &mut Lines) {
    let Factory { vendor, device_type, .. } = Factory::with_serial(0);
    section("Device", out);
    entry("VendCode", vendor, out);
    entry("VendName", quoted(VENDOR_NAME), out);
    entry("ProdType", device_type, out);
    entry("ProdTypeStr", quoted(DEVICE_TYPE_NAME), out);
    entry("ProdCode", product.product_code(), out);
    entry("MajRev", MAJOR_REVISION, out);
    entry("MinRev", MINOR_REVISION, out);
    entry("ProdName", quoted(product.product_name), out);
    entry("Catalog", quoted(product.title), out);
}

/// Poll goes together with either of the other two, which exclude each other.
fn io_info(out: &mut Lines) {
    section("IO_Info", out);
    entry("Default", hex(POLL), out);
    for (name, together) in [
        ("PollInfo", POLL | CHANGE_OF_STATE | CYCLIC),
        ("COSInfo", POLL | CHANGE_OF_STATE),
        ("CyclicInfo", POLL | CYCLIC),
    ] {
        fields(
            name,
            &[
                (hex(together), "goes together with: 1 poll, 4 COS, 8 cyclic"),
                ("1".into(), "default: Input1"),
                ("0".into(), "the encoder takes no output"),
            ],
            out,
        );
    }
    for (instance, assembly) in (1..).zip(&ASSEMBLIES) {
        input(instance, assembly, out);
    }
}

fn input(instance: u8, assembly: &Assembly, out: &mut Lines) {
    let rows = assembly.attributes.iter().filter_map(|attribute| Row::find(*attribute));
    let names: Vec<&str> = rows.map(|row| row.short_name).collect();
    let mut path = [0; 6];
    let mut writer = Writer::new(&mut path);
    // Six octets take the longest path.
    let _ = ProducedPath { assembly: instance, names_attribute: false }.write(&mut writer);
    let path = writer.written();
    fields(
        &format!("Input{instance}"),
        &[
            (assembly.octets.to_string(), "octets"),
            ("0".into(), "all bits count"),
            (hex(POLL | CHANGE_OF_STATE | CYCLIC), "by poll, COS and cyclic"),
            (quoted(&names.join(", ")), "name"),
            (path.len().to_string(), "octets of the path"),
            (path_text(path), "path"),
            (quoted(assembly.help), "help"),
        ],
        out,
    );
}

fn param_class(parameters: &[Parameter], out: &mut Lines) {
    section("ParamClass", out);
    entry("MaxInst", parameters.len(), out);
    entry("Descriptor", hex(CLASS_DESCRIPTOR), out);
    entry("CfgAssembly", NO_CONFIGURATION_ASSEMBLY, out);
}

fn param(parameter: &Parameter, out: &mut Lines) {
    let Parameter { instance, row, limits, default } = parameter;
    out.blank();
    out.line(format_args!("        $ {}, class 2F attribute {}", row.name, row.attribute));
    if !row.note.is_empty() {
        out.paragraph("        $", row.note);
    }
    let path = link_path(row);
    fields(
        &format!("Param{instance}"),
        &[
            ("0".into(), "reserved"),
            (format!("{}, {}", path.len(), path_text(&path)), "path: octets, path"),
            (hex(descriptor(row)), "descriptor"),
            (format!("0x{:02X}", type_code(row.data_type)), row.data_type.name()),
            (row.data_type.octets().to_string(), "octets"),
            (quoted(row.short_name), "name"),
            (quoted(row.unit), "unit"),
            (quoted(row.help), "help"),
            (format!("{}, {}, {default}", limits.minimum, limits.maximum), "min, max, default"),
            ("1, 1, 1, 0".into(), "scaling: multiplier, divisor, base, offset"),
            ("0, 0, 0, 0".into(), "none of them from another parameter"),
            ("0".into(), "decimal places"),
        ],
        out,
    );
}

fn enum_par(parameter: &Parameter, out: &mut Lines) {
    let Parameter { instance, row, .. } = parameter;
    if row.values.is_empty() {
        return;
    }
    let numbers: Vec<String> = (0..row.values.len()).map(|value| value.to_string()).collect();
    let names = row.values.iter().zip(&numbers);
    let names: Vec<_> = names.map(|(name, value)| (quoted(name), value.as_str())).collect();
    fields(&format!("Param{instance}"), &names, out);
}

/// What people set, what they watch, what never changes.
fn groups(parameters: &[Parameter], out: &mut Lines) {
    section("Groups", out);
    for (number, name) in (1..).zip(["Settings", "Readings", "Device"]) {
        let members = parameters.iter().filter(|parameter| group_of(parameter.row) == name);
        let members: Vec<String> = members.map(|member| member.instance.to_string()).collect();
        let value = format!("{}, {}, {}", quoted(name), members.len(), members.join(", "));
        entry(&format!("Group{number}"), value, out);
    }
}

const fn group_of(row: &Row) -> &'static str {
    match row.source {
        Source::Parameter => "Settings",
        Source::Reading if row.changes => "Readings",
        Source::Reading => "Device",
    }
}

fn section(name: &str, out: &mut Lines) {
    out.blank();
    out.line(format_args!("[{name}]"));
}

fn entry(name: &str, value: impl std::fmt::Display, out: &mut Lines) {
    out.line(format_args!("        {name} = {value};"));
}

/// An entry of several fields, a line each, with what they are.
fn fields(name: &str, fields: &[(String, &str)], out: &mut Lines) {
    out.line(format_args!("        {name} ="));
    for (place, (value, what)) in (1..).zip(fields) {
        let end = if place == fields.len() { ';' } else { ',' };
        out.line_with(&format!("                {value}{end}"), &format!("$ {what}"));
    }
}

fn hex(value: u16) -> String {
    format!("0x{value:04X}")
}

fn quoted(text: &str) -> String {
    format!("\"{text}\"")
}

fn path_text(path: &[u8]) -> String {
    let octets: Vec<String> = path.iter().map(|octet| format!("{octet:02X}")).collect();
    quoted(&octets.join(" "))
}

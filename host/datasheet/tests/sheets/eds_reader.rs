//! A reader of EDS files for the tests: sections, entries, fields.

use codewheel_datasheet::sheet_for;
use codewheel_device::Product;

/// A file, section by section.
pub(crate) struct Eds {
    sections: Vec<Section>,
}

struct Section {
    name: String,
    entries: Vec<(String, Vec<String>)>,
}

/// A parameter as the file has it.
#[derive(Debug)]
pub(crate) struct Param {
    pub(crate) instance: u8,
    pub(crate) path: Vec<u8>,
    pub(crate) descriptor: u16,
    pub(crate) type_code: u8,
    pub(crate) size: usize,
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) help: String,
    pub(crate) minimum: i64,
    pub(crate) maximum: i64,
    pub(crate) default: i64,
    /// Attributes 13 to 16, then 17 to 20, then 21.
    pub(crate) scaling: Vec<i64>,
    /// The names of its values.
    pub(crate) names: Vec<String>,
}

impl Param {
    /// A value in the octets of its type.
    pub(crate) fn octets(&self, value: i64) -> Vec<u8> {
        value.to_le_bytes()[..self.size].to_vec()
    }

    /// The value in octets of its type: DINT has a sign.
    pub(crate) fn value(&self, octets: &[u8]) -> i64 {
        assert_eq!(octets.len(), self.size, "{}", self.name);
        let bits = octets.iter().rev().fold(0, |bits, octet| bits << 8 | i64::from(*octet));
        if self.type_code == 0xC4 { i64::from(bits as i32) } else { bits }
    }

    pub(crate) fn is_settable(&self) -> bool {
        self.descriptor & 0x0010 == 0
    }

    /// Class, instance and attribute of its path.
    pub(crate) fn target(&self) -> [u8; 3] {
        match *self.path {
            [0x20, class, 0x24, instance, 0x30, attribute] => [class, instance, attribute],
            ref other => panic!("no path to an attribute: {other:02X?}"),
        }
    }
}

impl Eds {
    pub(crate) fn of(model: &str) -> Self {
        let product = Product::find(model).expect("a model of the catalogue");
        Self::read(&sheet_for(product).text)
    }

    fn read(text: &str) -> Self {
        // No text in these files has a `$`.
        let code: Vec<&str> =
            text.lines().map(|line| line.split('$').next().unwrap_or_default().trim()).collect();
        let code = code.join("\n");
        let sections = code.split("\n[").skip(1).map(|section| {
            let (name, entries) = section.split_once(']').expect("a section has a name");
            let entries = fields(entries, ';').into_iter().filter(|entry| !entry.is_empty());
            let entries = entries.map(|entry| {
                let (name, values) = entry.split_once('=').expect("an entry has values");
                (name.trim().to_owned(), fields(values, ','))
            });
            Section { name: name.to_owned(), entries: entries.collect() }
        });
        Self { sections: sections.collect() }
    }

    pub(crate) fn section_names(&self) -> Vec<&str> {
        self.sections.iter().map(|section| section.name.as_str()).collect()
    }

    pub(crate) fn entries(&self, section: &str) -> &[(String, Vec<String>)] {
        let section = self.sections.iter().find(|found| found.name == section);
        &section.expect("a section of the file").entries
    }

    pub(crate) fn fields(&self, section: &str, entry: &str) -> &[String] {
        let found = self.entries(section).iter().find(|(name, _)| name == entry);
        &found.unwrap_or_else(|| panic!("no {entry} in [{section}]")).1
    }

    /// The one number of an entry.
    pub(crate) fn number(&self, section: &str, entry: &str) -> i64 {
        match self.fields(section, entry) {
            [field] => number(field),
            more => panic!("{more:?} is not one number"),
        }
    }

    /// The one text of an entry.
    pub(crate) fn text(&self, section: &str, entry: &str) -> String {
        match self.fields(section, entry) {
            [field] => text(field),
            more => panic!("{more:?} is not one text"),
        }
    }

    pub(crate) fn params(&self) -> Vec<Param> {
        let entries = self.entries("Params").iter();
        entries.map(|(name, fields)| self.param(name, fields)).collect()
    }

    fn param(&self, entry: &str, fields: &[String]) -> Param {
        assert_eq!(fields.len(), 21, "{entry}: reserved, and attributes 2 to 21");
        assert_eq!(fields[0], "0");
        let path = path(&fields[2]);
        assert_eq!(number(&fields[1]), path.len() as i64);
        let instance = entry.strip_prefix("Param").and_then(|number| number.parse().ok());
        let names = self.entries("EnumPar").iter().find(|(name, _)| name == entry);
        Param {
            instance: instance.expect("ParamN"),
            path,
            descriptor: number(&fields[3]) as u16,
            type_code: number(&fields[4]) as u8,
            size: number(&fields[5]) as usize,
            name: text(&fields[6]),
            unit: text(&fields[7]),
            help: text(&fields[8]),
            minimum: number(&fields[9]),
            maximum: number(&fields[10]),
            default: number(&fields[11]),
            scaling: fields[12..].iter().map(|field| number(field)).collect(),
            names: names
                .map_or_else(Vec::new, |(_, names)| names.iter().map(|n| text(n)).collect()),
        }
    }
}

/// The parts of `text` between separators that stand in no quotes.
fn fields(text: &str, separator: char) -> Vec<String> {
    let mut quoted = false;
    let parts = text.split(|c| {
        quoted ^= c == '"';
        c == separator && !quoted
    });
    parts.map(|part| part.trim().to_owned()).collect()
}

pub(crate) fn number(field: &str) -> i64 {
    let number = match field.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16),
        None => field.parse(),
    };
    number.unwrap_or_else(|_| panic!("{field} is no number"))
}

pub(crate) fn text(field: &str) -> String {
    let text = field.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    text.unwrap_or_else(|| panic!("{field} is no text")).to_owned()
}

pub(crate) fn path(field: &str) -> Vec<u8> {
    let octets = text(field);
    let octets = octets.split(' ').map(|octet| u8::from_str_radix(octet, 16));
    octets.map(|octet| octet.expect("hexadecimal")).collect()
}

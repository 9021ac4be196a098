//! A document for programs.

use serde::ser::{Serialize, SerializeMap, Serializer};

use super::{Body, Cell, Column, Document};

/// One object on one line.
pub(super) fn json(document: &Document) -> serde_json::Result<String> {
    Ok(serde_json::to_string(document)? + "\n")
}

impl Serialize for Document {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut members = serializer.serialize_map(None)?;
        if let Some(model) = self.model {
            members.serialize_entry("model", model)?;
        }
        members.serialize_entry("title", &self.title)?;
        for section in &self.sections {
            members.serialize_entry(section.key, &section.body)?;
        }
        members.end()
    }
}

impl Serialize for Body {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Facts(facts) => {
                serializer.collect_map(facts.iter().map(|fact| (fact.key, &fact.cell.value)))
            }
            Self::Table(table) => {
                let rows = table.rows.iter();
                serializer.collect_seq(rows.map(|row| Row { columns: &table.columns, row }))
            }
        }
    }
}

/// A row, each cell under the name of its column.
struct Row<'a> {
    columns: &'a [Column],
    row: &'a [Cell],
}

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let names = self.columns.iter().map(|column| column.key);
        serializer.collect_map(names.zip(self.row.iter().map(|cell| &cell.value)))
    }
}

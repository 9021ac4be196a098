//! A description before it is text, Markdown or JSON: written once, shown three ways.

mod json;
mod markdown;
mod text;

use serde_json::Value;

/// What is told of one thing, in sections.
#[derive(Clone, Debug)]
pub(crate) struct Document {
    /// Its heading.
    pub(crate) title: String,
    /// The model that it describes alone.
    pub(crate) model: Option<&'static str>,
    /// What it tells, in order; the first has no heading of its own.
    pub(crate) sections: Vec<Section>,
}

/// One subject of a document.
#[derive(Clone, Debug)]
pub(crate) struct Section {
    /// Its name for programs.
    pub(crate) key: &'static str,
    /// Its heading; empty for none.
    pub(crate) title: String,
    /// What stands in it.
    pub(crate) body: Body,
    /// A sentence below; empty where none is needed.
    pub(crate) note: String,
}

/// What stands in a section.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Body {
    /// Each fact once, with a name.
    Facts(Vec<Fact>),
    /// Rows that are alike.
    Table(Table),
}

/// One fact.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fact {
    /// Its name for programs.
    pub(crate) key: &'static str,
    /// Its name for people.
    pub(crate) name: &'static str,
    /// What it says.
    pub(crate) cell: Cell,
}

/// Rows under common columns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    /// What stands in each place of a row.
    pub(crate) columns: Vec<Column>,
    /// As many cells each as there are columns.
    pub(crate) rows: Vec<Vec<Cell>>,
}

/// One column of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Column {
    /// Its name for programs.
    pub(crate) key: &'static str,
    /// Its heading.
    pub(crate) title: &'static str,
    /// Whether whole sentences stand in it, too wide for a terminal.
    pub(crate) is_prose: bool,
}

/// What stands in one place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cell {
    /// For people.
    pub(crate) text: String,
    /// For programs.
    pub(crate) value: Value,
    /// Whether it is typed or read as it stands.
    pub(crate) is_literal: bool,
}

/// The column whose cells name their rows, where it is not the first.
const KEY: &str = "key";

impl Document {
    /// As text for a terminal.
    pub(crate) fn to_text(&self) -> String {
        text::text(self)
    }

    /// As Markdown, for mdBook and for GitHub.
    pub(crate) fn to_markdown(&self) -> String {
        markdown::markdown(self)
    }

    /// As one JSON object on one line.
    pub(crate) fn to_json(&self) -> serde_json::Result<String> {
        json::json(self)
    }
}

impl Section {
    pub(crate) fn new(key: &'static str, title: impl Into<String>, body: Body) -> Self {
        Self { key, title: title.into(), body, note: String::new() }
    }

    pub(crate) fn with_note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }
}

impl Fact {
    pub(crate) fn new(key: &'static str, name: &'static str, cell: impl Into<Cell>) -> Self {
        Self { key, name, cell: cell.into() }
    }
}

impl Table {
    /// A table without rows.
    pub(crate) const fn new(columns: Vec<Column>) -> Self {
        Self { columns, rows: Vec::new() }
    }

    /// Two columns, and what stands in them.
    pub(crate) fn pairs<C: Into<Cell>>(
        columns: [Column; 2],
        rows: impl IntoIterator<Item = (C, C)>,
    ) -> Self {
        let rows = rows.into_iter().map(|(name, meaning)| vec![name.into(), meaning.into()]);
        Self { columns: columns.to_vec(), rows: rows.collect() }
    }

    /// The column that names the rows.
    fn naming(&self) -> usize {
        self.columns.iter().position(|column| column.key == KEY).unwrap_or_default()
    }
}

/// A column of short cells.
pub(crate) const fn column(key: &'static str, title: &'static str) -> Column {
    Column { key, title, is_prose: false }
}

/// A column of sentences.
pub(crate) const fn prose(key: &'static str, title: &'static str) -> Column {
    Column { key, title, is_prose: true }
}

impl Cell {
    /// Nothing.
    pub(crate) const fn empty() -> Self {
        Self { text: String::new(), value: Value::Null, is_literal: false }
    }

    /// What is typed or read as it stands.
    pub(crate) fn literal(text: impl Into<String>) -> Self {
        Self { is_literal: true, ..Self::from(text.into()) }
    }

    /// Something that people and programs want in different forms.
    pub(crate) fn both(text: impl Into<String>, value: impl Into<Value>) -> Self {
        Self { text: text.into(), value: value.into(), is_literal: false }
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self { value: Value::from(text.clone()), text, is_literal: false }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl From<u32> for Cell {
    fn from(number: u32) -> Self {
        Self::both(number.to_string(), number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn lamp() -> Document {
        let columns = vec![column("state", "STATE"), column(KEY, "KEY"), prose("help", "HELP")];
        let row = |state: u32, key: &str, help: &str| {
            vec![state.into(), Cell::literal(key), Cell::from(help)]
        };
        let rows = vec![row(0, "off", "No power | no check."), row(1, "on", "A < B.")];
        let facts = vec![
            Fact::new("colours", "Colours", 2),
            Fact::new("file", "File", Cell::literal("LAMP.eds")),
        ];
        Document {
            title: "A lamp".to_owned(),
            model: Some("lamp-2"),
            sections: vec![
                Section::new("product", "", Body::Facts(facts)),
                Section::new("states", "States", Body::Table(Table { columns, rows }))
                    .with_note("That is all."),
            ],
        }
    }

    #[test]
    fn a_document_is_text_with_its_sentences_below_the_table() {
        let text = lamp().to_text();
        let lines: Vec<_> = text.lines().map(str::trim_end).collect();
        assert_eq!(
            lines,
            [
                "A lamp (lamp-2)",
                "  Colours         2",
                "  File            LAMP.eds",
                "",
                "States",
                "  STATE  KEY",
                "  0      off",
                "  1      on",
                "",
                "  off  No power | no check.",
                "  on   A < B.",
                "",
                "That is all.",
            ]
        );
    }

    #[test]
    fn the_same_document_is_markdown_in_which_nothing_breaks_a_table() {
        assert_eq!(
            lamp().to_markdown(),
            "# A lamp\n\n\
             | | |\n|---|---|\n| Model | `lamp-2` |\n| Colours | 2 |\n| File | `LAMP.eds` |\n\n\
             ## States\n\n\
             | State | Key | Help |\n|---|---|---|\n\
             | 0 | `off` | No power \\| no check. |\n| 1 | `on` | A \\< B. |\n\n\
             That is all.\n"
        );
    }

    #[test]
    fn the_same_document_is_one_line_of_json_with_numbers_as_numbers() {
        assert_eq!(
            lamp().to_json().unwrap(),
            "{\"model\":\"lamp-2\",\"title\":\"A lamp\",\
             \"product\":{\"colours\":2,\"file\":\"LAMP.eds\"},\
             \"states\":[{\"state\":0,\"key\":\"off\",\"help\":\"No power | no check.\"},\
             {\"state\":1,\"key\":\"on\",\"help\":\"A < B.\"}]}\n"
        );
    }
}

//! All models of a bus in one document: what they share once, what differs with whom it is for.

use codewheel_device::Product;
use codewheel_device::product::Bus;

use super::document;
use crate::document::{Body, Cell, Document, Fact, Section, Table, column};

/// A model and its sections.
type Described = (&'static Product, Document);

/// The models of `bus`.
pub(super) fn of(bus: Bus) -> Document {
    let described: Vec<Described> = Product::all()
        .filter(|product| product.bus == bus)
        .map(|product| (product, document(product)))
        .collect();
    let mut sections = models(&described);
    let mut keys: Vec<&str> = Vec::new();
    // The longest description has every section.
    let longest = described.iter().max_by_key(|(_, document)| document.sections.len());
    for section in longest.iter().flat_map(|(_, document)| document.sections.iter().skip(1)) {
        if !keys.contains(&section.key) {
            keys.push(section.key);
            sections.push(merged(section.key, &described));
        }
    }
    Document { title: format!("{bus} models"), model: None, sections }
}

/// What all models have in common, then a row for each with what sets them apart.
fn models(described: &[Described]) -> Vec<Section> {
    let of_each: Vec<(&Product, &[Fact])> = described
        .iter()
        .filter_map(|(product, document)| match &document.sections.first()?.body {
            Body::Facts(facts) => Some((*product, facts.as_slice())),
            Body::Table(_) => None,
        })
        .collect();
    let first = of_each.first().map_or(&[][..], |(_, facts)| facts);
    let (common, apart): (Vec<usize>, Vec<usize>) =
        (0..first.len()).partition(|at| of_each.iter().all(|(_, facts)| facts[*at] == first[*at]));
    let facts = common.into_iter().map(|at| first[at].clone()).collect();
    let mut columns = vec![column("model", "MODEL"), column("title", "PRODUCT")];
    columns.extend(apart.iter().map(|at| column(first[*at].key, first[*at].name)));
    let mut table = Table::new(columns);
    for (product, facts) in &of_each {
        let mut row = vec![Cell::literal(product.model), product.title.into()];
        row.extend(apart.iter().map(|at| facts[*at].cell.clone()));
        table.rows.push(row);
    }
    vec![
        Section::new("product", "", Body::Facts(facts)),
        Section::new("models", "Models", Body::Table(table)),
    ]
}

/// A row of a section, and who has it.
struct Shared {
    row: Vec<Cell>,
    of: Vec<&'static Product>,
}

/// The section called `key` of all that have it.
fn merged(key: &str, described: &[Described]) -> Section {
    let having: Vec<(&'static Product, &Section)> = described
        .iter()
        .filter_map(|(product, document)| {
            let section = document.sections.iter().find(|section| section.key == key)?;
            Some((*product, section))
        })
        .collect();
    let all: Vec<&Product> = described.iter().map(|(product, _)| *product).collect();
    let who: Vec<&Product> = having.iter().map(|(product, _)| *product).collect();
    // It was found in one of them.
    let mut section = having[0].1.clone();
    if who.len() < all.len() {
        section.title = format!("{} ({})", section.title, label(&who, &all));
    }
    if having.iter().all(|(_, other)| other.body == section.body) {
        return section;
    }
    let (mut columns, _) = table(&section.body);
    columns.insert(0, column("models", "MODELS"));
    let rows = shared(&having).into_iter().map(|Shared { mut row, of }| {
        row.insert(0, label(&of, &who).into());
        row
    });
    section.body = Body::Table(Table { rows: rows.collect(), columns });
    section
}

/// Every different row, in order.
fn shared(having: &[(&'static Product, &Section)]) -> Vec<Shared> {
    let tables: Vec<_> =
        having.iter().map(|(product, section)| (*product, table(&section.body).1)).collect();
    let longest = tables.iter().map(|(_, rows)| rows.len()).max().unwrap_or_default();
    let mut shared: Vec<Shared> = Vec::new();
    for at in 0..longest {
        let before = shared.len();
        for (product, rows) in &tables {
            let Some(row) = rows.get(at) else { continue };
            match shared[before..].iter_mut().find(|shared| shared.row == *row) {
                Some(shared) => shared.of.push(product),
                None => shared.push(Shared { row: row.clone(), of: vec![product] }),
            }
        }
    }
    shared
}

/// A body as a table, whatever it is.
fn table(body: &Body) -> (Vec<crate::document::Column>, Vec<Vec<Cell>>) {
    match body {
        Body::Table(table) => (table.columns.clone(), table.rows.clone()),
        Body::Facts(facts) => (
            vec![column("name", "NAME"), column("meaning", "MEANING")],
            facts.iter().map(|fact| vec![fact.name.into(), fact.cell.clone()]).collect(),
        ),
    }
}

/// Who `some` of `all` are, as short as it can be said: nothing for all of them.
fn label(some: &[&Product], all: &[&Product]) -> String {
    let names = |products: &[&Product]| {
        products.iter().map(|product| product.model).collect::<Vec<_>>().join(", ")
    };
    let others: Vec<&Product> =
        all.iter().filter(|product| !some.contains(product)).copied().collect();
    let bits = |product: &Product| product.encoder.geometry.range().trailing_zeros();
    let mut widths: Vec<u32> = some.iter().map(|product| bits(product)).collect();
    widths.sort_unstable();
    widths.dedup();
    if others.is_empty() {
        String::new()
    } else if others.iter().all(|other| !widths.contains(&bits(other))) && some.len() > 1 {
        let widths: Vec<_> = widths.iter().map(ToString::to_string).collect();
        format!("{} bit", widths.join(" and "))
    } else if others.len() < some.len() {
        format!("all but {}", names(&others))
    } else {
        names(some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows of a section that are not for all, without their last cells.
    fn apart(document: &Document, key: &str) -> Vec<String> {
        let section = document.sections.iter().find(|section| section.key == key).unwrap();
        let Body::Table(table) = &section.body else { panic!("{key} is no table") };
        assert_eq!(table.columns[0].title, "MODELS");
        let rows = table.rows.iter().filter(|row| !row[0].text.is_empty());
        rows.map(|row| format!("{}: {}", row[0].text, row[3].text)).collect()
    }

    #[test]
    fn a_row_that_depends_on_the_model_stands_there_once_for_each_kind_of_model() {
        let chapter = of(Bus::DeviceNet);
        let rows = apart(&chapter, "attributes");
        let of_key = |key: &str| -> Vec<&str> {
            let end = format!(": {key}");
            rows.iter().filter_map(|row| row.strip_suffix(&end)).collect()
        };
        assert_eq!(of_key("total-resolution"), ["13 bit", "29 bit"]);
        assert_eq!(of_key("supported-warnings"), ["all but amg81-d29", "amg81-d29"]);
        assert!(of_key("direction").is_empty(), "the same for all");
        assert_eq!(apart(&of(Bus::Profibus), "parameters").len(), 2 + 3);
    }

    #[test]
    fn every_model_of_the_bus_and_every_section_of_any_is_in_the_chapter() {
        for bus in [Bus::DeviceNet, Bus::Profibus] {
            let chapter = of(bus);
            let text = chapter.to_markdown();
            for product in Product::all().filter(|product| product.bus == bus) {
                assert!(text.contains(&format!("| `{}` |", product.model)), "{}", product.model);
                for section in document(product).sections {
                    let key = section.key;
                    assert!(chapter.sections.iter().any(|there| there.key == key), "{key}");
                }
            }
        }
        assert!(of(Bus::Profibus).to_text().contains("SSI input (heag162-p13, heag162-p18, heag"));
    }
}

//! The walls of the house, held against what the crates really import and write.
//!
//! Two halves: the import table over `cargo metadata`, and a few words that must not stand in the
//! sources of a floor. Only normal dependencies count. Dev-dependencies may cross any wall: the
//! product is tested in the laboratory (`device` in `sim`), and none of that is shipped.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand, Package};

/// Where a crate stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Floor {
    /// no_std, no alloc, no clock, no log: the bytes that firmware runs.
    Core,
    /// Everything that needs an operating system.
    Host,
    /// The program itself.
    Program,
}

/// How far a wall reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reach {
    /// Not even through other crates.
    Through,
    /// Only the crate's own imports: it stands above a crate that rightly imports the other.
    Direct,
}

/// One line of the import table.
#[derive(Debug)]
struct Wall {
    to: &'static str,
    reach: Reach,
    because: &'static str,
}

/// A crate of the workspace and the walls around it.
#[derive(Debug)]
struct Room {
    name: &'static str,
    floor: Floor,
    walls: &'static [Wall],
}

const fn never(to: &'static str, because: &'static str) -> Wall {
    Wall { to, reach: Reach::Through, because }
}

const fn never_itself(to: &'static str, because: &'static str) -> Wall {
    Wall { to, reach: Reach::Direct, because }
}

const WHO_ASKS: &str = "a position does not know who asks";
const TWO_BOOKS: &str = "two books; what they share is the station";
const ANY_DEVICE: &str = "a protocol book serves any device";
const LABORATORY: &str = "the product does not know the laboratory";
const VIRTUAL_TIME: &str = "the laboratory runs in virtual time or not at all";
const SENSOR_LINE: &str = "a sensor line does not know which bus its code goes to";
const RECORDED: &str = "a capture does not know where its traffic came from";
const SNAPSHOTS: &str = "the page sees snapshots, events and commands, no protocol";
const FIRMWARE: &str = "firmware, fuzzer and simulator run the same bytes of core";
const GROUND: &str = "the ground floor carries the others";

/// The import table. A crate that is planned may stand here before it exists.
const ROOMS: &[Room] = &[
    Room {
        name: "codewheel-station",
        floor: Floor::Core,
        walls: &[
            never("codewheel-encoder", GROUND),
            never("codewheel-devicenet", GROUND),
            never("codewheel-profibus", GROUND),
            never("codewheel-device", GROUND),
        ],
    },
    Room {
        name: "codewheel-encoder",
        floor: Floor::Core,
        walls: &[
            never("codewheel-devicenet", WHO_ASKS),
            never("codewheel-profibus", WHO_ASKS),
            never("codewheel-device", WHO_ASKS),
        ],
    },
    Room {
        name: "codewheel-devicenet",
        floor: Floor::Core,
        walls: &[
            never("codewheel-profibus", TWO_BOOKS),
            never("codewheel-encoder", ANY_DEVICE),
            never("codewheel-device", ANY_DEVICE),
        ],
    },
    Room {
        name: "codewheel-profibus",
        floor: Floor::Core,
        walls: &[
            never("codewheel-devicenet", TWO_BOOKS),
            never("codewheel-encoder", ANY_DEVICE),
            never("codewheel-device", ANY_DEVICE),
        ],
    },
    Room {
        name: "codewheel-device",
        floor: Floor::Core,
        walls: &[never("codewheel-sim", LABORATORY), never("codewheel-link", LABORATORY)],
    },
    Room {
        name: "codewheel-sim",
        floor: Floor::Host,
        walls: &[
            never("codewheel-link", VIRTUAL_TIME),
            never("mio", VIRTUAL_TIME),
            never("tokio", VIRTUAL_TIME),
        ],
    },
    Room { name: "codewheel-link", floor: Floor::Host, walls: &[] },
    Room {
        name: "codewheel-spidev",
        floor: Floor::Host,
        walls: &[
            never("codewheel-devicenet", SENSOR_LINE),
            never("codewheel-profibus", SENSOR_LINE),
            never("codewheel-device", SENSOR_LINE),
        ],
    },
    Room { name: "codewheel-datasheet", floor: Floor::Host, walls: &[] },
    Room { name: "codewheel-commission", floor: Floor::Host, walls: &[] },
    Room {
        name: "codewheel-capture",
        floor: Floor::Host,
        walls: &[
            never("codewheel-link", RECORDED),
            never("codewheel-plant", RECORDED),
            never("codewheel-sim", RECORDED),
        ],
    },
    Room { name: "codewheel-plant", floor: Floor::Host, walls: &[] },
    Room {
        name: "codewheel-dashboard",
        floor: Floor::Host,
        walls: &[
            never_itself("codewheel-devicenet", SNAPSHOTS),
            never_itself("codewheel-profibus", SNAPSHOTS),
        ],
    },
    Room { name: "codewheel", floor: Floor::Program, walls: &[] },
];

/// What core may import from outside, all of it `no_std` without an allocator.
const CORE_MAY_IMPORT: &[&str] = &["bitflags", "crc", "defmt", "embedded-can", "heapless"];

/// What those five bring with them.
const CORE_MAY_INHERIT: &[&str] =
    &["byteorder", "crc-catalog", "hash32", "nb", "stable_deref_trait"];

/// Who imports whom: normal dependencies by package name, compile-time ones left out.
type Imports = BTreeMap<String, BTreeSet<String>>;

/// Everything `from` imports, itself or through others, each with the way that leads there.
fn reached(imports: &Imports, from: &str) -> BTreeMap<String, Vec<String>> {
    let mut ways = BTreeMap::from([(from.to_owned(), vec![from.to_owned()])]);
    let mut next = VecDeque::from([from.to_owned()]);
    while let Some(here) = next.pop_front() {
        for to in imports.get(&here).into_iter().flatten() {
            if !ways.contains_key(to) {
                let mut way = ways[&here].clone();
                way.push(to.clone());
                ways.insert(to.clone(), way);
                next.push_back(to.clone());
            }
        }
    }
    ways.remove(from);
    ways
}

/// What the table forbids and `imports` has: one sentence for each breach.
fn breaches(imports: &Imports, members: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for member in members {
        match ROOMS.iter().find(|room| room.name == *member) {
            Some(room) => found.extend(breaches_of(room, imports)),
            None => found.push(format!(
                "{member} has no rule: add a Room for it to ROOMS in codewheel/tests/walls.rs and \
                 say which floor it stands on and what it must never import"
            )),
        }
    }
    found
}

fn breaches_of(room: &Room, imports: &Imports) -> Vec<String> {
    let ways = reached(imports, room.name);
    let mut found = Vec::new();
    for wall in room.walls {
        if let Some(way) = ways.get(wall.to).filter(|way| wall.reach.covers(way)) {
            found.push(sentence(room.name, wall.to, way, wall.because));
        }
    }
    if room.floor == Floor::Core {
        let walled = |to: &str| room.walls.iter().any(|wall| wall.to == to);
        for (to, way) in ways.iter().filter(|(to, _)| !walled(to) && !core_may_reach(to)) {
            found.push(sentence(room.name, to, way, FIRMWARE));
        }
    }
    found
}

impl Reach {
    fn covers(self, way: &[String]) -> bool {
        self == Self::Through || way.len() == 2
    }
}

fn core_may_reach(name: &str) -> bool {
    CORE_MAY_IMPORT.contains(&name)
        || CORE_MAY_INHERIT.contains(&name)
        || ROOMS.iter().any(|room| room.name == name && room.floor == Floor::Core)
}

fn sentence(from: &str, to: &str, way: &[String], because: &str) -> String {
    format!("{from} must never import {to}, because {because} (it does: {})", way.join(" → "))
}

/// The code of a Rust source: comments, texts and characters blanked, test items removed. Lines
/// keep their numbers.
fn shipped_code(source: &str) -> String {
    without_tests(&without_prose(source))
}

/// Blanks comments, string and character literals.
fn without_prose(source: &str) -> String {
    let mut code = String::with_capacity(source.len());
    let mut rest = source;
    while let Some(first) = rest.chars().next() {
        let length = prose_length(rest, code.chars().last());
        let taken = if length == 0 { first.len_utf8() } else { length };
        let (head, tail) = rest.split_at(taken);
        if length == 0 {
            code.push(first);
        } else {
            code.extend(head.chars().map(|c| if c == '\n' { '\n' } else { ' ' }));
        }
        rest = tail;
    }
    code
}

/// How many octets of comment or literal stand at the front of `rest`; 0 where it is code.
fn prose_length(rest: &str, before: Option<char>) -> usize {
    if rest.starts_with("//") {
        return rest.find('\n').unwrap_or(rest.len());
    }
    if rest.starts_with("/*") {
        return block_comment_length(rest);
    }
    if rest.starts_with('"') {
        return quoted_length(rest, '"');
    }
    if let Some(quoted) = rest.strip_prefix('\'') {
        // A lifetime has no closing quote one (escaped) character on.
        let escaped = quoted.starts_with('\\');
        let closed = quoted.chars().nth(1) == Some('\'');
        return if escaped || closed { quoted_length(rest, '\'') } else { 0 };
    }
    let begins_word = !before.is_some_and(|c| c.is_alphanumeric() || c == '_');
    if begins_word { raw_text_length(rest) } else { 0 }
}

fn block_comment_length(rest: &str) -> usize {
    let mut depth = 0_usize;
    let mut at = 0;
    while at < rest.len() {
        if rest[at..].starts_with("/*") {
            depth += 1;
            at += 2;
        } else if rest[at..].starts_with("*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            at += rest[at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    rest.len()
}

fn quoted_length(rest: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in rest.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            c if c == quote => return at + 1,
            _ => {}
        }
    }
    rest.len()
}

fn raw_text_length(rest: &str) -> usize {
    let after = rest.trim_start_matches(['b', 'c']);
    let Some(after) = after.strip_prefix('r').filter(|_| rest.len() - after.len() <= 1) else {
        return 0;
    };
    let hashes = after.len() - after.trim_start_matches('#').len();
    let Some(text) = after[hashes..].strip_prefix('"') else { return 0 };
    let end = format!("\"{}", "#".repeat(hashes));
    let start = rest.len() - text.len();
    text.find(&end).map_or(rest.len(), |at| start + at + end.len())
}

/// Blanks every item under `#[cfg(test)]`. Takes code without prose.
fn without_tests(code: &str) -> String {
    let mut shipped = code.to_owned();
    while let Some(start) = shipped.find("#[cfg(test)]") {
        let end = start + item_length(&shipped[start..]);
        let blank = shipped[start..end].chars().map(|c| if c == '\n' { '\n' } else { ' ' });
        let blank = blank.collect::<String>();
        shipped.replace_range(start..end, &blank);
    }
    shipped
}

/// The length of the item at the front of `code`: to its `;`, or to the `}` that closes it.
fn item_length(code: &str) -> usize {
    let mut depth = 0_usize;
    for (at, c) in code.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return at + 1;
                }
            }
            ';' if depth == 0 => return at + 1,
            _ => {}
        }
    }
    code.len()
}

/// The line numbers at which `word` stands as a whole word (`std::net`, `f64`, `todo!`).
fn lines_with(code: &str, word: &str) -> Vec<usize> {
    let part_of_word = |c: char| c.is_alphanumeric() || c == '_';
    let stands_alone = |at: usize| {
        !code[..at].chars().next_back().is_some_and(part_of_word)
            && !code[at + word.len()..].chars().next().is_some_and(part_of_word)
    };
    code.match_indices(word)
        .filter(|(at, _)| stands_alone(*at))
        .map(|(at, _)| code[..at].matches('\n').count() + 1)
        .collect()
}

/// `use` and other paths written out: `std::{net, time::Instant}` also as `std::net` and
/// `std::time::Instant`, each on the line where it ends.
fn paths_from(code: &str, root: &str) -> Vec<(usize, String)> {
    let mut paths = Vec::new();
    let opening = format!("{root}::");
    for (at, _) in code.match_indices(&opening) {
        if code[..at].chars().next_back().is_some_and(|c| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let line = code[..at].matches('\n').count() + 1;
        let mut prefixes = vec![root.to_owned()];
        let mut path = root.to_owned();
        path.push_str("::");
        for c in code[at + opening.len()..].chars() {
            match c {
                c if c.is_alphanumeric() || c == '_' || c == ':' => path.push(c),
                c if c.is_whitespace() && prefixes.len() > 1 => {}
                '{' => prefixes.push(path.clone()),
                ',' | '}' => {
                    paths.push((line, path.clone()));
                    if c == '}' {
                        prefixes.pop();
                    }
                    if prefixes.len() <= 1 {
                        break;
                    }
                    path = prefixes.last().cloned().unwrap_or_default();
                }
                _ => break,
            }
        }
        paths.push((line, path));
    }
    paths
}

const UNFINISHED: &[&str] = &["todo!", "unimplemented!", "dbg!"];

/// Words that must not stand in the shipped code of a crate, with the reason.
fn forbidden_words(room: &Room) -> Vec<(&'static str, &'static str)> {
    let mut words: Vec<_> =
        UNFINISHED.iter().map(|w| (*w, "unfinished work does not ship")).collect();
    if room.floor == Floor::Core {
        words.push(("extern crate std", FIRMWARE));
        words.push(("extern crate alloc", FIRMWARE));
        words.push(("unsafe", "what a peer can send must not reach memory"));
    }
    if room.name == "codewheel-encoder" {
        words.push(("f32", "no float in the measuring path"));
        words.push(("f64", "no float in the measuring path"));
    }
    if room.name == "codewheel-sim" {
        words.push(("SystemTime", VIRTUAL_TIME));
    }
    words
}

/// What `source` of a crate must not say: one sentence for each place.
fn forbidden_in(room: &Room, file: &str, source: &str) -> Vec<String> {
    let code = shipped_code(source);
    let mut found = Vec::new();
    for (word, because) in forbidden_words(room) {
        for line in lines_with(&code, word) {
            found.push(format!("{file}:{line} ({}) says `{word}`: {because}", room.name));
        }
    }
    if room.name == "codewheel-sim" {
        for (line, path) in paths_from(&code, "std") {
            let walled = ["std::thread", "std::net", "std::time"]
                .iter()
                .any(|wall| path == *wall || path.starts_with(&format!("{wall}::")));
            if walled && path != "std::time::Duration" {
                found.push(format!("{file}:{line} ({}) uses `{path}`: {VIRTUAL_TIME}", room.name));
            }
        }
    }
    found
}

fn metadata() -> Metadata {
    MetadataCommand::new()
        .manifest_path(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"))
        .exec()
        .expect("cargo metadata describes the workspace")
}

fn is_proc_macro(package: &Package) -> bool {
    package.targets.iter().any(|target| target.is_proc_macro())
}

/// The imports of every package in the tree. A procedural macro runs in the compiler, so what it
/// imports is not in the product.
fn imports_of(metadata: &Metadata) -> Imports {
    let resolve = metadata.resolve.as_ref().expect("cargo metadata resolves the dependencies");
    let mut imports = Imports::new();
    for node in &resolve.nodes {
        let package = &metadata[&node.id];
        let normal = node.deps.iter().filter(|dep| {
            dep.dep_kinds.iter().any(|kind| kind.kind == DependencyKind::Normal)
                && !is_proc_macro(&metadata[&dep.pkg])
        });
        let names = normal.map(|dep| metadata[&dep.pkg].name.to_string());
        imports.entry(package.name.to_string()).or_default().extend(names);
    }
    // Optional dependencies that no feature switches on today are imports all the same.
    for package in metadata.workspace_packages() {
        let declared = package.dependencies.iter().filter(|d| d.kind == DependencyKind::Normal);
        let names = declared.map(|dependency| dependency.name.clone());
        imports.entry(package.name.to_string()).or_default().extend(names);
    }
    imports
}

fn directory(package: &Package) -> PathBuf {
    let manifest = package.manifest_path.as_std_path();
    manifest.parent().expect("a manifest lies in a directory").to_owned()
}

/// The shipped `.rs` files below `directory`; `tests.rs` and `tests/` hold tests by convention.
fn sources(directory: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(directory).expect("the source directory can be listed") {
        let path = entry.expect("the source directory can be listed").path();
        let is_test = path.file_stem().is_some_and(|stem| stem == "tests");
        if path.is_dir() && !is_test {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") && !is_test {
            files.push(path);
        }
    }
    files.sort();
    files
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn assert_none(found: &[String]) {
    assert!(found.is_empty(), "\n  {}\n", found.join("\n  "));
}

#[test]
fn no_crate_imports_what_the_table_forbids() {
    let metadata = metadata();
    let packages = metadata.workspace_packages();
    let members: Vec<&str> = packages.iter().map(|package| package.name.as_str()).collect();
    assert!(members.contains(&"codewheel-encoder"), "the workspace was not found: {members:?}");
    assert_none(&breaches(&imports_of(&metadata), &members));
}

#[test]
fn no_shipped_source_says_what_its_floor_forbids() {
    let metadata = metadata();
    let mut found = Vec::new();
    for package in metadata.workspace_packages() {
        let Some(room) = ROOMS.iter().find(|room| room.name == package.name.as_str()) else {
            continue; // reported by the import table
        };
        let files = sources(&directory(package).join("src"));
        assert!(!files.is_empty(), "{} has no sources", room.name);
        for file in files {
            let name = file.strip_prefix(metadata.workspace_root.as_std_path()).unwrap_or(&file);
            found.extend(forbidden_in(room, &name.display().to_string(), &read(&file)));
        }
    }
    assert_none(&found);
}

#[test]
fn every_core_crate_is_no_std() {
    let metadata = metadata();
    let mut found = Vec::new();
    for package in metadata.workspace_packages() {
        let is_core =
            |room: &&Room| room.name == package.name.as_str() && room.floor == Floor::Core;
        if ROOMS.iter().find(is_core).is_none() {
            continue;
        }
        let code = shipped_code(&read(&directory(package).join("src/lib.rs")));
        if !code.lines().any(|line| line.trim() == "#![no_std]") {
            found.push(format!("{} lacks #![no_std] in src/lib.rs: {FIRMWARE}", package.name));
        }
    }
    assert_none(&found);
}

#[test]
fn every_crate_takes_edition_licence_and_lints_from_the_workspace() {
    let metadata = metadata();
    let mut found = Vec::new();
    for package in metadata.workspace_packages() {
        let manifest = read(package.manifest_path.as_std_path());
        for field in ["edition", "license", "rust-version", "version", "publish"] {
            if !manifest.lines().any(|line| line.trim() == format!("{field}.workspace = true")) {
                found
                    .push(format!("{}: Cargo.toml lacks `{field}.workspace = true`", package.name));
            }
        }
        let lints = manifest.split("[lints]").nth(1).map(str::trim_start);
        if !lints.is_some_and(|section| section.starts_with("workspace = true")) {
            found.push(format!("{}: Cargo.toml lacks [lints] workspace = true", package.name));
        }
    }
    assert_none(&found);
}

fn made_up(edges: &[(&str, &[&str])]) -> Imports {
    let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    edges.iter().map(|(from, to)| ((*from).to_owned(), owned(to))).collect()
}

#[test]
fn a_breach_through_other_crates_is_found_and_explained() {
    let imports = made_up(&[
        ("codewheel-encoder", &["codewheel-station", "heapless"]),
        ("codewheel-station", &["codewheel-devicenet"]),
    ]);
    assert_eq!(
        breaches(&imports, &["codewheel-encoder"]),
        ["codewheel-encoder must never import codewheel-devicenet, because a position does not \
          know who asks (it does: codewheel-encoder → codewheel-station → codewheel-devicenet)"]
    );
}

#[test]
fn core_may_import_nothing_that_is_not_on_the_list() {
    let imports = made_up(&[
        ("codewheel-device", &["crc", "serde", "codewheel-sim", "codewheel-plant"]),
        ("crc", &["crc-catalog"]),
    ]);
    let found = breaches(&imports, &["codewheel-device"]);
    assert_eq!(found.len(), 3, "{found:#?}");
    assert!(found[0].contains("import codewheel-sim, because the product does not know"));
    assert!(found[1].contains("import codewheel-plant, because firmware"));
    assert!(found[2].contains("import serde, because firmware"));
}

#[test]
fn the_page_may_stand_on_the_plant_but_not_speak_a_protocol_itself() {
    let through = made_up(&[
        ("codewheel-dashboard", &["codewheel-plant"]),
        ("codewheel-plant", &["codewheel-devicenet"]),
    ]);
    assert_eq!(breaches(&through, &["codewheel-dashboard"]), Vec::<String>::new());
    let itself = made_up(&[("codewheel-dashboard", &["codewheel-devicenet"])]);
    assert_eq!(breaches(&itself, &["codewheel-dashboard"]).len(), 1);
}

#[test]
fn a_crate_without_a_rule_is_told_where_to_get_one() {
    let found = breaches(&made_up(&[]), &["codewheel-novelty"]);
    assert_eq!(found.len(), 1);
    assert!(found[0].starts_with("codewheel-novelty has no rule: add a Room"), "{found:?}");
}

fn room(name: &str) -> &'static Room {
    ROOMS.iter().find(|room| room.name == name).expect("the table has the crate")
}

#[test]
fn forbidden_words_count_in_code_and_not_in_comments_texts_or_tests() {
    let source = r##"//! Never an f64 here.
/* nor /* an */ f32 */
const SAID: &str = "f64 \" f64";
const RAW: &str = r#"f64 " f64"#;
fn quote<'a>(c: char, text: &'a str) -> bool { c == '"' || c == '\'' }
const REAL: f64 = 0.0;
#[cfg(test)]
extern crate std;
#[cfg(test)]
mod tests {
    fn inner() { let _ = 1_f32 as f64; unsafe {} }
}
fn later() { todo!() }
"##;
    assert_eq!(
        forbidden_in(room("codewheel-encoder"), "a.rs", source),
        [
            "a.rs:13 (codewheel-encoder) says `todo!`: unfinished work does not ship",
            "a.rs:6 (codewheel-encoder) says `f64`: no float in the measuring path",
        ]
    );
    let bare = "extern crate std;\nfn f() { unsafe {} }\n";
    assert_eq!(forbidden_in(room("codewheel-station"), "b.rs", bare).len(), 2);
}

#[test]
fn operating_system_time_is_found_in_the_simulator_however_it_is_imported() {
    let sim = room("codewheel-sim");
    for breach in [
        "use std::time::Instant;",
        "use std::{fmt, time::{Duration, Instant}};",
        "use std::time;",
        "use std::{\n    io,\n    net,\n};",
        "fn f() { std::thread::sleep(x) }",
        "use std::time::SystemTime;",
    ] {
        assert!(!forbidden_in(sim, "s.rs", breach).is_empty(), "not found: {breach}");
    }
    for fine in
        ["use std::time::Duration;", "use codewheel_station::Instant;", "use std::{fmt, io};"]
    {
        assert_eq!(forbidden_in(sim, "s.rs", fine), Vec::<String>::new());
    }
}

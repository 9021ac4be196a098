//! Links of all Markdown files to files and headings of the repository.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

use crate::repository;

/// The Markdown files that belong to the repository, also those that are not committed yet.
fn pages() -> Vec<PathBuf> {
    let root = repository();
    let output = Command::new("git")
        .args(["ls-files", "--cached", "--others", "--exclude-standard", "-z", "*.md"])
        .current_dir(&root)
        .output();
    let listed = output.ok().filter(|output| output.status.success());
    let mut pages: Vec<PathBuf> = match listed {
        Some(listed) => {
            let names = String::from_utf8(listed.stdout).expect("names are text");
            names.split('\0').filter(|name| !name.is_empty()).map(|name| root.join(name)).collect()
        }
        // An archive without git.
        None => markdown_below(&root),
    };
    pages.retain(|page| page.is_file());
    pages
}

fn markdown_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            found.extend(markdown_below(&path));
        } else if name.ends_with(".md") {
            found.push(path);
        }
    }
    found
}

/// What a page links to, and the anchors of its headings.
#[derive(Debug, Default, PartialEq)]
struct Page {
    links: Vec<String>,
    anchors: BTreeSet<String>,
}

impl Page {
    fn parse(text: &str) -> Self {
        let mut page = Self::default();
        let mut heading = None;
        for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
            match event {
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    page.links.push(dest_url.into_string());
                }
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::Text(text) | Event::Code(text) => {
                    if let Some(heading) = &mut heading {
                        heading.push_str(&text);
                    }
                }
                Event::End(TagEnd::Heading(_)) => page.add_anchor(heading.take()),
                _ => {}
            }
        }
        page
    }

    /// Adds the anchor that GitHub and mdBook give to a heading; of equal ones the later get numbers.
    fn add_anchor(&mut self, heading: Option<String>) {
        let heading = heading.unwrap_or_default().trim().to_lowercase();
        let plain: String = heading
            .chars()
            .filter(|letter| letter.is_alphanumeric() || " -_".contains(*letter))
            .map(|letter| if letter == ' ' { '-' } else { letter })
            .collect();
        let mut anchor = plain.clone();
        let mut number = 0;
        while self.anchors.contains(&anchor) {
            number += 1;
            anchor = format!("{plain}-{number}");
        }
        self.anchors.insert(anchor);
    }
}

/// Why `link` of the page at `at` leads nowhere.
fn broken(at: &Path, link: &str) -> Option<String> {
    if link.contains("://") || link.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let target = if file.is_empty() {
        at.to_owned()
    } else {
        at.parent().unwrap_or(at).join(file.replace("%20", " "))
    };
    if !target.exists() {
        return Some(format!("{} is not there", target.display()));
    }
    let is_page = target.extension().is_some_and(|extension| extension == "md");
    if anchor.is_empty() || !is_page {
        return None;
    }
    let text = fs::read_to_string(&target).ok()?;
    let found = Page::parse(&text).anchors.contains(anchor);
    (!found).then(|| format!("{} has no heading #{anchor}", target.display()))
}

#[test]
fn every_link_to_a_file_or_a_heading_of_the_repository_leads_there() {
    let mut count = 0;
    let mut wrong = Vec::new();
    for page in pages() {
        let text = fs::read_to_string(&page).expect("a page");
        for link in Page::parse(&text).links {
            count += 1;
            if let Some(why) = broken(&page, &link) {
                wrong.push(format!("{}: ({link}): {why}", page.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 20, "only {count} links were found");
}

#[test]
fn a_link_that_leads_nowhere_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = folder.path().join("page.md");
    fs::write(&page, "# On a `PC`, at once\n\n## Twice\n\n## Twice\n").expect("a page");
    for good in ["#on-a-pc-at-once", "#twice-1", "page.md", "page.md#twice", "https://a.b/c#d"] {
        assert_eq!(broken(&page, good), None, "{good}");
    }
    for bad in ["#on-a-pc", "#twice-2", "other.md", "page.md#thrice", "../page.md"] {
        assert!(broken(&page, bad).is_some(), "{bad}");
    }
}

#[test]
fn links_are_found_where_markdown_has_them_and_not_in_code() {
    let text =
        "| [a](b.md) |\n|---|\n| ![c](d.png) |\n\n`[no](x.md)`\n\n```text\n[no](y.md)\n```\n";
    assert_eq!(Page::parse(text).links, ["b.md", "d.png"]);
}

//! The files of the page.

use crate::client::Page;

#[test]
fn the_page_is_at_the_root_with_what_keeps_a_browser_strict() {
    let page = Page::start();
    let answer = page.get("/");
    assert_eq!(answer.status, 200);
    assert_eq!(answer.header("content-type"), Some("text/html; charset=utf-8"));
    let policy = answer.header("content-security-policy").expect("a policy");
    assert!(policy.starts_with("default-src 'self';") && !policy.contains("unsafe"), "{policy}");
    assert_eq!(answer.header("x-content-type-options"), Some("nosniff"));
    assert_eq!(answer.header("referrer-policy"), Some("no-referrer"));
    assert!(answer.body.contains("<title>Codewheel</title>"), "{}", answer.body);
}

#[test]
fn a_browser_that_has_a_file_is_not_sent_it_again() {
    let page = Page::start();
    let first = page.get("/index.html");
    let tag = first.header("etag").expect("a tag");
    let host = page.address();
    let again = page.send(&format!("GET / HTTP/1.1\nHost: {host}\nIf-None-Match: {tag}"), "");
    assert_eq!((again.status, again.body.as_str()), (304, ""));
    assert_eq!(again.header("etag"), Some(tag));
    let other = page.send(&format!("GET / HTTP/1.1\nHost: {host}\nIf-None-Match: \"0\""), "");
    assert_eq!(other.status, 200);
    assert_eq!(first.header("cache-control"), Some("no-cache"), "a program may be replaced");
}

#[test]
fn everything_that_the_page_names_is_there_with_the_right_type() {
    let page = Page::start();
    let index = page.get("/").body;
    let mut found = 0;
    for attribute in ["href=\"", "src=\""] {
        for rest in index.split(attribute).skip(1) {
            let name = rest.split('"').next().expect("a name");
            if name.starts_with('#') {
                continue;
            }
            let path = format!("/{}", name.trim_start_matches(['.', '/']));
            let answer = page.get(&path);
            assert_eq!(answer.status, 200, "{path}");
            let expected = match path.rsplit_once('.') {
                Some((_, "js")) => "text/javascript; charset=utf-8",
                Some((_, "css")) => "text/css; charset=utf-8",
                Some((_, "svg")) => "image/svg+xml",
                Some((_, "json")) => "application/json",
                _ => panic!("{path}: say in this test what it is"),
            };
            assert_eq!(answer.header("content-type"), Some(expected), "{path}");
            found += 1;
        }
    }
    assert!(found > 0, "{index}");
}

#[test]
fn what_is_no_file_of_the_page_is_not_found() {
    let page = Page::start();
    for path in ["/nothing.js", "/../Cargo.toml", "/%2e%2e/Cargo.toml", "//etc/passwd", "/api/v2"] {
        page.get(path).problem(404);
    }
}

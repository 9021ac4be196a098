//! The web page of a plant, from the prompt.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};

use crate::prompt::{Running, codewheel, example, stderr};

const TOKEN: &str = "0123456789abcdef";

/// Runs the demo with `options` and waits for where its page is.
fn run_demo(options: &[&str]) -> (Running, SocketAddr) {
    let demo = example("demo.toml");
    let mut running = Running::start(&[&["run", demo.to_str().expect("text")], options].concat());
    loop {
        let message = running.message();
        if let Some(address) = message.strip_prefix("codewheel: page http://") {
            let address = address.parse().expect("an address");
            return (running, address);
        }
        assert!(message.starts_with("codewheel: "), "no page: {message:?}");
    }
}

/// What `GET path` answers, with its head.
fn fetch(address: SocketAddr, path: &str, more: &str) -> String {
    let mut stream = TcpStream::connect(address).expect("the page is there");
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n{more}\r\n")
        .expect("asked");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("answered");
    answer
}

#[test]
fn a_plant_says_where_its_page_is_and_the_page_shows_it() {
    let (_running, address) = run_demo(&["--listen", "127.0.0.1:0"]);
    assert!(address.ip().is_loopback() && address.port() != 0);
    let page = fetch(address, "/", "");
    assert!(page.starts_with("HTTP/1.1 200 ") && page.contains("Codewheel"), "{page}");
    let plant = fetch(address, "/api/v1/plant", "");
    assert!(plant.contains(r#""read_only":false"#) && plant.contains("demo.toml"), "{plant}");
    assert!(plant.contains("AMG 11 D29") && plant.contains("HEAG 162 SP 18"), "{plant}");
}

#[test]
fn without_being_asked_two_plants_have_two_pages() {
    let (_one, first) = run_demo(&[]);
    let (_other, second) = run_demo(&[]);
    assert_ne!(first, second);
    for address in [first, second] {
        assert!(address.ip().is_loopback());
        assert!(fetch(address, "/", "").starts_with("HTTP/1.1 200 "));
    }
}

#[test]
fn a_page_that_is_not_wanted_is_not_there() {
    let demo = example("demo.toml");
    let output = codewheel(&["run", demo.to_str().expect("text"), "--for", "300ms", "--no-page"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(!stderr(&output).contains("page"), "{}", stderr(&output));
}

#[test]
fn a_page_for_others_needs_a_token_and_whoever_has_it_gets_in() {
    let demo = example("demo.toml");
    let run = ["run", demo.to_str().expect("text"), "--listen", "0.0.0.0:0"];
    let output = codewheel(&run);
    assert_eq!(output.status.code(), Some(2));
    let message = stderr(&output);
    assert!(message.contains("--token TOKEN") && message.contains("127.0.0.1"), "{message}");
    assert!(output.stdout.is_empty());

    let options = ["--listen", "0.0.0.0:0", "--token", TOKEN, "--read-only"];
    let (_running, address) = run_demo(&options);
    let address = SocketAddr::from(([127, 0, 0, 1], address.port()));
    assert!(fetch(address, "/api/v1/plant", "").starts_with("HTTP/1.1 401 "));
    let known = fetch(address, "/api/v1/plant", &format!("Authorization: Bearer {TOKEN}\r\n"));
    assert!(known.contains(r#""read_only":true"#), "{known}");
}

#[test]
fn a_port_that_was_asked_for_and_is_taken_is_an_error_that_says_what_to_do() {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("bound").to_string();
    let folder = tempfile::tempdir().expect("a folder");
    let plant = folder.path().join("plant.toml");
    let device = "[[device]]\nmodel = \"amg11-d29\"\naddress = 5\nmemory = \"m\"\n";
    std::fs::write(&plant, format!("[[bus]]\nname = \"b\"\n{device}")).expect("written");
    let output = codewheel(&["run", plant.to_str().expect("text"), "--listen", &address]);
    assert_eq!(output.status.code(), Some(3));
    assert!(!folder.path().join("m").exists(), "nothing was started");
    let message = stderr(&output);
    assert!(message.contains(&address) && message.contains("another port"), "{message}");
    assert!(output.stdout.is_empty());
}

#[test]
fn options_of_the_page_that_make_no_sense_are_refused() {
    for (options, part) in [
        (&["--listen", "8080"][..], "127.0.0.1:9000"),
        (&["--token", "short"], "openssl rand -hex 16"),
        (&["--no-page", "--read-only"], "--read-only"),
        (&["--no-page", "models"], "behind `run`"),
    ] {
        let output = codewheel(options);
        assert_eq!(output.status.code(), Some(2), "{options:?}");
        assert!(stderr(&output).contains(part), "{options:?}: {}", stderr(&output));
    }
}

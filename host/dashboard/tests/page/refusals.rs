//! Who is not let in, over the wire; the rules one by one stand beside the gate.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};

use codewheel_dashboard::{Dashboard, Settings, StartError};

use crate::client::Page;

const TOKEN: &str = "0123456789abcdef";

#[test]
fn a_page_whose_name_was_pointed_at_this_machine_gets_nothing() {
    let page = Page::start();
    let port = page.address().port();
    for path in ["/", "/api/v1/plant", "/api/v1/events"] {
        let head = format!("GET {path} HTTP/1.1\nHost: evil.example:{port}");
        let detail = page.send(&head, "").problem(421);
        assert!(detail.contains("evil.example") && detail.contains("127.0.0.1"), "{detail}");
    }
    let head = format!("GET /api/v1/plant HTTP/1.1\nHost: localhost:{port}");
    assert_eq!(page.send(&head, "").status, 200);
}

#[test]
fn another_site_can_neither_read_nor_write() {
    let page = Page::start();
    let address = page.address();
    let path = "/api/v1/buses/line/devices/drive/shaft";
    for foreign in ["Origin: http://evil.example", "Origin: null", "Sec-Fetch-Site: cross-site"] {
        let head = format!(
            "POST {path} HTTP/1.1\nHost: {address}\nContent-Type: application/json\n{foreign}"
        );
        page.send(&head, r#"{"by":100}"#).problem(403);
        let head = format!("GET /api/v1/plant HTTP/1.1\nHost: {address}\n{foreign}");
        let answer = page.send(&head, "");
        answer.problem(403);
        assert_eq!(answer.header("access-control-allow-origin"), None);
    }
    let head = format!(
        "OPTIONS {path} HTTP/1.1\nHost: {address}\nOrigin: http://evil.example\n\
         Access-Control-Request-Method: PUT"
    );
    page.send(&head, "").problem(403);
    let head = format!("POST {path} HTTP/1.1\nHost: {address}\nContent-Type: text/plain");
    let detail = page.send(&head, r#"{"by":100}"#).problem(415);
    assert!(detail.contains("application/json"), "{detail}");
}

#[test]
fn a_body_that_is_too_large_or_makes_no_sense_is_refused_in_words() {
    let page = Page::start();
    let shaft = "line/devices/drive/shaft";
    let large = format!(r#"{{"motion":"{}"}}"#, "x".repeat(65_536));
    let detail = page.ask("POST", shaft, &large).problem(413);
    assert!(detail.contains("65536"), "{detail}");
    for (path, body) in [
        (shaft, ""),
        (shaft, "{"),
        (shaft, "{}"),
        (shaft, "[]"),
        (shaft, r#"{"by":1.5}"#),
        (shaft, r#"{"by":1,"to":2}"#),
        (shaft, r#"{"by":99999999999999999999}"#),
        (shaft, r#"{"to":-1}"#),
        (shaft, r#"{"jump":1}"#),
        (shaft, r#"{"stop":false}"#),
        ("line/devices/drive/preset", r#"{"value":-1}"#),
        ("line/devices/drive/preset", r#"{"value":4294967296}"#),
        ("line/devices/drive/preset", r#"{"value":1,"more":1}"#),
        ("line/devices/drive/faults", r#"{"steps":1}"#),
        ("line/devices/drive/faults", r#"{"kind":"jump at=3s"}"#),
    ] {
        let method = "POST";
        let detail = page.ask(method, path, body).problem(422);
        assert!(!detail.is_empty() && !detail.contains("Deserialize"), "{body}: {detail}");
    }
    for (path, body) in [
        ("power", r#"{"on":1}"#),
        ("switches", r#"{"rotary":[1,2,3]}"#),
        ("switches", r#"{"rotary":[1,256]}"#),
        ("objects/steps-per-turn", r#"{"value":null}"#),
        ("objects/steps-per-turn", r#"{"value":[1]}"#),
    ] {
        page.ask("PUT", &format!("line/devices/drive/{path}"), body).problem(422);
    }
    let deep = "[".repeat(60_000);
    page.ask("PUT", "line/devices/drive/power", &deep).problem(422);
}

#[test]
fn whoever_asks_another_way_is_told_which_ways_there_are() {
    let page = Page::start();
    let detail = page.ask("POST", "line/devices/drive/power", "{}").problem(405);
    assert!(detail.contains("openapi.json"), "{detail}");
    let address = page.address();
    let head = format!("DELETE / HTTP/1.1\nHost: {address}");
    page.send(&head, "").problem(405);
    let detail = page.get("/api/v1/events?rate=21").problem(422);
    assert!(detail.contains("1 to 20"), "{detail}");
    page.get("/api/v1/events?rate=fast").problem(422);
    page.get("/api/v1/events?trace=nothing").problem(404);
    page.get("/api/v1/events?device=line").problem(404);
}

#[test]
fn a_read_only_page_shows_everything_and_changes_nothing() {
    let page = Page::with(Settings { read_only: true, ..Settings::default() });
    assert_eq!(page.json("/api/v1/plant")["read_only"], true);
    page.events("").next_of("state");
    for (method, path) in
        [("POST", "shaft"), ("PUT", "power"), ("DELETE", "faults/stuck"), ("POST", "save")]
    {
        let detail = page.ask(method, &format!("line/devices/drive/{path}"), "{}").problem(403);
        assert!(detail.contains("--read-only"), "{detail}");
    }
}

#[test]
fn a_token_opens_the_door_once_and_the_cookie_ever_after() {
    let token = TOKEN.parse().ok();
    let listen = Some(SocketAddr::from(([0, 0, 0, 0], 0)));
    let page = Page::with(Settings { token, listen, ..Settings::default() });
    let host = format!("127.0.0.1:{}", page.address().port());
    let get = |path: &str, more: &str| {
        page.send(&format!("GET {path} HTTP/1.1\nHost: {host}\n{more}"), "")
    };
    let refused = get("/api/v1/plant", "");
    let detail = refused.problem(401);
    assert!(detail.contains("?token=") && !detail.contains(TOKEN), "{detail}");
    assert_eq!(refused.header("www-authenticate"), Some("Bearer"));
    get("/", "").problem(401);
    assert_eq!(get("/api/v1/plant", &format!("Authorization: Bearer {TOKEN}")).status, 200);

    let door = get(&format!("/?token={TOKEN}"), "");
    assert_eq!(door.status, 200);
    let cookie = door.header("set-cookie").expect("a cookie");
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    assert!(!door.body.contains(TOKEN), "the page goes on without it");
    let pair = cookie.split(';').next().expect("a pair");
    assert_eq!(get("/", &format!("Cookie: {pair}")).status, 200);
    assert_eq!(get("/api/v1/plant", &format!("Cookie: {pair}")).status, 200);
    get("/?token=0123456789abcdee", "").problem(401);
}

#[test]
fn a_page_for_others_is_not_started_without_a_token() {
    let plant = codewheel_plant::Plant::parse(
        "[[bus]]\nname = \"b\"\n[[device]]\nmodel = \"amg11-d29\"\naddress = 5\n",
        "test.toml",
        std::path::Path::new(""),
    );
    let running = plant.expect("a plant").start(std::time::Duration::from_secs(1)).expect("runs");
    let listen = Some(SocketAddr::from(([0, 0, 0, 0], 0)));
    let settings = Settings { listen, ..Settings::default() };
    let error = Dashboard::start(running.into(), settings).expect_err("no token");
    assert!(matches!(error, StartError::NeedsToken(_)));
    assert!(error.to_string().contains("--token TOKEN"), "{error}");
}

#[test]
fn the_33rd_stream_is_refused_and_there_is_room_when_one_closes() {
    let page = Page::start();
    let mut open: Vec<_> = (0..32).map(|_| page.events("")).collect();
    let detail = page.get("/api/v1/events").problem(503);
    assert!(detail.contains("32"), "{detail}");
    assert_eq!(page.get("/api/v1/plant").status, 200, "the rest goes on");
    drop(open.pop());
    // The server notices that when it writes next.
    open.iter_mut().for_each(|events| drop(events.next_of("state")));
    for _ in 0..200 {
        open.iter_mut().for_each(|events| drop(events.next_of("state")));
        let address = page.address();
        let head = format!("HEAD /api/v1/events HTTP/1.1\nHost: {address}");
        if page.send(&head, "").status == 200 {
            return;
        }
    }
    panic!("a stream that was closed is still counted");
}

#[test]
fn who_connects_when_all_connections_are_taken_waits_until_one_is_free() {
    let page = Page::start();
    let mut idle: Vec<_> =
        (0..128).map(|_| TcpStream::connect(page.address()).expect("a connection")).collect();
    let mut late = TcpStream::connect(page.address()).expect("a connection");
    let head = format!("GET /api/v1/plant HTTP/1.1\r\nHost: {}\r\n\r\n", page.address());
    late.write_all(head.as_bytes()).expect("it is taken");
    let waits = std::time::Duration::from_millis(200);
    late.set_read_timeout(Some(waits)).expect("a time-out");
    let mut answer = [0; 12];
    late.read_exact(&mut answer).expect_err("there is no room");
    idle.pop();
    late.set_read_timeout(None).expect("no time-out");
    late.read_exact(&mut answer).expect("there is room");
    assert_eq!(&answer, b"HTTP/1.1 200");
}

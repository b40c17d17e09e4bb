use std::io::{Read, Write};
use std::time::{Duration, Instant};

use super::{Answer, LONG, Serving};
use crate::serve::{ServeOptions, Shutdown, serve};

const TOKEN: &str = "0123456789abcdef0123456789abcdef";

fn guarded() -> Serving {
    Serving::with(|options| options.token = Some(TOKEN.parse().unwrap()))
}

/// Everything that shows or changes something of the rig.
const GUARDED: [&str; 7] = [
    "/api/v1/state",
    "/api/v1/events",
    "/api/v1/preview.jpg",
    "/api/v1/sessions",
    "/api/v1/sessions/x/video",
    "/api/v1/sessions/x.tar",
    "/api/v1/sessions/x/mask.png",
];

#[test]
fn without_the_token_only_the_bare_page_is_served() {
    let serving = guarded();
    for path in GUARDED {
        let refused = serving.get(path);
        assert_eq!(refused.status, 401, "{path}");
        assert_eq!(refused.header("www-authenticate"), Some("Bearer"));
        assert!(refused.error().contains("token"), "{path}");
    }
    let start = r#"{"command":"start","object":"mug"}"#;
    assert_eq!(serving.command(start).status, 401);
    assert!(serving.rig.told.lock().unwrap().is_empty());
    assert_eq!(serving.get("/").status, 200);
    assert_eq!(serving.get("/page.js").status, 200);
    assert_eq!(serving.get("/nothing").status, 401);
}

#[test]
fn a_program_gets_in_with_the_token_as_bearer() {
    let serving = guarded();
    let bearer = format!("Authorization: Bearer {TOKEN}");
    let ask = |line: &str| serving.ask("GET", "/api/v1/state", &[line], b"").status;
    assert_eq!(ask(&bearer), 200);
    assert_eq!(
        ask("Authorization: Bearer 0123456789abcdef0123456789abcdee"),
        401
    );
    assert_eq!(ask("Authorization: Bearer "), 401);
    assert_eq!(
        serving.get(&format!("/api/v1/state?token={TOKEN}")).status,
        401
    );
}

#[test]
fn a_browser_gets_the_token_as_a_cookie_and_goes_on_without_it_in_the_url() {
    let serving = guarded();
    assert_eq!(
        serving.told.url,
        format!("http://{}/?token={TOKEN}", serving.host())
    );
    let entry = serving.get(&format!("/?token={TOKEN}"));
    assert_eq!((entry.status, entry.header("location")), (303, Some("/")));
    let cookie = entry.header("set-cookie").unwrap();
    for part in ["HttpOnly", "SameSite=Strict", "Path=/"] {
        assert!(cookie.contains(part), "{cookie}");
    }
    let pair = format!("Cookie: {}", cookie.split(';').next().unwrap());
    assert_eq!(
        serving.ask("GET", "/api/v1/state", &[&pair], b"").status,
        200
    );
    let wrong = serving.get("/?token=0123456789abcdef");
    assert_eq!((wrong.status, wrong.header("set-cookie")), (401, None));
}

#[test]
fn an_address_for_other_machines_always_has_a_token() {
    let serving = Serving::with(|options| options.address = "0.0.0.0:0".parse().unwrap());
    let (_, token) = serving.told.url.split_once("/?token=").unwrap();
    assert_eq!(token.len(), 32);
    let port = serving.told.address.port();
    let near = format!("127.0.0.1:{port}").parse().unwrap();
    assert_eq!(
        super::ask(near, "GET", "/api/v1/state", &[], b"").status,
        401
    );
    let bearer = format!("Authorization: Bearer {token}");
    assert_eq!(
        super::ask(near, "GET", "/api/v1/state", &[&bearer], b"").status,
        200
    );
}

#[test]
fn foreign_hosts_and_origins_are_refused_even_with_the_token() {
    let serving = guarded();
    let bearer = format!("Authorization: Bearer {TOKEN}");
    for (line, status) in [
        ("Host: evil.example", 421),
        ("Host: 192.0.2.1", 421),
        ("Origin: http://evil.example", 403),
        ("Origin: null", 403),
        ("Origin: http://127.0.0.1:1", 403),
    ] {
        let json = "Content-Type: application/json";
        let body = br#"{"command":"stop"}"#;
        let refused = serving.ask("POST", "/api/v1/command", &[&bearer, json, line], body);
        assert_eq!(refused.status, status, "{line}");
        assert!(!refused.error().is_empty());
        assert_eq!(
            serving.ask("GET", "/", &[line], b"").status,
            status,
            "{line}"
        );
    }
    assert!(serving.rig.told.lock().unwrap().is_empty());
    let own = format!("Origin: http://{}", serving.host());
    let body = br#"{"command":"stop"}"#;
    let headers = [bearer.as_str(), "Content-Type: application/json", &own];
    assert_eq!(
        serving
            .ask("POST", "/api/v1/command", &headers, body)
            .status,
        202
    );
}

#[test]
fn a_body_that_a_foreign_page_could_send_unasked_is_refused() {
    let serving = Serving::start();
    let body = br#"{"command":"stop"}"#;
    for kind in ["text/plain", "application/x-www-form-urlencoded"] {
        let header = format!("Content-Type: {kind}");
        let refused = serving.ask("POST", "/api/v1/command", &[&header], body);
        assert_eq!(refused.status, 415, "{kind}");
    }
    assert_eq!(
        serving.ask("POST", "/api/v1/command", &[], body).status,
        415
    );
    assert!(serving.rig.told.lock().unwrap().is_empty());
}

#[test]
fn oversized_requests_are_refused() {
    let serving = Serving::start();
    let json = "Content-Type: application/json";
    let body = vec![b' '; 17 * 1024];
    let refused = serving.ask("POST", "/api/v1/command", &[json], &body);
    assert_eq!(refused.status, 413);
    assert!(refused.error().contains("16384"));
    let many = vec!["X-Filler: 1"; 200];
    assert_eq!(serving.ask("GET", "/", &many, b"").status, 431);
    let long = format!("/{}", "a".repeat(100_000));
    assert!(matches!(serving.get(&long).status, 414 | 431));
}

#[test]
fn other_methods_and_paths_are_refused_in_json() {
    let serving = Serving::start();
    let refused = serving.ask("DELETE", "/api/v1/state", &[], b"");
    assert_eq!(
        (refused.status, refused.header("allow")),
        (405, Some("GET,HEAD"))
    );
    assert!(refused.error().contains("DELETE"));
    assert_eq!(serving.get("/api/v1/command").status, 405);
    let refused = serving.get("/api/v2/state");
    assert_eq!(refused.status, 404);
    assert!(refused.error().contains("/api/v2/state"));
}

#[test]
fn every_answer_forbids_the_browser_what_the_page_does_not_need() {
    let serving = Serving::start();
    for path in ["/", "/page.js", "/api/v1/state", "/nothing"] {
        let answer = serving.get(path);
        let policy = answer.header("content-security-policy").unwrap();
        assert!(policy.contains("default-src 'none'"), "{path}");
        assert!(policy.contains("frame-ancestors 'none'"), "{path}");
        assert!(!policy.contains("unsafe"), "{path}");
        assert_eq!(answer.header("x-content-type-options"), Some("nosniff"));
        assert_eq!(
            answer.header("cross-origin-resource-policy"),
            Some("same-origin")
        );
        assert_eq!(answer.header("cache-control"), Some("no-store"), "{path}");
    }
}

fn impatient() -> Serving {
    Serving::with(|options| {
        // Long enough for a whole request on a busy machine.
        options.limits.connections.head = Duration::from_secs(3);
        options.limits.body = Duration::from_secs(3);
    })
}

/// Feeds a connection byte by byte until the server closes it; gives what it answered.
fn drip(serving: &Serving, head: &str) -> String {
    let mut socket = serving.connect();
    socket.write_all(head.as_bytes()).unwrap();
    socket
        .set_read_timeout(Some(Duration::from_millis(50)))
        .unwrap();
    let (mut heard, began) = (Vec::new(), Instant::now());
    while began.elapsed() < LONG {
        let mut buffer = [0; 1024];
        let written = socket.write_all(b"a");
        match socket.read(&mut buffer) {
            Ok(0) => return String::from_utf8(heard).unwrap(),
            Ok(count) => heard.extend_from_slice(&buffer[..count]),
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock && written.is_ok() => {}
            Err(_) => return String::from_utf8(heard).unwrap(),
        }
    }
    panic!("the server held on to a client that never finishes");
}

#[test]
fn a_head_or_body_that_drips_is_cut_off() {
    let serving = impatient();
    drip(&serving, "GET / HTTP/1.1\r\nHost: ");
    let head = format!(
        "POST /api/v1/command HTTP/1.1\r\nHost: {}\r\nContent-Type: application/json\r\nContent-Length: 9999\r\n\r\n",
        serving.host()
    );
    let answer = drip(&serving, &head);
    assert!(answer.starts_with("HTTP/1.1 408 "), "{answer}");
}

#[test]
fn a_connection_that_lies_idle_is_closed() {
    let serving = impatient();
    let mut silent = serving.connect();
    assert_eq!(silent.read(&mut [0]).unwrap(), 0, "before any request");
    let mut socket = serving.connect();
    let head = format!("GET /icon.svg HTTP/1.1\r\nHost: {}\r\n\r\n", serving.host());
    socket.write_all(head.as_bytes()).unwrap();
    let mut answer = Answer::head(socket);
    answer.rest();
    assert_eq!(answer.status, 200, "and closed after it");
}

#[test]
fn connections_beyond_the_limit_wait_until_others_end() {
    let serving = Serving::with(|options| {
        options.limits.connections.connections = 3;
        options.limits.connections.head = Duration::from_millis(800);
    });
    let began = Instant::now();
    let idle: Vec<_> = (0..6).map(|_| serving.connect()).collect();
    assert_eq!(serving.get("/api/v1/state").status, 200);
    assert!(
        began.elapsed() > Duration::from_millis(700),
        "{:?}",
        began.elapsed()
    );
    drop(idle);
}

#[test]
fn the_server_ends_whoever_still_listens() {
    let mut serving = Serving::start();
    let events = super::begin(&serving, "/api/v1/events");
    let stream = super::begin(&serving, "/api/v1/preview.jpg?after=0");
    let _half = serving.connect().write_all(b"GET / HT");
    // Comes back while all of them are connected.
    serving.stop();
    drop((events, stream));
}

#[test]
fn an_address_that_is_taken_is_told() {
    let serving = Serving::start();
    let options = ServeOptions::at(serving.told.address);
    let taken = serve(serving.rig.clone(), options, &Shutdown::new(), |_| {
        panic!("served")
    });
    let error = taken.unwrap_err();
    assert_eq!(error.address, serving.told.address);
    assert!(error.to_string().contains(&serving.host()), "{error}");
}

#[test]
fn garbage_on_the_wire_is_answered_or_closed_and_the_next_client_served() {
    let serving = Serving::start();
    for garbage in [
        &b"\x16\x03\x01\x02\x00"[..],
        b"\r\n\r\n\r\n",
        b"GET\r\n\r\n",
        b"GET / HTTP/9\r\n\r\n",
    ] {
        let mut socket = serving.connect();
        socket.write_all(garbage).unwrap();
        socket.shutdown(std::net::Shutdown::Write).unwrap();
        let _ = socket.read_to_end(&mut Vec::new());
    }
    assert_eq!(serving.get("/api/v1/state").status, 200);
}

#[test]
fn connections_that_say_nothing_keep_nobody_away() {
    let serving = Serving::with(|options| {
        options.limits.connections.connections = 20;
        // Long enough for a first byte on a busy machine.
        options.limits.connections.first_byte = Duration::from_secs(1);
        // A request that has begun may take long.
        options.limits.connections.head = 10 * LONG;
    });
    let idle: Vec<_> = (0..20).map(|_| serving.connect()).collect();
    assert_eq!(serving.get("/").status, 200);
    drop(idle);
}

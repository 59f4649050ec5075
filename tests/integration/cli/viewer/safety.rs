//! Refusals of the viewer: other hosts, other sites, other files, and invalid requests.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use serde_json::json;

use super::{PATIENCE, SCENE, Viewer};
use crate::support::Sandbox;

/// Protects: only requests with the page's address on this machine are served: another token,
/// another host and pages of other sites get nothing, and the page loads nothing from elsewhere.
#[test]
fn only_the_page_is_answered() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let viewer = Viewer::start(&sandbox, &["room.scene.toml", "--spp", "4"]);
    let (host, token) = (viewer.host.clone(), viewer.token.clone());
    assert!(host.starts_with("127.0.0.1:"), "{host}");
    let port = host.split_once(':').expect("a port").1;
    let path = |label: &str| format!("/{token}/{label}");
    let ask = |method: &str, path: &str, headers: &[(&str, &str)], body: &str| {
        viewer.ask(method, path, headers, body).status
    };
    let page = viewer.get("");
    assert_eq!(page.status, 200);
    for part in [
        "Content-Security-Policy: default-src 'none'",
        "frame-ancestors 'none'",
        "nosniff",
        "no-store",
    ] {
        assert!(page.head.contains(part), "{part}: {}", page.head);
    }
    for text in [
        page.text(),
        viewer.get("page.js").text(),
        viewer.get("page.css").text(),
    ] {
        assert!(
            !text
                .replace("http://www.w3.org/2000/svg", "")
                .contains("//www"),
            "nothing is fetched from elsewhere"
        );
        assert!(
            !text
                .replace("http://www.w3.org/2000/svg", "")
                .contains("http"),
            "nothing is fetched from elsewhere"
        );
    }
    let other = "0".repeat(32);
    for wrong in [
        "/".to_owned(),
        "/status".to_owned(),
        format!("/{other}/"),
        format!("/{}/", &token[1..]),
        format!("/{token}0/"),
    ] {
        assert_eq!(ask("GET", &wrong, &[], ""), 403, "{wrong}");
    }
    // Through a tunnel, the page has another port, and a name of this machine.
    for tunnel in ["localhost:9", "127.0.0.1:9", "[::1]:9", "localhost"] {
        let own = format!("http://{tunnel}");
        let headers = [("Host", tunnel), ("Origin", &own)];
        assert_eq!(ask("GET", &path(""), &headers[..1], ""), 200, "{tunnel}");
        let body = r#"{ "flags": [] }"#;
        assert_eq!(
            ask("POST", &path("request"), &headers, body),
            200,
            "{tunnel}"
        );
        let other = [("Host", tunnel), ("Origin", "http://localhost:10")];
        assert_eq!(ask("POST", &path("request"), &other, body), 403, "{tunnel}");
    }
    for name in [
        "evil.example",
        &format!("evil.example:{port}"),
        "localhost:",
        "localhost:99999",
        &format!("127.0.0.1.evil.example:{port}"),
    ] {
        assert_eq!(
            ask("GET", &path("status?after=0"), &[("Host", name)], ""),
            403,
            "{name}"
        );
    }
    let own = format!("http://{host}");
    let body = r#"{ "flags": [] }"#;
    assert_eq!(
        ask("POST", &path("request"), &[("Origin", &own)], body),
        200
    );
    for origin in [
        "http://evil.example",
        "null",
        "https://127.0.0.1",
        &format!("http://127.0.0.1.evil.example:{port}"),
    ] {
        assert_eq!(
            ask("POST", &path("request"), &[("Origin", origin)], body),
            403,
            "{origin}"
        );
        assert_eq!(
            ask("GET", &path("picture"), &[("Origin", origin)], ""),
            403,
            "{origin}"
        );
    }
    assert_eq!(ask("POST", &path("request"), &[], body), 403);
    assert_eq!(
        ask(
            "POST",
            &path("request"),
            &[("Origin", &own), ("Sec-Fetch-Site", "cross-site")],
            body
        ),
        403
    );
    assert_eq!(
        ask(
            "GET",
            &path("picture"),
            &[("Sec-Fetch-Site", "same-site")],
            ""
        ),
        403
    );
    for path in [
        "../room.scene.toml",
        "%2e%2e/room.scene.toml",
        "/etc/passwd",
        "room.scene.toml",
        "page.js/../../x",
    ] {
        assert_eq!(viewer.get(path).status, 404, "{path}");
    }
    let wish = |flags| viewer.post("request", &json!({ "flags": flags })).status;
    assert_eq!(wish(json!([["output", "a.png"]])), 400);
    assert_eq!(wish(json!([["env", "/etc/passwd"]])), 400);
    assert_eq!(wish(json!([["spp", "4", "5"]])), 400);
    assert_eq!(sandbox.names(), ["room.scene.toml"]);
}

/// Protects: a saved picture is that of the command, with its metadata, and replaces nothing
/// without consent: neither another file, nor the scene, nor any file in another folder.
#[test]
fn saving_replaces_nothing() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    sandbox.write("mine.png", "mine");
    let viewer = Viewer::start(&sandbox, &["room.scene.toml", "--spp", "16"]);
    let status = viewer.until("the end", |status| status["phase"] == "done");
    let save = |name: &str, replace: bool| {
        viewer.post("save", &json!({ "name": name, "replace": replace }))
    };
    let refused = save("mine.png", false);
    assert_eq!(
        (refused.status, refused.text().as_str()),
        (409, "mine.png exists already\n")
    );
    for name in [
        "../out.png",
        "/tmp/out.png",
        "a/b.png",
        ".hidden.png",
        "",
        "-",
        "a",
        "a.gif",
        "a.txt",
        "room.scene.toml",
        "a\0.png",
    ] {
        let refused = save(name, true);
        assert_eq!(refused.status, 400, "{name}: {}", refused.text());
    }
    assert_eq!(
        std::fs::read(sandbox.path("mine.png")).expect("a file"),
        b"mine"
    );
    assert_eq!(sandbox.names(), ["mine.png", "room.scene.toml"]);
    assert_eq!(save("own.png", false).status, 200);
    assert_eq!(save("own.png", false).status, 409);
    assert_eq!(save("mine.png", true).status, 200);
    assert_eq!(save("own.exr", false).status, 200);
    sandbox
        .run(&[
            "render",
            "room.scene.toml",
            "--spp",
            "16",
            "-o",
            "r.png",
            "-o",
            "r.exr",
            "-q",
        ])
        .exits_with(0);
    for (own, other) in [
        ("own.png", "r.png"),
        ("mine.png", "r.png"),
        ("own.exr", "r.exr"),
    ] {
        assert_eq!(sandbox.picture(own), sandbox.picture(other), "{own}");
    }
    let command = status["command"].as_str().expect("a command");
    assert_eq!(sandbox.stored("own.png").metadata().command, command);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("mine.png", sandbox.path("link.png")).expect("a link");
        assert_eq!(save("link.png", true).status, 400);
    }
}

/// Protects: after any bytes the program continues, prints nothing and writes nothing; 200
/// requests, half of them noise and half valid ones with a change, truncation, duplication or
/// insertion.
#[test]
fn what_is_no_request_does_nothing() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let mut viewer = Viewer::start(&sandbox, &["room.scene.toml", "--spp", "4"]);
    viewer.until("the end", |status| status["phase"] == "done");
    let mut state = 7_u64;
    let mut draw = |maximum: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % maximum
    };
    let body = r#"{ "name": "x.png", "replace": true }"#;
    let right = format!(
        "POST /{}/save HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Length: {}\r\n\r\n{body}",
        viewer.token,
        body.len(),
        host = viewer.host
    );
    let head = right.find("\r\nOrigin").expect("a header");
    for i in 0..200 {
        let mut bytes: Vec<u8> = match i % 2 {
            0 => (0..draw(300)).map(|_| draw(256) as u8).collect(),
            // Without the origin, no change makes the request valid.
            _ => right
                .replacen(&format!("Origin: http://{}\r\n", viewer.host), "", 1)
                .into_bytes(),
        };
        if i % 2 == 1 {
            for _ in 0..=draw(4) {
                let at = draw(bytes.len());
                match draw(4) {
                    0 => bytes[at] = draw(256) as u8,
                    1 => bytes.truncate(at.max(1)),
                    2 => bytes.extend_from_slice(&right.as_bytes()[..head].repeat(1 + draw(80))),
                    _ => (0..draw(3000))
                        .for_each(|_| bytes.insert(at, b"\r\n :{}[]\0\xff/%0"[draw(13)])),
                }
            }
        }
        // The server would wait for the claimed length of a longer request.
        let mut whole = bytes.clone();
        whole.extend_from_slice(b"\r\n\r\n");
        if let Some(response) = viewer.send(&whole) {
            assert!(
                response.status >= 400,
                "{}: {:?}",
                response.status,
                String::from_utf8_lossy(&bytes)
            );
        }
    }
    assert_eq!(viewer.get("page.js").status, 200);
    assert_eq!(sandbox.names(), ["room.scene.toml"]);
    viewer.child.kill().expect("it runs");
    let mut message = String::new();
    viewer
        .child
        .stderr
        .take()
        .expect("a pipe")
        .read_to_string(&mut message)
        .expect("text");
    assert_eq!(message, "");
}

/// Protects: the page is served while other programs of this machine hold as many connections as
/// they like: silent ones, halves of requests, and requests without the token. Silent connections
/// end after a second.
#[test]
fn other_programs_take_no_place() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let viewer = Viewer::start(&sandbox, &["room.scene.toml", "--spp", "4"]);
    viewer.until("the end", |status| status["phase"] == "done");
    let texts = [
        "",
        "GET / HTTP/1.1\r\nHost: ",
        "GET /wrong/ HTTP/1.1\r\nHost: a\r\n\r\n",
    ];
    let began = Instant::now();
    let mut others: Vec<TcpStream> = (0..150)
        .map(|i| {
            let mut stream = TcpStream::connect(&viewer.host).expect("the program listens");
            stream.set_read_timeout(Some(PATIENCE)).expect("a time");
            // The program may have closed the connection already.
            let _ = stream.write_all(texts[i % 3].as_bytes());
            stream
        })
        .collect();
    for _ in 0..5 {
        assert_eq!(viewer.get("page.js").status, 200);
    }
    // A connection that was reset ends with an error.
    let mut response = String::new();
    let _ = others
        .pop()
        .expect("connections")
        .read_to_string(&mut response);
    others.iter_mut().for_each(|stream| {
        let _ = stream.read_to_end(&mut Vec::new());
    });
    assert!(response.starts_with("HTTP/1.1 403"), "{response}");
    assert!(
        began.elapsed() < Duration::from_millis(4500),
        "{:?}",
        began.elapsed()
    );
}

/// Protects: requests that are refused because too many are in progress take no place of later
/// ones: when the others have ended, the page is served again.
#[test]
fn refused_requests_take_no_place() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let viewer = Viewer::start(&sandbox, &["room.scene.toml", "--spp", "4"]);
    let unfinished = format!(
        "POST /{}/request HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Length: 1\r\n\r\n",
        viewer.token,
        host = viewer.host
    );
    // A server on a busy machine may end some requests before it has read the last ones of a batch.
    let began = Instant::now();
    let is_early = || began.elapsed() < Duration::from_secs(60);
    let mut others = Vec::new();
    while viewer.get("page.js").status != 503 {
        assert!(is_early(), "no 503");
        others.extend((0..40).map(|_| {
            let mut stream = TcpStream::connect(&viewer.host).expect("the program listens");
            // The program may have closed the connection already.
            let _ = stream.write_all(unfinished.as_bytes());
            stream
        }));
    }
    for _ in 0..40 {
        viewer.get("page.js");
    }
    drop(others);
    while viewer.get("page.js").status != 200 {
        assert!(is_early(), "no 200");
    }
}

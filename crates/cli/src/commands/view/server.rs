//! HTTP/1.1 server of the viewer's page, for this machine alone: a request per connection, limited in
//! size and time.

use std::collections::VecDeque;
use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use std::{io, thread};

use httparse::{EMPTY_HEADER, Status};
use serde::Deserialize;
use serde_json::json;

use crate::commands::view::flags::ViewCommand;
use crate::commands::view::shared::{SaveRequest, SharedView, ViewJob, ViewRequest};

/// Largest number of simultaneous requests of the page.
const MOST_REQUESTS: usize = 32;
/// Largest number of connections without the page's token. A further connection closes the oldest
/// of them, so that no number of other programs keeps the page waiting.
const MOST_UNKNOWN: usize = 64;
/// Longest wait for a new status. After this time the page gets the unchanged status.
const STATUS_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest wait for a saved file. A denoising in progress may delay the file.
const SAVE_TIMEOUT: Duration = Duration::from_secs(120);

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// HTTP server of the viewer's page.
pub struct ViewServer {
    listener: TcpListener,
    /// Random token in the page's address, without which requests are refused.
    token: String,
    shared: Arc<SharedView>,
}

/// Connections whose request has not shown the token yet, oldest first, by number.
#[derive(Default)]
struct UnknownConnections(Mutex<VecDeque<(u64, TcpStream)>>);

impl UnknownConnections {
    fn lock(&self) -> MutexGuard<'_, VecDeque<(u64, TcpStream)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a connection. Of too many connections, the oldest is closed, which ends its reads.
    fn add(&self, number: u64, stream: TcpStream) {
        let mut all = self.lock();
        all.push_back((number, stream));
        if all.len() > MOST_UNKNOWN {
            // A failure means that the connection is closed already.
            let _ = all
                .pop_front()
                .map(|(_, oldest)| oldest.shutdown(Shutdown::Both));
        }
    }

    fn remove(&self, number: u64) {
        self.lock().retain(|(other, _)| *other != number);
    }
}

/// Generates a random token of 128 bits. Each half is a hash value of the standard library, whose
/// hash function has a random key from the system. Hash values of different inputs do not reveal
/// one another.
fn generate_token() -> String {
    let keyed = RandomState::new();
    (0..2)
        .map(|half: u8| format!("{:016x}", keyed.hash_one(half)))
        .collect()
}

impl ViewServer {
    /// Opens the server's port on the loopback interface; port 0 selects a free port.
    pub fn start(port: u16, shared: Arc<SharedView>) -> io::Result<Self> {
        Ok(Self {
            listener: TcpListener::bind((Ipv4Addr::LOCALHOST, port))?,
            token: generate_token(),
            shared,
        })
    }

    /// Returns the URL of the page, and the server's port.
    pub fn address(&self) -> io::Result<(String, u16)> {
        let address = self.listener.local_addr()?;
        Ok((format!("http://{address}/{}/", self.token), address.port()))
    }

    /// Serves requests, each on a thread of its own, until the program ends.
    pub fn serve(self) {
        let (server, unknown, busy) = (
            Arc::new(self),
            Arc::new(UnknownConnections::default()),
            Arc::new(AtomicUsize::new(0)),
        );
        for (number, stream) in (0..).zip(server.listener.incoming()) {
            let copied = stream.and_then(|stream| Ok((stream.try_clone()?, stream)));
            let Ok((copy, mut stream)) = copied else {
                // The process may have no free file descriptor; a pause gives other connections
                // time to close.
                thread::sleep(Duration::from_millis(50));
                continue;
            };
            unknown.add(number, copy);
            let (server, others, busy) = (server.clone(), unknown.clone(), busy.clone());
            let respond = move || server.handle_connection(&mut stream, (number, &others), &busy);
            if thread::Builder::new().spawn(respond).is_err() {
                unknown.remove(number);
            }
        }
    }

    fn handle_connection(
        &self,
        stream: &mut TcpStream,
        (number, unknown): (u64, &UnknownConnections),
        busy: &AtomicUsize,
    ) {
        let mut is_own = false;
        let request = read_request(stream, |head| {
            self.check_head(head)?;
            unknown.remove(number);
            is_own = true;
            if busy.fetch_add(1, Ordering::Relaxed) >= MOST_REQUESTS {
                return Err(HttpResponse::with_text(503, "too many requests"));
            }
            Ok(())
        });
        let response = match request {
            Ok(request) => self.respond_to_request(&request),
            Err(refusal) => refusal,
        };
        // A failed write means that the browser closed the connection.
        let _ = response.send(stream);
        if is_own {
            busy.fetch_sub(1, Ordering::Relaxed);
        } else {
            unknown.remove(number);
        }
    }

    /// Refuses a request unless its host is this machine, its origin the page of that host, and its
    /// token that of the viewer. A page of another site can send requests to this server through a
    /// domain name that resolves to this machine. The port of the host is that of a tunnel, if the
    /// page is open on another machine.
    fn check_head(&self, request: &HttpRequest) -> Result<(), HttpResponse> {
        let is_own = |origin: &str| origin.strip_prefix("http://") == Some(&request.host);
        let is_read = request.method == "GET";
        let refuse = |reason| Err(HttpResponse::with_text(403, reason));
        if !is_loopback(&request.host) {
            return refuse(
                "the Host header does not name this machine: open the address that the program printed, through a tunnel with localhost and the tunnel's port in it",
            );
        }
        if request
            .origin
            .as_deref()
            .is_some_and(|origin| !is_own(origin))
            || !is_read && request.origin.is_none()
        {
            return refuse("requests from pages of other sites are refused");
        }
        let site = request.fetch_site.as_deref().unwrap_or("none");
        let (token, path) = request.split_path();
        if !self.matches_token(token) {
            return refuse("wrong address: open the address that the program printed");
        }
        // A link on another site may open the page, if it contains the token; every other request
        // must come from the page itself.
        if !(["same-origin", "none"].contains(&site) || is_read && path.is_empty()) {
            return refuse("requests from pages of other sites are refused");
        }
        Ok(())
    }

    /// Returns the response to a request of the page.
    fn respond_to_request(&self, request: &HttpRequest) -> HttpResponse {
        match (request.method.as_str(), request.split_path().1) {
            ("GET", "") => HttpResponse::with_body("text/html; charset=utf-8", PAGE),
            ("GET", "page.css") => HttpResponse::with_body("text/css; charset=utf-8", STYLE),
            ("GET", "page.js") => HttpResponse::with_body("text/javascript; charset=utf-8", SCRIPT),
            ("GET", "status") => self.respond_status(&request.query),
            ("GET", "picture") => self.respond_picture(),
            ("POST", "request") => self.accept_view_request(&request.body),
            ("POST", "save") => self.queue_save(&request.body),
            ("POST", "measure") => self.queue_measurement(),
            ("GET" | "POST", _) => HttpResponse::with_text(404, "this address does not exist"),
            _ => HttpResponse::with_text(405, "only GET and POST are supported"),
        }
    }

    /// Whether a word equals the token, compared in constant time.
    fn matches_token(&self, word: &str) -> bool {
        let differs = word
            .bytes()
            .zip(self.token.bytes())
            .fold(0, |differs, (a, b)| differs | (a ^ b));
        word.len() == self.token.len() && differs == 0
    }

    /// Returns the viewer's status as soon as its number differs from the number in the query, or
    /// after a time limit.
    fn respond_status(&self, query: &str) -> HttpResponse {
        let reported = query
            .strip_prefix("after=")
            .and_then(|number| number.parse().ok())
            .unwrap_or(0);
        self.shared.record_page_request();
        HttpResponse::with_body(
            "application/json",
            self.shared.wait_for_newer_status(reported, STATUS_TIMEOUT),
        )
    }

    /// Returns the picture as bytes, with its number, its size and the edge of its pixels in a
    /// header.
    fn respond_picture(&self) -> HttpResponse {
        let frame = self.shared.current_frame();
        let [width, height] = frame.size;
        let headers = format!(
            "X-Picture: {} {width} {height} {}\r\n",
            frame.number, frame.edge
        );
        HttpResponse {
            headers,
            ..HttpResponse::with_body("application/octet-stream", frame.codes.clone())
        }
    }

    fn accept_view_request(&self, body: &[u8]) -> HttpResponse {
        let view_request: ViewRequest = match parse_json(body) {
            Ok(view_request) => view_request,
            Err(refusal) => return refusal,
        };
        match ViewCommand::check_page_flags(&view_request.flags) {
            Ok(()) => HttpResponse::with_body(
                "application/json",
                json!({ "request": self.shared.submit_request(view_request) }).to_string(),
            ),
            Err(failure) => HttpResponse::with_text(400, &failure.message),
        }
    }

    fn queue_save(&self, body: &[u8]) -> HttpResponse {
        let view_request: SaveRequest = match parse_json(body) {
            Ok(view_request) => view_request,
            Err(refusal) => return refusal,
        };
        let (sender, receiver) = sync_channel(1);
        if !self.shared.add_job(ViewJob::Save(view_request, sender)) {
            return HttpResponse::with_text(503, "too many jobs are waiting; try again later");
        }
        match receiver.recv_timeout(SAVE_TIMEOUT) {
            Ok((status, text)) => HttpResponse::with_text(status, &text),
            Err(_) => HttpResponse::with_text(503, "the program is busy and writes the file later"),
        }
    }

    fn queue_measurement(&self) -> HttpResponse {
        match self.shared.add_job(ViewJob::Measure) {
            true => HttpResponse::with_body("application/json", "{}"),
            false => HttpResponse::with_text(503, "too many jobs are waiting; try again later"),
        }
    }
}

/// Whether a `Host` header names this machine, with any port or none.
fn is_loopback(host: &str) -> bool {
    ["127.0.0.1", "localhost", "[::1]"]
        .into_iter()
        .filter_map(|name| host.strip_prefix(name))
        .any(|rest| {
            rest.is_empty()
                || rest
                    .strip_prefix(':')
                    .is_some_and(|port| port.parse::<u16>().is_ok())
        })
}

fn parse_json<'a, T: Deserialize<'a>>(body: &'a [u8]) -> Result<T, HttpResponse> {
    serde_json::from_slice(body).map_err(|error| {
        HttpResponse::with_text(400, &format!("the JSON of the request is invalid: {error}"))
    })
}

/// Largest size of a request's first line and headers together, in bytes.
const MOST_HEAD: usize = 8 << 10;
/// Largest number of headers of a request.
const MOST_HEADERS: usize = 48;
/// Largest size of a request's body, in bytes.
const MOST_BODY: usize = 16 << 10;
/// Time limit for the arrival of a request's head, which a browser on this machine sends at once.
const MOST_HEAD_TIME: Duration = Duration::from_secs(1);
/// Time limit for the arrival of a request's body, and for each write of a response.
const MOST_TIME: Duration = Duration::from_secs(5);

/// A parsed HTTP request.
#[derive(Debug, Default)]
pub struct HttpRequest {
    pub method: String,
    /// Path of the address, without the query after `?`.
    pub path: String,
    /// Query of the address, after `?`; empty without a query.
    pub query: String,
    pub host: String,
    pub origin: Option<String>,
    /// Relation of the requesting site to this server, as the browser reports it
    /// (`Sec-Fetch-Site`).
    pub fetch_site: Option<String>,
    pub body: Vec<u8>,
}

impl HttpRequest {
    /// Splits the path `/TOKEN/NAME` into token and name. Both are empty for any other path.
    pub fn split_path(&self) -> (&str, &str) {
        let path = self.path.strip_prefix('/');
        path.and_then(|path| path.split_once('/'))
            .unwrap_or_default()
    }
}

/// An HTTP response.
pub struct HttpResponse {
    pub status: u16,
    pub content_type: &'static str,
    /// Additional headers, each with its line break.
    pub headers: String,
    pub body: Vec<u8>,
}

impl HttpResponse {
    /// Creates a response of status 200 with a body of the content type `kind`.
    pub fn with_body(kind: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Self {
            status: 200,
            content_type: kind,
            headers: String::new(),
            body: body.into(),
        }
    }

    /// Creates a plain-text response with a status and a message.
    pub fn with_text(status: u16, reason: &str) -> Self {
        Self {
            status,
            ..Self::with_body("text/plain; charset=utf-8", format!("{reason}\n"))
        }
    }

    /// Sends the response. Its headers announce that the connection closes.
    pub fn send(&self, stream: &mut TcpStream) -> io::Result<()> {
        let Self {
            status,
            content_type: kind,
            headers,
            body,
        } = self;
        let head = format!(
            "HTTP/1.1 {status} {}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
            Content-Security-Policy: {CONTENT_SECURITY_POLICY}\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
            Cross-Origin-Resource-Policy: same-origin\r\nCross-Origin-Opener-Policy: same-origin\r\n{headers}\r\n",
            reason_phrase(*status),
            body.len(),
        );
        stream.set_write_timeout(Some(MOST_TIME))?;
        stream.write_all(head.as_bytes())?;
        stream.write_all(body)?;
        stream.flush()
    }
}

/// Content security policy of the page: it loads only its own script and style, connects only to
/// its own server, and may not be shown in a frame.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

fn reason_phrase(status: u16) -> &'static str {
    match status {
        200 => "OK",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        409 => "Conflict",
        413 => "Content Too Large",
        431 => "Request Header Fields Too Large",
        _ => "Service Unavailable",
    }
}

/// Reads a request from a connection. `check_head` decides by the request without its body whether
/// the body is read. The error is the response that refuses the request, also a malformed, too
/// long or too slow one.
pub fn read_request(
    stream: &mut TcpStream,
    check_head: impl FnOnce(&HttpRequest) -> Result<(), HttpResponse>,
) -> Result<HttpRequest, HttpResponse> {
    let deadline = Instant::now() + MOST_HEAD_TIME;
    let mut bytes = Vec::new();
    let (mut request, head, length) = loop {
        if let Some(parsed) = parse_request_head(&bytes)? {
            break parsed;
        }
        if bytes.len() > MOST_HEAD {
            return Err(HttpResponse::with_text(431, "the request is too long"));
        }
        receive_bytes(stream, deadline, &mut bytes)?;
    };
    check_head(&request)?;
    if length > MOST_BODY {
        return Err(HttpResponse::with_text(
            413,
            "the body of the request is too long",
        ));
    }
    let deadline = Instant::now() + MOST_TIME;
    while bytes.len() < head + length {
        receive_bytes(stream, deadline, &mut bytes)?;
    }
    request.body = bytes[head..head + length].to_vec();
    Ok(request)
}

/// Receives the next bytes of a request, and appends them to `bytes`.
fn receive_bytes(
    stream: &mut TcpStream,
    deadline: Instant,
    bytes: &mut Vec<u8>,
) -> Result<(), HttpResponse> {
    let late = || HttpResponse::with_text(408, "the request did not arrive in time");
    let left = deadline
        .checked_duration_since(Instant::now())
        .filter(|left| !left.is_zero())
        .ok_or_else(late)?;
    let mut piece = [0; 4096];
    let read = stream
        .set_read_timeout(Some(left))
        .and_then(|()| stream.read(&mut piece));
    match read {
        Ok(0) => Err(HttpResponse::with_text(400, "the request is incomplete")),
        Ok(count) => {
            bytes.extend_from_slice(&piece[..count]);
            Ok(())
        }
        Err(error) if error.kind() == ErrorKind::Interrupted => Ok(()),
        Err(error) if [ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&error.kind()) => {
            Err(late())
        }
        Err(_) => Err(HttpResponse::with_text(400, "the request is incomplete")),
    }
}

/// Parses the head of a request: its first line and its headers. Returns the request without its
/// body, and two lengths in bytes, of the head and of the body; `None` while the head is
/// incomplete.
fn parse_request_head(bytes: &[u8]) -> Result<Option<(HttpRequest, usize, usize)>, HttpResponse> {
    let wrong = |reason: &str| HttpResponse::with_text(400, reason);
    let mut headers = [EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let head = match parsed.parse(bytes) {
        Ok(Status::Complete(head)) => head,
        Ok(Status::Partial) => return Ok(None),
        Err(httparse::Error::TooManyHeaders) => {
            return Err(HttpResponse::with_text(
                431,
                "the request has too many headers",
            ));
        }
        Err(error) => return Err(wrong(&format!("the request is malformed: {error}"))),
    };
    if head > MOST_HEAD {
        return Err(HttpResponse::with_text(431, "the request is too long"));
    }
    let (path, query) = match parsed.path.unwrap_or_default().split_once('?') {
        Some((path, query)) => (path, query),
        None => (parsed.path.unwrap_or_default(), ""),
    };
    let mut request = HttpRequest {
        method: parsed.method.unwrap_or_default().to_owned(),
        path: path.to_owned(),
        query: query.to_owned(),
        ..HttpRequest::default()
    };
    let (mut hosts, mut length) = (0, None);
    for header in parsed.headers.iter() {
        let text = || {
            std::str::from_utf8(header.value)
                .map(str::to_owned)
                .map_err(|_| wrong("a header is no UTF-8 text"))
        };
        match header.name.to_ascii_lowercase().as_str() {
            "host" => (request.host, hosts) = (text()?, hosts + 1),
            "origin" => request.origin = Some(text()?),
            "sec-fetch-site" => request.fetch_site = Some(text()?),
            // The length of a body must be unambiguous. Otherwise a proxy and this server could see
            // different ends of the same request.
            "transfer-encoding" => {
                return Err(wrong(
                    "the request has Transfer-Encoding, which is not supported",
                ));
            }
            "content-length" => {
                let value = text()?
                    .parse::<usize>()
                    .map_err(|_| wrong("the Content-Length of the request is no number"))?;
                if length.replace(value).is_some() {
                    return Err(wrong("the request has two Content-Length headers"));
                }
            }
            _ => {}
        }
    }
    if hosts != 1 {
        return Err(wrong("the request needs exactly one Host header"));
    }
    Ok(Some((request, head, length.unwrap_or(0))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: two programs have different tokens of 128 bits.
    #[test]
    fn tokens_differ() {
        let [one, other] = [generate_token(), generate_token()];
        assert!(
            one != other && one.len() == 32 && one[..16] != one[16..],
            "{one} {other}"
        );
    }

    /// Protects: only requests with this machine as host, the token, and the page as origin are
    /// served, whatever port a tunnel gives the page; a link reaches only the page itself.
    #[test]
    fn others_are_refused() {
        let server = ViewServer::start(0, Arc::default()).expect("a port that is free");
        let (host, path) = ("127.0.0.1:8000", format!("/{}/", server.token));
        let requested = |change: &dyn Fn(&mut HttpRequest)| {
            let mut request = HttpRequest {
                method: "GET".into(),
                path: path.clone(),
                host: host.to_owned(),
                ..HttpRequest::default()
            };
            change(&mut request);
            let refusal = server.check_head(&request).err();
            refusal
                .unwrap_or_else(|| server.respond_to_request(&request))
                .status
        };
        assert_eq!(requested(&|_| ()), 200);
        // A tunnel has a port of its own.
        for host in ["localhost:9", "localhost", "127.0.0.1:9", "[::1]:9"] {
            assert_eq!(
                requested(&|request| request.host = host.into()),
                200,
                "{host}"
            );
        }
        for host in [
            "evil.example",
            "localhost.evil.example:9",
            "localhost:x",
            "127.0.0.10:9",
        ] {
            assert_eq!(
                requested(&|request| request.host = host.into()),
                403,
                "{host}"
            );
        }
        assert_eq!(
            requested(&|request| request.origin = Some("http://localhost:9".into())),
            403
        );
        assert_eq!(
            requested(&|request| request.origin = Some("http://evil.example".into())),
            403
        );
        assert_eq!(
            requested(&|request| request.origin = Some("null".into())),
            403
        );
        assert_eq!(
            requested(&|request| request.origin = Some(format!("http://{}", request.host))),
            200
        );
        assert_eq!(
            requested(&|request| request.fetch_site = Some("cross-site".into())),
            200
        );
        for word in ["page.js", "picture"] {
            assert_eq!(requested(&|request| request.path.push_str(word)), 200);
            let elsewhere = |request: &mut HttpRequest| {
                request.path.push_str(word);
                request.fetch_site = Some("cross-site".into());
            };
            assert_eq!(requested(&elsewhere), 403);
        }
        assert_eq!(requested(&|request| request.path = "/".into()), 403);
        assert_eq!(
            requested(&|request| request.path = format!("/{}/", "0".repeat(32))),
            403
        );
        assert_eq!(
            requested(&|request| request.path = format!("/{}/", &server.token[1..])),
            403
        );
        assert_eq!(
            requested(&|request| request.path = format!("/{}0/", server.token)),
            403
        );
        assert_eq!(
            requested(&|request| request.path.push_str("../../etc/passwd")),
            404
        );
        assert_eq!(requested(&|request| request.method = "PUT".into()), 403);
        let post = |request: &mut HttpRequest| {
            (request.method, request.origin) =
                ("POST".into(), Some(format!("http://{}", request.host)));
            request.path.push_str("request");
        };
        let wish = |body: &str| {
            requested(&|request| {
                post(request);
                request.body = body.into();
            })
        };
        assert_eq!(wish(r#"{ "flags": [["spp", "4"]] }"#), 200);
        for wrong in [
            "",
            "{}",
            "[",
            r#"{ "flags": [["output", "x.png"]] }"#,
            r#"{ "flags": [], "more": 1 }"#,
        ] {
            assert_eq!(wish(wrong), 400, "{wrong}");
        }
        let without_origin = |request: &mut HttpRequest| {
            post(request);
            request.origin = None;
        };
        assert_eq!(requested(&without_origin), 403);
    }
}

#[cfg(test)]
mod http_tests {
    use super::*;

    /// Protects: well-formed requests are parsed; ambiguous requests, and requests larger than the
    /// page sends, are refused.
    #[test]
    fn requests_are_read_or_refused() {
        let status = |text: &str| {
            parse_request_head(text.as_bytes())
                .map(|parsed| parsed.is_some())
                .map_err(|refusal| refusal.status)
        };
        let Ok(Some((request, head, length))) = parse_request_head(
            b"POST /a/b?c=d HTTP/1.1\r\nhost: x:1\r\nOrigin: y\r\nContent-Length: 2\r\n\r\nok",
        ) else {
            panic!("a request")
        };
        assert_eq!(
            (
                request.method.as_str(),
                request.path.as_str(),
                request.query.as_str()
            ),
            ("POST", "/a/b", "c=d")
        );
        assert_eq!(
            (
                request.host.as_str(),
                request.origin.as_deref(),
                head,
                length
            ),
            ("x:1", Some("y"), 67, 2)
        );
        assert_eq!(status("GET / HTTP/1.1\r\nHost: a\r\n"), Ok(false));
        for twice in [
            "Host: a\r\nHost: b",
            "Content-Length: 1\r\nContent-Length: 1",
            "Transfer-Encoding: chunked",
            "X: y",
        ] {
            let host = if twice.starts_with("Host") || twice.starts_with('X') {
                ""
            } else {
                "Host: a\r\n"
            };
            assert_eq!(
                status(&format!("GET / HTTP/1.1\r\n{host}{twice}\r\n\r\n")),
                Err(400),
                "{twice}"
            );
        }
        let many: String = (0..MOST_HEADERS).map(|i| format!("X-{i}: a\r\n")).collect();
        assert_eq!(
            status(&format!("GET / HTTP/1.1\r\nHost: a\r\n{many}\r\n")),
            Err(431)
        );
        assert_eq!(status("\0\0\0\0"), Err(400));
    }

    /// Protects: each status of a refusal has the reason phrase of RFC 9110.
    #[test]
    fn statuses_have_their_reasons() {
        let phrases = [
            (400, "Bad Request"),
            (403, "Forbidden"),
            (404, "Not Found"),
            (405, "Method Not Allowed"),
            (408, "Request Timeout"),
            (409, "Conflict"),
            (413, "Content Too Large"),
            (431, "Request Header Fields Too Large"),
            (503, "Service Unavailable"),
        ];
        for (status, phrase) in phrases {
            assert_eq!(reason_phrase(status), phrase);
        }
    }
}

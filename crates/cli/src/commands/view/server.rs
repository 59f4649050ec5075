//! HTTP server of the viewer's page, for this machine alone.

use std::collections::VecDeque;
use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::io;
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use serde::Deserialize;
use serde_json::json;

use super::flags::ViewCommand;
use super::http::{HttpRequest, HttpResponse, read_request};
use super::shared::{SaveRequest, SharedView, ViewJob, ViewRequest};

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
    /// Accepted `Host` values: the loopback address and its name, each with the port.
    hosts: [String; 2],
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
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let port = listener.local_addr()?.port();
        Ok(Self {
            listener,
            hosts: ["127.0.0.1", "localhost"].map(|name| format!("{name}:{port}")),
            token: generate_token(),
            shared,
        })
    }

    /// Returns the URL of the page.
    pub fn address(&self) -> String {
        format!("http://{}/{}/", self.hosts[0], self.token)
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

    /// Refuses a request unless its host, its origin and its token are those of the viewer's page.
    /// A page of another site can send requests to this server through a domain name that resolves
    /// to this machine.
    fn check_head(&self, request: &HttpRequest) -> Result<(), HttpResponse> {
        let is_own = |origin: &str| {
            self.hosts
                .iter()
                .any(|host| origin.strip_prefix("http://") == Some(host))
        };
        let is_read = request.method == "GET";
        let refuse = |reason| Err(HttpResponse::with_text(403, reason));
        if !self.hosts.contains(&request.host) {
            return refuse(
                "the Host header does not name this server: open the address that the program printed",
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
            ("POST", "wish") => self.accept_view_request(&request.body),
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
            self.shared
                .wait_for_newer_status(reported, STATUS_TIMEOUT)
                .as_bytes(),
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
                json!({ "wish": self.shared.submit_request(view_request) }).to_string(),
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

fn parse_json<'a, T: Deserialize<'a>>(body: &'a [u8]) -> Result<T, HttpResponse> {
    serde_json::from_slice(body).map_err(|error| {
        HttpResponse::with_text(400, &format!("the JSON of the request is invalid: {error}"))
    })
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
    /// served; a link reaches only the page itself.
    #[test]
    fn others_are_refused() {
        let server = ViewServer::start(0, Arc::default()).expect("a port that is free");
        let (host, path) = (server.hosts[0].clone(), format!("/{}/", server.token));
        let requested = |change: &dyn Fn(&mut HttpRequest)| {
            let mut request = HttpRequest {
                method: "GET".into(),
                path: path.clone(),
                host: host.clone(),
                ..HttpRequest::default()
            };
            change(&mut request);
            let refusal = server.check_head(&request).err();
            refusal
                .unwrap_or_else(|| server.respond_to_request(&request))
                .status
        };
        assert_eq!(requested(&|_| ()), 200);
        assert_eq!(
            requested(&|request| request.host = request.host.replace("127.0.0.1", "localhost")),
            200
        );
        assert_eq!(
            requested(&|request| request.host = "evil.example".into()),
            403
        );
        assert_eq!(requested(&|request| request.host = "127.0.0.1".into()), 403);
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
            request.path.push_str("wish");
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

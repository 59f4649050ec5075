//! HTTP/1.1 for a single page on the loopback interface: a request per connection, limited in size
//! and time.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use httparse::{EMPTY_HEADER, Status};

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

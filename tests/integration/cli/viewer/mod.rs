//! `view`: the page's server, with valid and invalid requests. The page itself is tested in
//! `browser`.

mod browser;
mod live;
mod safety;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::support::Sandbox;

/// A room with a lamp, whose light is sampled randomly, and a ball that a parameter lifts and time
/// rotates.
const SCENE: &str = r#"
format = 1
[parameters]
height = 0.2
[render]
size = [64, 48]
samples = 64
integrator = "path"
[[cameras]]
name = "own"
pose.look_at = { eye = [0, 1, 4], target = [0, 0.5, 0] }
projection.pinhole = { vertical_fov = 45 }
[[cameras]]
name = "other"
pose.look_at = { eye = [3, 1, 1], target = [0, 0.5, 0] }
projection.pinhole = { vertical_fov = 45 }
[[materials]]
name = "ball"
model.physical = { base_colour = [0.8, 0.3, 0.2], roughness = 0.6 }
[[materials]]
name = "lamp"
model.physical = { emission = [8, 8, 8] }
[[objects]]
material = "ball"
shape.sphere = { centre = ["0.3*sin(t)", "0.5+height", 0], radius = 0.5 }
[[objects]]
material = "ball"
shape.plane = { point = [0, 0, 0], normal = [0, 1, 0] }
[[objects]]
material = "lamp"
shape.sphere = { centre = [1.5, 2.5, 1], radius = 0.4 }
"#;

/// Timeout of any operation on a busy machine.
const PATIENCE: Duration = Duration::from_secs(180);

/// The program while it serves its page.
struct Viewer {
    child: Child,
    host: String,
    token: String,
}

/// A response.
struct HttpAnswer {
    status: u16,
    head: String,
    body: Vec<u8>,
}

impl HttpAnswer {
    fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    fn json(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|error| panic!("{error}: {}", self.text()))
    }
}

impl Viewer {
    /// Starts the program with these flags, and waits for its address.
    fn start(sandbox: &Sandbox, words: &[&str]) -> Self {
        let words = [&["view", "--no-open", "-q"], words].concat();
        let mut child = sandbox
            .command(&words)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut address = String::new();
        BufReader::new(child.stdout.take().expect("a pipe"))
            .read_line(&mut address)
            .expect("an address");
        let Some((host, token)) = address
            .trim()
            .strip_prefix("http://")
            .and_then(|rest| rest.split_once('/'))
        else {
            let mut message = String::new();
            child
                .stderr
                .take()
                .expect("a pipe")
                .read_to_string(&mut message)
                .expect("text");
            panic!("no address: {address:?}\n{message}")
        };
        Self {
            host: host.to_owned(),
            token: token.trim_end_matches('/').to_owned(),
            child,
        }
    }

    fn address(&self) -> String {
        format!("http://{}/{}/", self.host, self.token)
    }

    /// Sends arbitrary bytes and returns the response.
    fn send(&self, bytes: &[u8]) -> Option<HttpAnswer> {
        let mut stream = TcpStream::connect(&self.host).expect("the program listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a time");
        // A refusing server may close the connection before it has read everything.
        let _ = stream
            .write_all(bytes)
            .and_then(|()| stream.shutdown(Shutdown::Write));
        let mut response = Vec::new();
        let _ = stream.read_to_end(&mut response);
        let end = response.windows(4).position(|four| four == b"\r\n\r\n")?;
        let head = String::from_utf8_lossy(&response[..end]).into_owned();
        let status = head.split_whitespace().nth(1)?.parse().ok()?;
        Some(HttpAnswer {
            status,
            head,
            body: response[end + 4..].to_vec(),
        })
    }

    /// Sends a request with these headers and returns the response.
    fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> HttpAnswer {
        let host = ("Host", self.host.as_str());
        let own = if headers.iter().any(|(name, _)| *name == "Host") {
            None
        } else {
            Some(host)
        };
        let headers: String = own
            .iter()
            .chain(headers)
            .map(|(name, value)| format!("{name}: {value}\r\n"))
            .collect();
        let request = format!(
            "{method} {path} HTTP/1.1\r\n{headers}Content-Length: {}\r\n\r\n{body}",
            body.len()
        );
        self.send(request.as_bytes()).expect("an answer")
    }

    fn get(&self, label: &str) -> HttpAnswer {
        self.ask("GET", &format!("/{}/{label}", self.token), &[], "")
    }

    fn post(&self, label: &str, body: &Value) -> HttpAnswer {
        let origin = format!("http://{}", self.host);
        self.ask(
            "POST",
            &format!("/{}/{label}", self.token),
            &[("Origin", &origin)],
            &body.to_string(),
        )
    }

    /// Waits for the first status that satisfies a condition.
    fn until(&self, label: &str, is_wanted: impl Fn(&Value) -> bool) -> Value {
        let (began, mut reported) = (Instant::now(), 0);
        loop {
            let status = self.get(&format!("status?after={reported}")).json();
            if is_wanted(&status) {
                return status;
            }
            reported = status["number"].as_u64().expect("a number");
            assert!(began.elapsed() < PATIENCE, "{label} did not come: {status}");
        }
    }

    /// Requests flags, and waits until their picture is finished.
    fn finished(&self, flags: &Value) -> Value {
        let response = self.post("request", &json!({ "flags": flags }));
        assert_eq!(response.status, 200, "{}", response.text());
        let wish = response.json()["request"].clone();
        self.until("the picture", |status| {
            status["request"] == wish && (status["phase"] == "done" || status["phase"] == "failed")
        })
    }

    /// Waits until the program ends by itself.
    fn end(&mut self) -> ExitStatus {
        let began = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                return status;
            }
            assert!(began.elapsed() < PATIENCE, "the program goes on");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        // The program may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Output of `--hash` for a command, run by a shell as copied from the page.
fn hash_of(sandbox: &Sandbox, command: &str) -> String {
    let rest = command.strip_prefix("raywright ").expect("a command");
    let line = format!(
        "'{}' {rest} --hash -q -o copied.exr",
        env!("CARGO_BIN_EXE_raywright")
    );
    let run = Command::new("sh")
        .args(["-c", &line])
        .current_dir(sandbox.path(""))
        .output()
        .expect("a shell");
    let text = String::from_utf8_lossy(&run.stdout);
    text.split_whitespace()
        .next()
        .unwrap_or_else(|| panic!("{line}: {}", String::from_utf8_lossy(&run.stderr)))
        .to_owned()
}

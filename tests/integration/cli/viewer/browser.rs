//! The page of `view` in a real browser, controlled through a pipe (Chrome DevTools Protocol).
//! Skipped without Chromium, which `.ci/run` installs. With `SCREENSHOTS=FOLDER`, screenshots of
//! the page are saved there.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use serde_json::{Value, json};

use super::{PATIENCE, SCENE, Viewer, hash_of};
use crate::cli::page::{CONTRAST, browser};
use crate::support::{Sandbox, shared};

/// A browser with one page.
struct Browser {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    session: Value,
    requested: u64,
}

impl Browser {
    /// Opens a URL; `None` without a browser.
    fn open(sandbox: &Sandbox, address: &str) -> Option<Self> {
        let Some(program) = browser() else {
            eprintln!("skipped: no Chromium");
            return None;
        };
        let flags = "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking --disable-sync \
                     --disable-component-update --remote-debugging-pipe";
        let profile = sandbox.path("profile");
        // The browser reads commands from file descriptor 3 and writes results to 4.
        let line = format!(
            "exec \"$0\" {flags} \"--user-data-dir=$1\" 3<&0 4>&1 </dev/null >/dev/null 2>&1"
        );
        let mut child = Command::new("sh")
            .args([
                "-c".as_ref(),
                line.as_ref(),
                program.as_os_str(),
                profile.as_os_str(),
            ])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell");
        let (input, output) = (
            child.stdin.take().expect("a pipe"),
            BufReader::new(child.stdout.take().expect("a pipe")),
        );
        let mut browser = Self {
            child,
            input,
            output,
            session: Value::Null,
            requested: 0,
        };
        let target =
            browser.call("Target.createTarget", json!({ "url": address }))["targetId"].clone();
        browser.session = browser.call(
            "Target.attachToTarget",
            json!({ "targetId": target, "flatten": true }),
        )["sessionId"]
            .clone();
        browser.width(1280, 900);
        Some(browser)
    }

    /// Calls a method and returns its result.
    fn call(&mut self, method: &str, parameters: Value) -> Value {
        let response = self.ask(method, parameters);
        assert_eq!(response["error"], Value::Null, "{method}");
        response["result"].clone()
    }

    /// Calls a method and returns its response, a result or an error.
    fn ask(&mut self, method: &str, parameters: Value) -> Value {
        self.requested += 1;
        let mut message = json!({ "id": self.requested, "method": method, "params": parameters });
        if self.session != Value::Null {
            message["sessionId"] = self.session.clone();
        }
        self.input
            .write_all(format!("{message}\0").as_bytes())
            .expect("the browser listens");
        loop {
            let mut response = Vec::new();
            self.output
                .read_until(0, &mut response)
                .expect("the browser answers");
            let response: Value =
                serde_json::from_slice(response.strip_suffix(b"\0").unwrap_or(&response))
                    .expect("JSON");
            if response["id"] == self.requested {
                return response;
            }
        }
    }

    /// Evaluates an expression in the page.
    fn eval(&mut self, expression: &str) -> Value {
        let requested =
            json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let response = self.call("Runtime.evaluate", requested);
        assert_eq!(response["exceptionDetails"], Value::Null, "{expression}");
        response["result"]["value"].clone()
    }

    /// Waits until an expression in the page is true, and until a page exists at all.
    fn until(&mut self, expression: &str) {
        let began = Instant::now();
        while self.ask("Runtime.evaluate", json!({ "expression": expression }))["result"]["result"]
            ["value"]
            != true
        {
            let state = "JSON.stringify([document.body?.dataset, document.getElementById('failure')?.textContent])";
            assert!(
                began.elapsed() < PATIENCE,
                "{expression}: {}",
                self.eval(state)
            );
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
    }

    /// Digest of the picture's pixels.
    fn picture(&mut self) -> Value {
        self.eval(
            "(() => { const c = document.getElementById('picture'); return c.toDataURL(); })()",
        )
    }

    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2]) {
        let buttons = u32::from(kind != "mouseReleased");
        let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Moves fingers from the first places to the last, and lifts them.
    fn touch(&mut self, places: [&[[f64; 2]]; 2]) {
        let points = |all: &[[f64; 2]]| -> Vec<Value> {
            let point = |(id, [x, y]): (usize, &[f64; 2])| json!({ "id": id, "x": x, "y": y });
            all.iter().enumerate().map(point).collect()
        };
        for (kind, all) in [
            ("touchStart", places[0]),
            ("touchMove", places[1]),
            ("touchEnd", &[]),
        ] {
            let event = json!({ "type": kind, "touchPoints": points(all) });
            self.call("Input.dispatchTouchEvent", event);
        }
    }

    fn key(&mut self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.call(
                "Input.dispatchKeyEvent",
                json!({ "type": kind, "key": key }),
            );
        }
    }

    fn colours(&mut self, scheme: &str) {
        self.call(
            "Emulation.setEmulatedMedia",
            json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] }),
        );
    }

    fn width(&mut self, width: u32, height: u32) {
        let size =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// Saves a screenshot of the page on request.
    fn shoot(&mut self, name: &str) {
        let Some(folder) = std::env::var_os("SCREENSHOTS") else {
            return;
        };
        self.eval("scrollTo(0, 0)");
        let data = self.call("Page.captureScreenshot", json!({ "format": "png" }))["data"].clone();
        let decode = Command::new("base64")
            .arg("-d")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut decode = decode.expect("base64");
        let text = data.as_str().expect("base64").to_owned();
        let mut input = decode.stdin.take().expect("a pipe");
        let writer = std::thread::spawn(move || input.write_all(text.as_bytes()));
        let bytes = decode.wait_with_output().expect("bytes").stdout;
        writer.join().expect("no panic").expect("written");
        std::fs::write(Path::new(&folder).join(format!("{name}.png")), bytes).expect("a file");
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // The browser may have been closed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Protects: the page shows the picture as it refines, its error at four stages or more, and
/// rotates it by mouse and by key; its command renders the finished picture; closing the page ends
/// the program.
#[test]
fn the_page_shows_and_turns() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let words = [
        "room.scene.toml",
        "--spp",
        "1024",
        "--size",
        "96x72",
        "--linger",
        "1s",
    ];
    let mut viewer = Viewer::start(&sandbox, &words);
    let Some(mut page) = Browser::open(&sandbox, &viewer.address()) else {
        return;
    };
    page.until("document.body?.dataset.picture > 0");
    page.shoot("start");
    let first = page.picture();
    page.until("document.body.dataset.samples > 15");
    page.shoot("half-way");
    page.until("document.body.dataset.phase === 'done'");
    page.shoot("done");
    assert!(page.picture() != first);
    assert!(page.eval("Number(document.body.dataset.stages)").as_u64() >= Some(4));
    let widths = "(() => { const d = document.getElementById('band').getAttribute('d').match(/[\\d.]+/g).map(Number); \
                  const n = d.length / 4, at = i => [d[2 * i + 1], d[d.length - 1 - 2 * i]]; \
                  return [at(0)[1] - at(0)[0], at(n - 1)[1] - at(n - 1)[0]]; })()";
    let widths: Vec<f64> = serde_json::from_value(page.eval(widths)).expect("two widths");
    assert!(widths[1] < widths[0], "the band closes: {widths:?}");
    let command = |page: &mut Browser| {
        page.eval("document.getElementById('command').textContent")
            .as_str()
            .expect("text")
            .to_owned()
    };
    let hash = |page: &mut Browser| {
        page.eval("document.body.dataset.hash")
            .as_str()
            .expect("text")
            .to_owned()
    };
    let own = command(&mut page);
    assert_eq!(hash(&mut page), hash_of(&sandbox, &own));

    page.mouse("mousePressed", [300.0, 300.0]);
    for step in 1..=8 {
        page.mouse(
            "mouseMoved",
            [
                300.0 + 10.0 * f64::from(step),
                300.0 + 4.0 * f64::from(step),
            ],
        );
    }
    page.mouse("mouseReleased", [380.0, 332.0]);
    page.until("document.getElementById('command').textContent.includes('--eye')");
    page.until("document.body.dataset.phase === 'done'");
    let turned = command(&mut page);
    assert_eq!(hash(&mut page), hash_of(&sandbox, &turned));
    page.key("ArrowLeft");
    let command_is_not = |other: &str| {
        format!(
            "document.getElementById('command').textContent !== {}",
            json!(other)
        )
    };
    page.until(&command_is_not(&turned));
    page.key("Home");
    page.until(&format!(
        "document.getElementById('command').textContent === {}",
        json!(own)
    ));
    page.until("document.body.dataset.phase === 'done'");
    page.key(" ");
    page.until(
        "document.body.dataset.phase !== 'done' || Number(document.body.dataset.samples) < 1024",
    );
    page.call("Browser.close", json!({}));
    assert!(viewer.end().success(), "the last page was closed");
}

/// Checks run in the page, for each colour scheme and width. A result is a list of faults.
const QUESTIONS: &str = r"(() => {
  CONTRAST
  const page = document.documentElement;
  ask(`nothing sticks out: ${page.scrollWidth} in ${page.clientWidth}`, page.scrollWidth <= page.clientWidth);
  for (const control of document.querySelectorAll('input, select, button, canvas')) {
    if (control.closest('[hidden]') || !control.checkVisibility()) continue;
    const name = control.labels?.[0]?.textContent || control.getAttribute('aria-label') || control.textContent;
    ask(`${control.id} has a name`, name?.trim());
    control.focus();
    ask(`${control.id || name} takes the keyboard`, control.disabled || document.activeElement === control);
  }
  const texts = [...document.body.querySelectorAll('*:not(script):not(option):not(title):not(canvas)')]
    .filter(element => element.checkVisibility() && [...element.childNodes].some(node => node.nodeType === 3 && node.data.trim()));
  ask(`${texts.length} texts`, texts.length > 30);
  texts.forEach(askContrast);
  return wrong;
})()";

/// Protects: in light and dark colours, on a desktop and on a phone, nothing overflows, every
/// control has a name and keyboard focus, and every text has a contrast of 4.5 (WCAG 2.2); an error
/// of the file is shown over the picture, as escaped text.
#[test]
fn the_page_fits_everyone() {
    let sandbox = Sandbox::new();
    sandbox.write("room.scene.toml", SCENE);
    let viewer = Viewer::start(&sandbox, &["room.scene.toml", "--spp", "64", "--watch"]);
    let Some(mut page) = Browser::open(&sandbox, &viewer.address()) else {
        return;
    };
    page.until("document.body?.dataset.phase === 'done'");
    page.eval("document.getElementById('effects-box').open = true");
    for (width, scheme) in [
        (360, "light"),
        (1280, "light"),
        (360, "dark"),
        (1280, "dark"),
    ] {
        page.width(width, 900);
        page.colours(scheme);
        assert_eq!(
            page.eval(&QUESTIONS.replace("CONTRAST", CONTRAST)),
            json!([]),
            "{scheme} colours at {width} pixels"
        );
        page.shoot(&format!("{scheme}-{width}"));
    }
    sandbox.write(
        "room.scene.toml",
        SCENE.replace(
            "name = \"own\"",
            "name = \"<img src=x onerror=alert(1)>\"\nfoo = 1",
        ),
    );
    page.until("!document.getElementById('failure').hidden");
    page.width(1280, 900);
    page.shoot("error");
    assert_eq!(page.eval("document.querySelectorAll('img').length"), 0);
    let message = page.eval("document.getElementById('failure').textContent");
    assert!(
        message
            .as_str()
            .is_some_and(|text| text.contains("unknown key `foo`")),
        "{message}"
    );
}

/// Writes a glTF model: a square that moves to the right within a second, white or, as a variant,
/// red.
fn write_model(sandbox: &Sandbox) {
    let mut bytes = Vec::new();
    let corners = [
        [-1.0, -1.0, 0.0],
        [1.0, -1.0, 0.0],
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
    ];
    for number in corners
        .into_iter()
        .flatten()
        .chain([0.0, 1.0])
        .chain([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    {
        bytes.extend_from_slice(&f32::to_le_bytes(number));
    }
    [0, 1, 2, 0, 2, 3]
        .iter()
        .for_each(|index| bytes.extend_from_slice(&u16::to_le_bytes(*index)));
    let view = |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let variants = |extension: Value| json!({ "KHR_materials_variants": extension });
    let model = json!({
        "asset": { "version": "2.0" }, "extensionsUsed": ["KHR_materials_variants"],
        "extensions": variants(json!({ "variants": [{ "name": "red" }] })),
        "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "materials": [{ "doubleSided": true }, { "doubleSided": true, "pbrMetallicRoughness": { "baseColorFactor": [0.8, 0.02, 0.02, 1] } }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 3, "material": 0,
            "extensions": variants(json!({ "mappings": [{ "material": 1, "variants": [0] }] })) }] }],
        "animations": [{ "name": "slide", "samplers": [{ "input": 1, "output": 2 }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }] }],
        "buffers": [{ "uri": "square.bin", "byteLength": bytes.len() }],
        "bufferViews": [view(0, 48), view(48, 8), view(56, 24), view(80, 12)],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1] },
            { "bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3" },
            { "bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
    });
    sandbox.write("square.bin", bytes);
    sandbox.write("square.gltf", model.to_string());
}

/// Protects: a model's picture has the size of its place, also after the window's size changed; a
/// variant, play, the switches for lines and perspective, and one and two fingers change the command
/// and the picture.
#[test]
fn a_model_fills_its_place_and_follows() {
    let sandbox = Sandbox::new();
    write_model(&sandbox);
    let viewer = Viewer::start(&sandbox, &["square.gltf", "--spp", "8"]);
    let Some(mut page) = Browser::open(&sandbox, &viewer.address()) else {
        return;
    };
    page.call(
        "Emulation.setTouchEmulationEnabled",
        json!({ "enabled": true, "maxTouchPoints": 2 }),
    );
    let has = |words: &str| {
        format!(
            "document.getElementById('command').textContent.includes({})",
            json!(words)
        )
    };
    let fits = "(() => { const p = document.getElementById('place'), c = document.getElementById('picture'); \
                return c.width === p.clientWidth && c.height === p.clientHeight && document.body.dataset.edge === '1' && \
                innerHeight >= document.body.scrollHeight && c.height > 0.6 * innerHeight; })()";
    page.until(fits);
    page.until(&has("--size"));
    page.width(1000, 700);
    page.until(fits);
    page.until("document.body.dataset.phase === 'done'");
    page.shoot("model");
    let middle = "(() => { const c = document.getElementById('picture'); \
                  return [...c.getContext('2d').getImageData(c.width / 2, c.height / 2, 1, 1).data]; })()";
    let colour = |page: &mut Browser| -> Vec<f64> {
        serde_json::from_value(page.eval(middle)).expect("codes")
    };
    let white = colour(&mut page);
    assert!(white[0] < 1.2 * white[1], "{white:?}");
    let choose = "(() => { const s = document.getElementById('choose-variant'); s.value = 'red'; s.dispatchEvent(new Event('change')); })()";
    page.eval(choose);
    page.until(&has("--variant red"));
    page.until("document.body.dataset.phase === 'done'");
    let red = colour(&mut page);
    assert!(red[0] > 2.0 * red[1], "{red:?}");

    page.eval("document.getElementById('play').click()");
    page.until("Number(document.getElementById('at').value) > 0.3");
    page.until(&has("--at"));
    page.eval("document.getElementById('play').click()");
    page.until("document.body.dataset.phase === 'done'");
    for name in ["edges", "ortho"] {
        page.eval(&format!("document.getElementById('{name}').click()"));
        page.until(&has(&format!("--{name}")));
    }
    page.until("document.body.dataset.phase === 'done'");
    page.shoot("edges");
    page.eval("document.getElementById('ortho').click()");
    page.until(&format!("!{}", has("--ortho")));

    let eye = "document.getElementById('command').textContent.match(/--eye[ =](\\S+)/)?.[1].split(',').map(Number)";
    let target = eye.replace("eye", "target");
    let distance = format!("Math.hypot(...({eye}).map((x, i) => x - ({target})[i]))");
    // The switch shows the whole scene from the same side, until the camera moves.
    page.until(&has("--view"));
    page.touch([&[[300.0, 300.0]], &[[380.0, 330.0]]]);
    page.until(&has("--eye"));
    let far = page.eval(&distance).as_f64().expect("a distance");
    page.touch([
        &[[300.0, 300.0], [340.0, 300.0]],
        &[[260.0, 300.0], [380.0, 300.0]],
    ]);
    page.until(&format!("{distance} < {}", 0.8 * far));
    page.until("document.body.dataset.phase === 'done'");
    page.width(360, 780);
    page.until(
        "document.getElementById('picture').width === document.getElementById('place').clientWidth",
    );
    page.until("document.body.dataset.phase === 'done'");
    page.shoot("phone");
}

/// Protects: a new view's first picture appears although the last render is unfinished, and so does
/// each of many; their times are reported.
#[test]
fn each_view_has_a_picture() {
    let Some(duck) = shared("assets/gltf/Duck/Duck.glb") else {
        return;
    };
    let sandbox = Sandbox::new();
    let name = duck.to_string_lossy().into_owned();
    for (scene, size) in [
        (name.as_str(), "1280x720"),
        (name.as_str(), "640x360"),
        ("preset:whitted", "640x360"),
    ] {
        if scene == "preset:whitted" && !crate::support::carried("whitted") {
            continue;
        }
        let began = Instant::now();
        let viewer = Viewer::start(&sandbox, &[scene, "--size", size]);
        let sketched = began.elapsed().as_millis();
        let Some(mut page) = Browser::open(&sandbox, &viewer.address()) else {
            return;
        };
        page.until("document.body?.dataset.picture > 0");
        let first = page.eval("document.body.dataset.first");
        eprintln!(
            "{scene} {size}: sketched {sketched} ms after the program began, shown {first} ms after its page did"
        );
        let mut times: Vec<f64> = Vec::new();
        for turn in 0..20 {
            page.eval("delete document.body.dataset.latency");
            page.eval("document.getElementById('picture').focus()");
            page.key(if turn % 2 == 0 {
                "ArrowLeft"
            } else {
                "ArrowUp"
            });
            page.until("document.body.dataset.latency !== undefined");
            times.push(
                page.eval("Number(document.body.dataset.latency)")
                    .as_f64()
                    .expect("milliseconds"),
            );
        }
        let edge = page.eval("Number(document.body.dataset.edge)");
        times.sort_by(f64::total_cmp);
        eprintln!(
            "{scene} {size}: a new view in {:.0} ms, at most {:.0} (pixels of {edge})",
            times[10], times[19]
        );
        assert!(
            times[0] > 0.0
                && page.eval("document.getElementById('command').textContent.includes('--eye')")
                    == true
        );
        if size == "1280x720" {
            page.width(1280, 900);
            page.until("document.body.dataset.samples > 3");
            page.shoot("duck");
        }
    }
}

//! The page of `accuracy` in a real browser: its controls work, by keyboard too, and it fits a
//! phone. Skipped without Chromium, which `.ci/run` installs.

use std::path::PathBuf;
use std::process::Command;

use crate::support::Sandbox;

/// Script shared by the pages' tests: collects failed checks, and computes the contrast of text
/// with its background.
pub const CONTRAST: &str = r"
const wrong = [];
const ask = (what, right) => { if (!right) wrong.push(what); };
const linear = code => code <= 10.31475 ? code / 3294.6 : ((code / 255 + 0.055) / 1.055) ** 2.4;
const light = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
const numbers = colour => (colour.match(/[\d.]+/g) ?? []).map(Number);
const paper = element => {
  for (let at = element; at; at = at.parentElement) {
    const colour = numbers(getComputedStyle(at).backgroundColor);
    if (colour.length === 3 || colour[3] === 1) return light(colour);
  }
  return 1;
};
const askContrast = element => {
  const style = getComputedStyle(element);
  const [a, b] = [light(numbers(element instanceof SVGElement ? style.fill : style.color)), paper(element)];
  const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  ask(`${element.textContent.trim().slice(0, 30)} stands out: ${contrast}`, contrast >= 4.5);
};
";

/// Checks run inside the page. Each failed check adds a line to the document, which the browser
/// prints.
const QUESTIONS: &str = r##"
<script>
CONTRAST
const changed = (control, value) => { control.value = value; control.dispatchEvent(new Event("input", { bubbles: true })); };
addEventListener("load", () => {
  const names = [...one.options].map(option => option.value);
  const magnified = [...document.querySelectorAll("img[data-name]")];
  ask("the setting in use is on the left", one.value === "in use");
  ask("the next is on the right", other.value === names[1]);
  ask("the reference is the last", names.at(-1) === "reference");
  ask("every picture is whole", magnified.every(image => image.naturalWidth === 16 && image.naturalHeight === 12));
  ask("each has its error", magnified.every(image => image.parentElement.innerText.includes(image.dataset.name === "reference" ? "exact" : "error")));
  changed(one, "reference");
  ask("another picture on the left", over.src === of("reference").src && over.alt === "reference");
  changed(other, "in use");
  ask("another picture on the right", under.src === of("in use").src && under.src !== over.src);
  ask("the measured part is marked", document.querySelectorAll("rect.detail").length === 1);
  changed(edge, "25");
  ask("the edge moves", getComputedStyle(over).clipPath.replaceAll(" ", "") === "inset(075%0px0px)" || over.style.clipPath.includes("75%"));
  for (const control of [one, other, edge]) {
    control.focus();
    ask(`${control.id} takes the keyboard`, document.activeElement === control);
    ask(`${control.id} has a label`, control.labels.length === 1);
  }
  const page = document.documentElement;
  ask(`nothing sticks out: ${page.scrollWidth} in ${page.clientWidth}`, page.scrollWidth <= page.clientWidth);
  const dark = location.hash === "#dark";
  ask("the colours are those asked for", matchMedia("(prefers-color-scheme: dark)").matches === dark);
  ask("the paper is as dark as the colours", (paper(document.body) < 0.1) === dark);
  const written = [...document.body.querySelectorAll("*:not(script):not(style):not(option):not(title):not(desc)")]
    .filter(element => [...element.childNodes].some(node => node.nodeType === Node.TEXT_NODE && node.data.trim()));
  ask(`${written.length} texts`, written.length > 100);
  written.forEach(askContrast);
  ask(`${names.length} settings`, names.length >= 2);
  document.title = wrong.length ? "WRONG: " + wrong.join("; ") : "ALL RIGHT";
});
</script>
"##;

/// Path of Chromium, if installed.
pub fn browser() -> Option<PathBuf> {
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    names
        .iter()
        .flat_map(|name| folders.iter().map(move |folder| folder.join(name)))
        .find(|path| path.is_file())
}

/// Protects: chosen pictures appear, each with its error, the slider between them moves, all controls
/// work by keyboard, nothing is wider than a phone, and every text has a contrast of 4.5 (WCAG
/// 2.2), in light and dark colours.
#[test]
fn the_page_works_in_a_browser() {
    let Some(browser) = browser() else {
        eprintln!("skipped: no Chromium");
        return;
    };
    let sandbox = Sandbox::new();
    sandbox.write("ball.scene.toml", super::accuracy::SCENE);
    let words = [
        "accuracy",
        "ball.scene.toml",
        "--size",
        "16x12",
        "--budget",
        "10min",
        "--rounds",
        "2",
        "-o",
        "a.html",
        "-q",
    ];
    sandbox.run(&words).exits_with(0);
    let page = std::fs::read_to_string(sandbox.path("a.html")).expect("a page");
    sandbox.write(
        "asked.html",
        page.replace(
            "</body>",
            &format!("{}</body>", QUESTIONS.replace("CONTRAST", CONTRAST)),
        ),
    );
    for (width, colours, scheme) in [
        ("360", "light", 1),
        ("1400", "light", 1),
        ("360", "dark", 0),
        ("1400", "dark", 0),
    ] {
        let run = Command::new(&browser)
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-quic",
                "--no-first-run",
                "--disable-background-networking",
            ])
            .args([
                "--disable-component-update",
                "--disable-sync",
                "--dump-dom",
                "--virtual-time-budget=20000",
            ])
            .arg(format!("--window-size={width},800"))
            .arg(format!(
                "--user-data-dir={}",
                sandbox.path(format!("profile-{width}-{colours}")).display()
            ))
            .arg(format!("--blink-settings=preferredColorScheme={scheme}"))
            .arg(format!(
                "file://{}#{colours}",
                sandbox.path("asked.html").display()
            ))
            .output()
            .expect("a browser");
        let document = String::from_utf8_lossy(&run.stdout);
        let title = document
            .split_once("<title>")
            .and_then(|(_, rest)| rest.split_once("</title>"))
            .map(|(title, _)| title);
        assert_eq!(
            title,
            Some("ALL RIGHT"),
            "at {width} pixels in {colours} colours: {}",
            String::from_utf8_lossy(&run.stderr)
        );
    }
}

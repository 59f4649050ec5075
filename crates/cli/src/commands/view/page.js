// The page of `raywright view`. It has one state of its own, the flags of a command; all else is what the program says of it.

const $ = id => document.getElementById(id);
const VIEWS = ["front", "back", "left", "right", "top", "bottom", "iso"];
const SWITCHES = ["edges", "ortho"];
const LAYERS = {
  "": "Colours", stderr: "Noise (heat)", albedo: "Albedo", normal: "Normals", depth: "Depth", position: "Positions", object: "Objects",
  material: "Materials", emission: "Emission",
};
const MOST_PIXELS = 1280 * 720; // of a picture with the size of its place
const TONE_MAPS = ["none", "aces", "aces-hill", "agx", "khronos-neutral"];

let flags = null; // pairs of a flag's name and its value, null for switches; none before the program has spoken
let initial = []; // those that the program began with
let layer = "";
let status = null; // what the program said last
let camera = null; // where the camera is, ahead of what the program knows of it
let sent = { request: 0, at: 0, busy: false, dirty: false, anew: false };

// ---- the state: flags

const valueOf = name => flags.find(([known]) => known === name)?.[1];
const drop = (...names) => { flags = flags.filter(([known]) => !names.includes(known)); };
const put = (name, value) => { drop(name); if (value !== undefined) flags.push([name, value]); };
const rounded = numbers => numbers.map(x => Number(x.toPrecision(7))).join(",");

/** Tells the program what is to be seen: one request at a time, the last wish being the one that counts. */
async function wish({ anew = false } = {}) {
  sent.anew ||= anew;
  if (sent.busy) { sent.dirty = true; return; }
  Object.assign(sent, { busy: true, dirty: false });
  const body = JSON.stringify({ flags, layer, anew: sent.anew });
  sent.anew = false;
  const began = performance.now();
  try {
    const answer = await fetch("request", { method: "POST", body });
    if (answer.ok) Object.assign(sent, { request: (await answer.json()).request, at: began });
    else showFailure(await answer.text());
  } catch { /* The program has ended, which the next question for its status will find. */ }
  sent.busy = false;
  if (sent.dirty) wish();
}

// ---- what the program says

async function listen() {
  for (;;) {
    try {
      const answer = await fetch(`status?after=${status?.number ?? 0}`);
      if (!answer.ok) throw new Error(await answer.text());
      const before = status;
      status = await answer.json();
      if (status.number === before?.number) continue;
      if (status.picture && status.picture !== before?.picture) await draw();
      show();
    } catch (error) {
      $("phase").textContent = "the program has ended";
      document.body.dataset.phase = "ended";
      await new Promise(resolve => setTimeout(resolve, 2000));
    }
  }
}

/** Fetches the picture's bytes and draws it; a sketch has larger pixels, and covers the same. */
async function draw() {
  const answer = await fetch("picture");
  const [number, width, height, edge] = answer.headers.get("X-Picture").split(" ").map(Number);
  const codes = new Uint8ClampedArray(await answer.arrayBuffer());
  if (codes.length !== 4 * width * height || !codes.length) return;
  const bitmap = await createImageBitmap(new ImageData(codes, width, height));
  const canvas = $("picture"), [across, down] = status.size;
  if (canvas.width !== across || canvas.height !== down) Object.assign(canvas, { width: across, height: down });
  const context = canvas.getContext("2d");
  context.clearRect(0, 0, across, down);
  context.drawImage(bitmap, 0, 0, width * edge, height * edge);
  Object.assign(document.body.dataset, { picture: number, edge });
  document.body.dataset.first ??= performance.now().toFixed(0);
  if (status.request >= sent.request && sent.at) {
    document.body.dataset.latency = (performance.now() - sent.at).toFixed(0);
    sent.at = 0;
    if (playing) requestAnimationFrame(advance);
  }
}

function show() {
  const { scene, progress, failure } = status;
  if (flags === null) [flags, initial, layer] = [status.flags, status.flags, status.layer];
  showFailure(failure);
  document.body.dataset.phase = status.phase;
  $("phase").textContent = [status.phase, status.message].filter(Boolean).join(": ");
  $("command").textContent = status.command;
  if (progress) showProgress(progress);
  $("wait").textContent = status.picture ? "" : $("phase").textContent;
  if (!scene) return;
  $("name").textContent = document.title = scene.name;
  if (!pointers.size && status.request >= sent.request) camera = scene.camera;
  showControls(scene);
  showEffects();
  if (!fitted) fit();
}

/** Gives the picture of a model the size of its place, unless the command has a size. */
let fitted = false, fitting = 0;
function fit() {
  if (!status?.scene) return;
  fitted = true;
  if (!status.scene.fits_page || initial.some(([name]) => name === "size" || name === "crop")) return;
  const { clientWidth: width, clientHeight: height } = $("place");
  if (!width || !height) return;
  const scale = Math.min(devicePixelRatio, Math.sqrt(MOST_PIXELS / (width * height)));
  const size = [width, height].map(edge => Math.max(1, Math.round(edge * scale))).join("x");
  if (size === valueOf("size")) return;
  put("size", size);
  wish();
}
new ResizeObserver(() => { clearTimeout(fitting); fitting = setTimeout(fit, 200); }).observe($("place"));

function showFailure(text) {
  $("failure").hidden = !text;
  $("failure").textContent = text ?? "";
}

// What has no end is null in JSON.
const digits = (x, n = 3) => x === null ? "∞" : x === 0 ? "0" : Number(x.toPrecision(n)).toString();
const count = n => n >= 1e6 ? `${(n / 1e6).toFixed(1)} million` : Math.round(n).toLocaleString("en");
const time = s => s < 1 ? `${Math.round(1000 * s)} ms` : s < 100 ? `${s.toFixed(1)} s` : `${Math.floor(s / 60)} min ${Math.round(s % 60)} s`;

function showProgress(progress) {
  const { samples: [least, most], of, error, history } = progress;
  const found = error?.root_relmse, goal = Number($("max-error").value) || progress.max_error;
  const doubt = error?.doubt ? `, in doubt: ${error.doubt.replaceAll("-", " ")}` : "";
  $("error").textContent = error?.doubt === "nearly-black" ? "not known: the picture is nearly black"
    : error?.doubt === "wide-interval" ? "not known: the estimate is too uncertain"
    : found ? `${digits(found.value)} (${digits(found.low)} to ${digits(found.high)})${doubt}`
    : progress.exact ? "none: this picture has no random samples. Its distance from the exact picture is another thing: `raywright accuracy` measures it" : "not known yet";
  // Noise falls with the root of the samples, and samples come with time.
  const toGoal = goal && found?.high ? Math.max(0, progress.seconds * ((found.high / goal) ** 2 - 1)) : null;
  const rows = [
    ["Samples", `${least === most ? most : `${least} to ${most}`}${of ? ` of ${of}` : ""}`],
    ["Rays a second", count(progress.rays_per_second)],
    ["Time", time(progress.seconds) + (progress.seconds_left ? `, ${time(progress.seconds_left)} left` : "")],
    ["Time to the target noise", goal ? (toGoal === null ? "not known yet" : toGoal === 0 ? "reached" : `about ${time(toGoal)}`) : "no target noise is set"],
    ["First picture", `${Math.round(progress.first_ms)} ms after the change`],
    ...(progress.hash ? [["SHA-256", progress.hash]] : []),
  ];
  $("numbers").replaceChildren(...rows.flatMap(([name, text]) => [element("dt", {}, name), element("dd", {}, text)]));
  chart(history.filter(([, , value, low, high]) => value > 0 && low > 0 && Number.isFinite(high)), goal);
  Object.assign(document.body.dataset, { samples: least, hash: progress.hash ?? "", stages: history.length });
}

/** The error over the samples, which are in doublings, as they come: a line that falls to nothing, and a band about it that closes. */
function chart(history, goal) {
  const [left, right, top, bottom] = [38, 314, 8, 132];
  const log = Math.log2, samples = history.map(stage => stage[1]);
  const [x0, x1] = [log(Math.min(...samples)), log(Math.max(...samples))];
  // The first estimates are of few samples, and may be of any width.
  const most = Math.max(goal || 0, ...history.map(([, , value, , high]) => Math.min(high, 2 * value)));
  const x = n => left + (right - left) * (x1 > x0 + 0.01 ? (log(n) - x0) / (x1 - x0) : 0.5);
  const y = e => bottom - (bottom - top) * Math.min(1, e / most);
  const path = points => points.length ? "M" + points.map(([a, b]) => `${a.toFixed(2)},${b.toFixed(2)}`).join("L") : "";
  const upper = history.map(stage => [x(stage[1]), y(stage[4])]), lower = history.map(stage => [x(stage[1]), y(stage[3])]);
  $("band").setAttribute("d", history.length ? path([...upper, ...lower.reverse()]) + "Z" : "");
  $("line").setAttribute("d", path(history.map(stage => [x(stage[1]), y(stage[2])])));
  $("goal").setAttribute("d", goal && history.length ? path([[left, y(goal)], [right, y(goal)]]) : "");
  if (!history.length) { $("ticks").replaceChildren(); return; }
  const step = 10 ** Math.floor(Math.log10(most)), marks = [];
  for (let e = 0; e <= most; e += most < 2 * step ? step / 2 : most < 5 * step ? step : 2 * step) {
    marks.push([path([[left, y(e)], [right, y(e)]]), 2, y(e) + 3, digits(e, 2)]);
  }
  for (const n of new Set([Math.min(...samples), Math.max(...samples)])) marks.push(["", x(n), 146, `${n} spp`, x(n) > 200 ? "end" : "start"]);
  $("ticks").replaceChildren(...marks.flatMap(([d, x, y, text, side = "start"]) =>
    [vector("path", { d }), vector("text", { x, y, "text-anchor": side }, text)]));
}

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function vector(name, attributes, text = "") {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

/** Makes the content of an element anew where what it shows has changed, so that what has the focus keeps it. */
const made = new Map();
function refresh(id, what, make) {
  const key = JSON.stringify(what);
  if (made.get(id) === key) return;
  made.set(id, key);
  $(id).replaceChildren(...make());
}

/** A control's value, unless someone is at it. */
const set = (id, value) => { if (document.activeElement !== $(id)) $(id).value = value; };

function options(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, text]) => element("option", { value }, text)));
  select.value = chosen;
}

function showControls(scene) {
  set("exposure", scene.exposure);
  $("exposure-value").textContent = `${scene.exposure} stops`;
  set("tonemap", scene.tonemap);
  set("layer", layer);
  $("denoise").checked = scene.denoise;
  for (const name of SWITCHES) $(name).checked = valueOf(name) !== undefined;
  set("spp", valueOf("spp") ?? "");
  set("max-error", valueOf("max-error") ?? "");
  $("time").hidden = scene.seconds === null;
  if (scene.seconds !== null) {
    $("at").max = scene.seconds;
    set("at", scene.at);
    $("at-value").textContent = `${Number($("at").value).toFixed(2)} s`;
  }
  const named = (names, first) => [["", first], ...names.map((name, i) => [name || String(i), name || `number ${i}`])];
  const lists = [
    ["camera", "Camera", scene.cameras, "the first"], ["scene", "Scene", scene.scenes, "the file's"],
    ["variant", "Variant", scene.variants, "the file's"], ["animation", "Animation", scene.animations, "all"],
  ].filter(([name, , names]) => names.length > (name === "variant" ? 0 : 1));
  refresh("choices", lists, () => lists.flatMap(([name, title, names, first]) => {
    const select = element("select", { id: `choose-${name}` });
    options(select, named(names, first), valueOf(name) ?? "");
    select.addEventListener("change", () => {
      if (name === "camera") drop("eye", "target", "view");
      put(name, select.value || undefined);
      wish();
    });
    return [element("label", { for: select.id }, title), select];
  }));
  // A number, or a table with a range; where some have a range, the others follow from them.
  const all = Object.entries(scene.parameters), ranged = all.filter(([, { min }]) => min !== undefined);
  const parameters = ranged.length ? ranged : all;
  refresh("parameters", parameters.map(([name]) => name), () => parameters.flatMap(([name, value]) => slider(name, value)));
  refresh("notes", scene.notes, () => scene.notes.map(note => element("li", {}, note)));
}

/** A parameter of the scene, within its range, or from nothing or its opposite to twice what it is. */
function slider(name, parameter) {
  const value = parameter.value ?? parameter, reach = Math.abs(value) || 1, id = `set-${name}`;
  const { min = value <= 0 ? -2 * reach : 0, max = 2 * reach } = parameter;
  const input = element("input", { id, type: "range", min, max, step: parameter.step ?? (max - min) / 100 });
  const output = element("output", { for: id }, digits(value));
  input.value = value;
  input.addEventListener("input", () => {
    output.textContent = digits(Number(input.value));
    flags = flags.filter(([known, text]) => known !== "set" || !text.startsWith(`${name}=`));
    flags.push(["set", `${name}=${input.value}`]);
    wish();
  });
  return [element("label", { for: id }, name), element("span", { class: "row" }, input, output)];
}

function showEffects() {
  const off = flags.filter(([name]) => name === "without").flatMap(([, value]) => value.split(","));
  const shown = status.effects.filter(effect => effect.status !== "absent" || off.includes(effect.word));
  refresh("effects", [shown, off], () => shown.map(effect => {
    const box = element("input", { type: "checkbox", id: `effect-${effect.word}` });
    box.checked = effect.status === "simulated";
    box.disabled = !effect.can_switch;
    box.addEventListener("change", () => {
      drop("without");
      const without = box.checked ? off.filter(word => word !== effect.word) : [...off, effect.word];
      if (without.length) flags.push(["without", without.join(",")]);
      wish();
    });
    const cost = effect.cost === null ? "" : ` (${effect.cost < 0 ? "" : "+"}${Math.round(100 * effect.cost)} % time)`;
    return element("li", {}, box, element("label", { for: box.id }, ` ${effect.name}${cost}`), element("small", {}, effect.because));
  }));
}

// ---- the camera

const add = (a, b, s = 1) => a.map((x, i) => x + s * b[i]);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const unit = a => { const length = Math.hypot(...a) || 1; return a.map(x => x / length); };

/** Puts the camera somewhere, in the words of the command. */
function move(eye, target) {
  camera = { ...camera, eye, target };
  drop("view");
  put("eye", rounded(eye));
  put("target", rounded(target));
  wish();
}

/** Turns the camera about its target; it does not go over the top. */
function orbit(turn, rise) {
  if (!camera) return;
  const up = unit(camera.up), arm = add(camera.eye, camera.target, -1), length = Math.hypot(...arm);
  const height = Math.asin(Math.max(-1, Math.min(1, dot(arm, up) / length)));
  const raised = Math.max(-1.55, Math.min(1.55, height + rise));
  let level = add(arm, up, -dot(arm, up));
  if (Math.hypot(...level) < 1e-6 * length) level = cross(up, Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1]);
  level = unit(level);
  const side = cross(up, level);
  const ahead = add(level.map(x => x * Math.cos(turn)), side, Math.sin(turn));
  const direction = add(ahead.map(x => x * Math.cos(raised)), up, Math.sin(raised));
  move(add(camera.target, direction, length), camera.target);
}

/** Moves the camera across what it shows, by shares of the picture's height. */
function pan(across, down) {
  if (!camera) return;
  const arm = add(camera.eye, camera.target, -1), back = unit(arm), right = unit(cross(unit(camera.up), back)), up = cross(back, right);
  const height = camera.height ?? 2 * Math.hypot(...arm) * Math.tan(camera.fov * Math.PI / 360);
  const by = add(right.map(x => -x * across * height), up, down * height);
  move(add(camera.eye, by), add(camera.target, by));
}

/** Comes nearer; where rays are parallel the picture is enlarged in place of that. */
function zoom(factor) {
  if (!camera) return;
  if (camera.fov === null) {
    put("zoom", String(Number((Number(valueOf("zoom") ?? 1) * factor).toPrecision(4))));
    wish();
  } else {
    move(add(camera.target, add(camera.eye, camera.target, -1), 1 / factor), camera.target);
  }
}

function home() {
  const own = ["camera", "eye", "target", "view", "zoom", "fov", "ortho"];
  drop(...own);
  flags.push(...initial.filter(([name]) => own.includes(name)));
  wish();
}

const pointers = new Map();
const apart = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };

$("picture").addEventListener("pointerdown", event => {
  $("picture").setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
});
$("picture").addEventListener("pointermove", event => {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  const { width: w, height: h, clientWidth, clientHeight } = $("picture");
  const height = Math.min(clientHeight, clientWidth * h / w) || 1, [dx, dy] = [event.clientX - before.x, event.clientY - before.y];
  const distance = pointers.size === 2 ? apart() : 0;
  pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  if (pointers.size === 2) {
    pan(dx / height / 2, dy / height / 2);
    if (distance > 0) zoom(apart() / distance);
  } else if (event.shiftKey || event.buttons & 6) {
    pan(dx / height, dy / height);
  } else {
    orbit(-dx / height * 3, dy / height * 3);
  }
});
for (const end of ["pointerup", "pointercancel"]) $("picture").addEventListener(end, event => pointers.delete(event.pointerId));
$("picture").addEventListener("contextmenu", event => event.preventDefault());
$("picture").addEventListener("wheel", event => {
  event.preventDefault();
  zoom(Math.exp(-Math.sign(event.deltaY) * Math.min(0.25, Math.abs(event.deltaY) / 500)));
}, { passive: false });

const KEYS = {
  ArrowLeft: shift => shift ? pan(0.05, 0) : orbit(-0.1, 0), ArrowRight: shift => shift ? pan(-0.05, 0) : orbit(0.1, 0),
  ArrowUp: shift => shift ? pan(0, 0.05) : orbit(0, 0.1), ArrowDown: shift => shift ? pan(0, -0.05) : orbit(0, -0.1),
  "+": () => zoom(1.1), "=": () => zoom(1.1), "-": () => zoom(1 / 1.1), Home: home, " ": () => wish({ anew: true }),
};
document.addEventListener("keydown", event => {
  const isFree = event.target === document.body || event.target === $("picture");
  if (!isFree || event.ctrlKey || event.altKey || event.metaKey || !KEYS[event.key] || flags === null) return;
  event.preventDefault();
  KEYS[event.key](event.shiftKey);
});

// ---- the other controls

for (const view of VIEWS) {
  const button = element("button", { type: "button" }, view);
  button.addEventListener("click", () => { drop("camera", "eye", "target", "fit"); put("view", view); wish(); });
  $("views").append(button);
}
const homeButton = element("button", { type: "button" }, "home");
homeButton.addEventListener("click", home);
$("views").append(homeButton);

options($("layer"), Object.entries(LAYERS), "");
options($("tonemap"), TONE_MAPS.map(name => [name, name]), "none");
$("layer").addEventListener("change", () => { layer = $("layer").value; wish(); });
$("tonemap").addEventListener("change", () => { put("tonemap", $("tonemap").value); wish(); });
$("exposure").addEventListener("input", () => { put("exposure", $("exposure").value); wish(); });
$("denoise").addEventListener("change", () => { drop("denoise", "no-denoise", "quick"); flags.push([$("denoise").checked ? "denoise" : "no-denoise", null]); wish(); });
$("edges").addEventListener("change", () => { put("edges", $("edges").checked ? null : undefined); wish(); });
// A parallel view shows the whole scene, from where the camera is.
$("ortho").addEventListener("change", () => {
  put("ortho", $("ortho").checked ? null : undefined);
  if ($("ortho").checked && camera) {
    const [x, y, z] = unit(add(camera.eye, camera.target, -1));
    drop("camera", "fov", "fit", "eye", "target");
    put("view", rounded([Math.atan2(x, z), Math.asin(y)].map(angle => angle * 180 / Math.PI)));
  }
  wish();
});
for (const name of ["spp", "max-error"]) {
  $(name).addEventListener("change", () => { drop("quick"); put(name, $(name).value || undefined); wish(); });
}
$("measure").addEventListener("click", () => fetch("measure", { method: "POST" }));

let playing = false, moment = 0;
$("at").addEventListener("input", () => showMoment($("at").value));
$("play").addEventListener("click", () => {
  playing = !playing;
  $("play").setAttribute("aria-pressed", playing);
  moment = performance.now();
  if (playing) advance();
});

/** The next moment of what moves: as much later as it is by now. */
function advance() {
  if (!playing) return;
  const now = performance.now(), seconds = Number($("at").max);
  $("at").value = (Number($("at").value) + (now - moment) / 1000) % seconds;
  moment = now;
  showMoment($("at").value);
}

/** Another moment, from where the camera is: a model that is shown whole would be framed anew with each of its movements. */
function showMoment(at) {
  put("at", at);
  if (camera && !status.scene.cameras.length && valueOf("view") === undefined && valueOf("eye") === undefined) move(camera.eye, camera.target);
  else wish();
}

$("copy").addEventListener("click", async () => {
  await navigator.clipboard.writeText($("command").textContent);
  $("saved").textContent = "copied";
});
$("save").addEventListener("submit", async event => {
  event.preventDefault();
  const save = async replace => fetch("save", { method: "POST", body: JSON.stringify({ name: $("file").value, replace }) });
  let answer = await save(false), text = await answer.text();
  if (answer.status === 409 && confirm(`${text.trim()}. Replace it?`)) {
    answer = await save(true);
    text = await answer.text();
  }
  $("saved").textContent = text;
});

listen();

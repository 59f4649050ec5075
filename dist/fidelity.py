"""Ground truth for the Khronos render fidelity set: each of its scenarios rendered to a stated error, all on one page.

    python3 -m venv venv && venv/bin/pip install numpy pillow OpenEXR
    venv/bin/python dist/fidelity.py test/config.json OUT --ours target/release/raywright --files . --pictures test/goldens

`test/config.json` and `test/goldens` are of the repository KhronosGroup/glTF-Render-Fidelity-Generator, and its models and skies lie below the
folders of --files. OUT/index.html shows each picture above its error with a 95 % interval; beside it,
where --pictures is given, the pictures of other renderers with their distance from ours, in 8-bit codes and in units of our own error.
What was rendered with the same command before is kept, so that a run can be ended and started again.
"""
import argparse, html, json, math, pathlib, shlex, statistics, subprocess
import numpy as np
import OpenEXR
from PIL import Image, ImageFilter

# What a scenario does not say; `config-reader.ts` of the generator.
DEFAULTS = {'lighting': 'lightroom_14b.hdr', 'dimensions': {'width': 768, 'height': 768}, 'target': {'x': 0, 'y': 0, 'z': 0},
            'orbit': {'theta': 0, 'phi': 90, 'radius': 1}, 'verticalFoV': 45, 'renderSkybox': False}
# Stephen Hill's fit of the ACES tone map, with the exposure of three.js (1 / 0.6), as the set's renderers use it.
ACES_IN = np.array([[.59719, .35458, .04823], [.07600, .90834, .01566], [.02840, .13383, .83777]]) / .6
ACES_OUT = np.array([[1.60475, -.53108, -.07367], [-.10208, 1.10813, -.00605], [-.00327, -.07276, 1.07602]])
# Pixels near a border of alpha that do not count, since filters of other renderers are wider.
BORDER = 2
SHOWN = 384

def codes(rgb):
    """8-bit codes of linear light, not rounded."""
    v = rgb @ ACES_IN.T
    v = (v * (v + .0245786) - .000090537) / (v * (.983729 * v + .4329510) + .238081)
    return 255 * np.clip(v @ ACES_OUT.T, 0, 1) ** (1 / 2.2)

def scenarios(path):
    """Name and complete scenario of each in a `config.json` (a list), or in an object by name."""
    content = json.loads(path.read_text())
    content = content.get('scenarios', content)
    listed = [dict(s, name=s.get('name', name)) for name, s in content.items()] if isinstance(content, dict) else content
    fill = lambda value, default: {**default, **(value or {})} if isinstance(default, dict) else default if value is None else value
    return [{**s, **{key: fill(s.get(key), default) for key, default in DEFAULTS.items()}} for s in listed]

def find(named, places):
    """The file that a scenario names: at its path, at an end of its path, or by its name anywhere below the places; else None."""
    parts = [p for p in pathlib.PurePosixPath(named).parts if p not in ('..', '.', '/')]
    direct = [places[0] / named] + [place / pathlib.PurePath(*parts[i:]) for place in places for i in range(len(parts))]
    below = (found for place in places[1:] for end in (parts[-1], parts[-1].rsplit('.', 1)[0] + '.glb') for found in sorted(place.rglob(end)))
    return next((p for p in direct if p.is_file()), None) or next(below, None)

def camera(s):
    """Flags of a camera on an orbit: angles from +y and about it, from +z towards +x. A radius of 0 looks around."""
    theta, phi, r = math.radians(s['orbit']['theta']), math.radians(s['orbit']['phi']), s['orbit']['radius']
    out = np.array([math.sin(phi) * math.sin(theta), math.cos(phi), math.sin(phi) * math.cos(theta)])
    up = np.array([-math.cos(phi) * math.sin(theta), math.sin(phi), -math.cos(phi) * math.cos(theta)])
    target = np.array([s['target'][axis] for axis in 'xyz'], float)
    eye = target + r * out
    write = lambda v: ','.join(f'{x:.9g}' for x in v)
    return [f'--eye={write(eye)}', f'--target={write(target if r > 0 else eye - out)}', f'--up={write(up)}', f'--fov={s["verticalFoV"]}']

def render(s, a):
    """Renders a scenario into its folder: its command, statistics and what went wrong, if anything."""
    folder = a.out / s['name']
    folder.mkdir(parents=True, exist_ok=True)
    model, sky = find(s['model'], a.files), find(a.sky or s['lighting'], a.files)
    missing = [named for named, file in ((s['model'], model), (s['lighting'], sky)) if file is None]
    if missing: return {'failure': 'not here: ' + ', '.join(pathlib.PurePosixPath(m).name for m in missing), 'missing': True}
    size = s['dimensions']
    width = a.width or 2 * size['width']
    command = [a.ours, 'render', str(model), *camera(s), f'--size={width}x{max(1, round(width * size["height"] / size["width"]))}', f'--env={sky}',
               '--integrator=path', '--max-depth=unlimited', f'--background={"env" if s["renderSkybox"] else "transparent"}', '--tonemap=aces-hill',
               '--gamma=2.2', '--exposure=0', f'--max-error={a.max_error}', f'--spp={a.spp}', '--aov=stderr', '--allow-outside', '--quiet',
               '--output', str(folder / 'ours.exr'), '--output', str(folder / 'ours.png'), '--stats', str(folder / 'stats.json')]
    command += [f'--budget={a.budget}'] if a.budget else []
    kept = folder / 'command.txt'
    if not kept.is_file() or kept.read_text() != shlex.join(command):
        kept.unlink(missing_ok=True)
        run = subprocess.run(command, capture_output=True, text=True)
        # 6: written, but the error is not reached.
        if run.returncode not in (0, 6): return {'failure': run.stderr.strip() or f'exit code {run.returncode}'}
        kept.write_text(shlex.join(command))
    return {'command': shlex.join(command), **json.loads((folder / 'stats.json').read_text())}

def read(folder):
    """Codes of our picture, the standard error of each, and where it is opaque."""
    with OpenEXR.File(str(folder / 'ours.exr'), separate_channels=True) as file:
        channel = {name: c.pixels.astype(float) for name, c in file.channels().items()}
    rgb, noise = (np.stack([channel[name + k] for k in 'RGB'], -1) for name in ('', 'stderr.'))
    alpha = channel.get('A', np.ones(rgb.shape[:2]))
    return codes(rgb), np.abs(codes(rgb + noise) - codes(np.maximum(rgb - noise, 0))) / 2, alpha >= 1

def resize(plane, size):
    """Box means of each channel; of codes, as the set's own small pictures are."""
    return np.stack([np.asarray(Image.fromarray(plane[..., k].astype('f4')).resize(size, Image.BOX)) for k in range(plane.shape[-1])], -1)

def distance(ours, theirs):
    """Root mean square difference from the picture of another renderer, our own noise in it, and a map of the differences."""
    (colour, noise, opaque), (height, width) = ours, theirs.shape[:2]
    if abs(height / width - colour.shape[0] / colour.shape[1]) > .02: return None
    size = min((colour.shape[1], colour.shape[0]), (width, height))
    shrunk = colour.shape[1] / size[0]
    colour, variance = resize(colour, size), resize(noise ** 2, size) / shrunk ** 2
    theirs = resize(theirs, size)
    both = (resize(opaque[..., None], size)[..., 0] > .999) & (theirs[..., 3] > 254.5)
    both = np.asarray(Image.fromarray((255 * both).astype('u1')).filter(ImageFilter.MinFilter(2 * BORDER + 1))) > 0
    if both.sum() < 100: return None
    apart = (theirs[..., :3] - colour) ** 2
    own = math.sqrt(variance[both].mean())
    # The difference has our noise in it.
    true = math.sqrt(max(apart[both].mean() - own ** 2, 0))
    units = np.where(both, np.sqrt(apart.mean(-1)) / max(own, 1e-6), 0)
    # From black at our own error to white at a hundred times that.
    shade = np.clip(np.log10(np.maximum(units, 1)) / 2, 0, 1)
    return {'codes': true, 'own': own, 'units': true / max(own, 1e-6), 'map': Image.fromarray((255 * shade).astype('u1'))}

def compare(name, a):
    """Distance of every renderer's picture of a scenario; small copies of them and maps are written beside ours."""
    folder, rows = a.out / name, []
    files = [f for f in sorted((a.pictures / name).glob('*')) if f.suffix in ('.png', '.webp', '.jpg')] if a.pictures else []
    ours = read(folder) if files else None
    for file in files:
        picture, renderer = Image.open(file).convert('RGBA'), file.stem.removesuffix('-golden')
        row = distance(ours, np.asarray(picture, float))
        if row is None: continue
        shown = (SHOWN, max(1, round(SHOWN * picture.height / picture.width)))
        picture.resize(shown, Image.BOX).save(folder / f'{renderer}.webp')
        row.pop('map').resize(shown).save(folder / f'{renderer}-difference.webp')
        rows.append({'renderer': renderer, **row})
    return sorted(rows, key=lambda row: row['codes'])

STYLE = '''
:root { color-scheme: light dark; --ink: light-dark(#1b1f24, #e4e7eb); --soft: light-dark(#5b6470, #9aa4b0); --line: light-dark(#d9dee4, #39414b);
  --bar: light-dark(#2563a8, #6aa5e8); --page: light-dark(#fff, #15181c); --back: light-dark(#eceff2, #23282e) }
body { font: 15px/1.45 system-ui, sans-serif; color: var(--ink); background: var(--page); margin: 0 auto; max-width: 1240px; padding: 16px }
h1 { font-size: 24px } h2 { font-size: 18px; margin: 40px 0 8px } p { max-width: 72ch } .soft, figcaption { color: var(--soft) }
.row { display: flex; flex-wrap: wrap; gap: 14px } figure { margin: 0; width: min(224px, calc(50% - 7px)) } figure.ours { width: min(384px, 100%) }
img { width: 100%; display: block; background: var(--back); border-radius: 4px } figcaption { font-size: 13px; margin-top: 4px } b { color: var(--ink); font-weight: 600 }
img.map { margin-top: 4px } .scroll { overflow-x: auto } table { border-collapse: collapse; font-variant-numeric: tabular-nums }
th, td { text-align: right; padding: 3px 10px 3px 0; border-bottom: 1px solid var(--line); white-space: nowrap } th:first-child, td:first-child { text-align: left }
th { font-weight: 600 } svg { width: 100%; height: 22px; display: block; margin-top: 4px } a { color: var(--bar) } code { overflow-wrap: anywhere; font-size: 12px }
'''

def bar(error, asked):
    """The error and its interval on a line from 0, with a stroke at the error that was asked for."""
    end = 1.25 * max(asked, error['high'])
    x = lambda value: 100 * value / end
    return f'''<svg role="img" aria-label="error {error['value']:.3g}, interval {error['low']:.3g} to {error['high']:.3g}">
<line x1="0" x2="100%" y1="11" y2="11" stroke="var(--line)"/><line x1="{x(asked):.2f}%" x2="{x(asked):.2f}%" y1="3" y2="19" stroke="var(--soft)"/>
<rect x="{x(error['low']):.2f}%" width="{x(error['high'] - error['low']):.2f}%" y="7" height="8" fill="var(--bar)" opacity=".45"/>
<rect x="{x(error['value']):.2f}%" width="2" y="4" height="14" fill="var(--bar)"/></svg>'''

def section(result, asked):
    """The part of the page on a scenario."""
    name, text = result['name'], html.escape
    if 'failure' in result: return f'<h2 id="{text(name)}">{text(name)}</h2><p>Not rendered: {text(result["failure"])}</p>'
    error = (result.get('error') or {}).get('root_relmse')
    known = 'no random error' if error is None else f'error <b>{error["value"]:.2g}</b> ({error["low"]:.2g} to {error["high"]:.2g})'
    known += ', above the error asked for' if error and error['high'] > asked else ''
    doubt = (result.get('error') or {}).get('doubt')
    known += f'; doubtful: {text(str(doubt))}' if doubt else ''
    size = result['size']
    ours = f'''<figure class="ours"><img src="{name}/ours.png" alt="{text(name)} by Raywright">{bar(error, asked) if error else ''}
<figcaption><b>Raywright</b>: {known}<br>{size[0]} × {size[1]}, {result['samples'] / size[0] / size[1]:.0f} samples a pixel, {result['seconds']['render_cpu']:.0f} CPU s</figcaption></figure>'''
    others = [f'''<figure><img src="{name}/{text(row['renderer'])}.webp" alt="{text(name)} by {text(row['renderer'])}">
<img class="map" src="{name}/{text(row['renderer'])}-difference.webp" alt="map of the difference">
<figcaption><b>{text(row['renderer'])}</b>: {row['codes']:.1f} codes, <b>{row['units']:.1f}</b> × our error</figcaption></figure>''' for row in result['others']]
    warned = ''.join(f'<li>{text(str(w))}</li>' for w in result.get('warnings') or [])
    return (f'<h2 id="{text(name)}">{text(name)}</h2><div class="row">{ours}{"".join(others)}</div>' + (f'<ul>{warned}</ul>' if warned else '')
            + f'<details><summary class="soft">command</summary><code>{text(result["command"])}</code></details>')

def page(results, a):
    """The whole page."""
    made = [r for r in results if 'failure' not in r]
    reached = [r for r in made if not r.get('error') or r['error']['root_relmse']['high'] <= a.max_error]
    renderers = {}
    for row in (row for r in made for row in r['others']): renderers.setdefault(row['renderer'], []).append(row)
    middle = lambda rows, key: statistics.median(row[key] for row in rows)
    ranked = sorted(renderers.items(), key=lambda item: middle(item[1], 'codes'))
    table = ''.join(f'<tr><td>{html.escape(name)}</td><td>{len(rows)}</td><td>{middle(rows, "codes"):.1f}</td><td>{middle(rows, "units"):.1f}</td></tr>' for name, rows in ranked)
    table = f'''<h2>Renderers</h2><div class="scroll"><table><tr><th>renderer</th><th>pictures</th><th>codes</th><th>× error</th></tr>{table}</table></div>
<p class="soft">Medians of distances from our pictures. A distance is the root mean square difference of 8-bit codes where both pictures are opaque, without the share that our
noise has in it. Our error in codes is the standard error of a pixel, carried through the tone map: a distance below 1 × our error is less than the noise of our pixels. Maps
are black up to our error and white at a hundred times that. A distance tells who differs, not who is wrong: the renderers do not all simulate the same model.</p>''' if ranked else ''
    missing = [r['name'] for r in results if r.get('missing')]
    return f'''<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>Render fidelity with error bars</title><style>{STYLE}</style><h1>Render fidelity with error bars</h1>
<p>{len(made)} of {len(results)} scenarios of the Khronos render fidelity set, path traced with paths of any length, each until the upper end of the 95 % interval of its root
relMSE was below {a.max_error:g}: {len(reached)} reached that. Under a picture, the line begins at error 0, its stroke is the error asked for, and the band is the interval.</p>
{table}{''.join(section(r, a.max_error) for r in results if not r.get('missing'))}
{f'<h2>Not here</h2><p>{html.escape(", ".join(missing))}</p>' if missing else ''}</html>'''

def main():
    p = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    p.add_argument('scenarios', type=pathlib.Path)
    p.add_argument('out', type=pathlib.Path)
    p.add_argument('--ours', default='raywright', help='the program')
    p.add_argument('--files', type=pathlib.Path, action='append', default=[], help='a folder with models and skies; may be repeated')
    p.add_argument('--sky', help='a file in place of each sky, where the set\'s own is not at hand')
    p.add_argument('--pictures', type=pathlib.Path, help='folder NAME/RENDERER.png (or RENDERER-golden.png, .webp) of other renderers\' pictures')
    p.add_argument('--max-error', type=float, default=.01)
    p.add_argument('--spp', type=int, default=65536, help='most samples a pixel')
    p.add_argument('--budget', help='most time a picture, such as 10min')
    p.add_argument('--width', type=int, help='in pixels [default: twice the scenario\'s, as the set\'s own pictures]')
    p.add_argument('--only', help='names of scenarios, or parts of them, separated by commas')
    a = p.parse_args()
    a.files.insert(0, a.scenarios.parent)
    a.sky = a.sky and str(pathlib.Path(a.sky).resolve())
    chosen = [s for s in scenarios(a.scenarios) if not a.only or any(part in s['name'] for part in a.only.split(','))]
    results = []
    for s in chosen:
        result = {'name': s['name'], **render(s, a)}
        if 'failure' not in result:
            with Image.open(a.out / s['name'] / 'ours.png') as picture: result['size'] = picture.size
            result['others'] = compare(s['name'], a)
        error = (result.get('error') or {}).get('root_relmse')
        known = result.get('failure') or (f'error {error["value"]:.2g} ({error["low"]:.2g} to {error["high"]:.2g})' if error else 'no random error')
        print(s['name'], known, *(f'{row["renderer"]} {row["codes"]:.2f} codes {row["units"]:.1f} x;' for row in result.get('others', [])), flush=True)
        results.append(result)
        a.out.mkdir(parents=True, exist_ok=True)
        (a.out / 'index.html').write_text(page(results, a))
    (a.out / 'results.json').write_text(json.dumps([{k: v for k, v in r.items() if k != 'effects'} for r in results], indent=1))

if __name__ == '__main__': main()

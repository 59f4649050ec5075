#!/usr/bin/env python3
"""Sampling of the sky through openings beside sampling by its radiance alone: noise, time and means in rooms that the sky lights, and where it must cost nothing.

    python -m venv venv && venv/bin/pip install numpy OpenEXR
    venv/bin/python benches/openings.py target/release/raywright FOLDER [SCENE..] [--rounds 3] [--size 256x256] [--spp 64]

Both choices render in turns, one thread each, CPU seconds of the whole program. Variance comes from pairs of seeds, relative to the mean of all
pictures, without the worst thousandth.
"""
import argparse, os, pathlib, re, statistics, subprocess
import numpy as np
import OpenEXR

GRADIENT = 'gradient = { bottom = 0.3, top = [0.5, 0.7, 1.2], suns = [{ direction = [-0.5, 0.7, 0.8], colour = 1, weight = 20, exponent = 400 }] }'
SUN = 'gradient = { bottom = 0.2, top = [0.4, 0.6, 1], suns = [{ direction = [0.5, 0.6, 0.6], colour = 1, weight = 8000, exponent = 65536 }] }'
LOOKS = dict(wall='base_colour = 0.7, roughness = 1', floor='base_colour = [0.65, 0.45, 0.25], roughness = 0.6', thing='base_colour = [0.6, 0.2, 0.15]',
             pane='transmission = 1, roughness = 0, ior = 1.5, thin_walled = true', lamp='base_colour = 0, emission = 30')

def slab(low, high, look='wall'): return f'[[objects]]\nshape.box = {{ min = {list(low)}, max = {list(high)} }}\nmaterial = "{look}"\n'
def ball(at, radius, look='thing'): return f'[[objects]]\nshape.sphere = {{ centre = {list(at)}, radius = {radius} }}\nmaterial = "{look}"\n'

def shell(front, sky=GRADIENT, eye=(2.6, 1.6, 2.4), target=(-1.2, .9, -1.2), things=True):
    """A room of 6 by 3 by 6 metres with these objects in its front wall."""
    text = f'format = 1\nrender = {{ size = [256, 256], samples = 64, integrator = "path" }}\n' + (f'[sky]\n{sky}\n' if sky else '')
    text += f'[[cameras]]\npose.look_at = {{ eye = {list(eye)}, target = {list(target)} }}\nprojection.pinhole.vertical_fov = 60\n'
    text += ''.join(f'[[materials]]\nname = "{name}"\nmodel.physical = {{ {look} }}\n' for name, look in LOOKS.items())
    text += slab([-3.2, -.2, -3.2], [3.2, 0, 3.2], 'floor') + slab([-3.2, 3, -3.2], [3.2, 3.2, 3.2]) + slab([-3.2, 0, -3.2], [3.2, 3, -3])
    text += slab([-3.2, 0, -3], [-3, 3, 3]) + slab([3, 0, -3], [3.2, 3, 3])
    if things: text += slab([-1.6, .7, -1.6], [.2, .78, -.6], 'floor') + ball([-.9, 1.03, -1.1], .25, 'wall') + ball([1.2, .4, -1.2], .4)
    return text + front

def holes(places, low=0.0, high=3.0):
    """The front wall with rectangular holes [x, y, x, y], from left to right."""
    text, x = '', -3.2
    for left, bottom, right, top in places:
        text += slab([x, low, 3], [left, high, 3.2]) + slab([left, low, 3], [right, bottom, 3.2]) + slab([left, top, 3], [right, high, 3.2])
        x = right
    return text + slab([x, low, 3], [3.2, high, 3.2])

ONE = holes([(-2, 1.1, -.8, 2.1)])
PANE = '[[objects]]\nshape.quad = { corner = [-2, 1.1, 3.1], edge_u = [1.2, 0, 0], edge_v = [0, 1, 0] }\nmaterial = "pane"\n'
SLATS = holes([(-2.6, .4, 2.6, 2.6)]) + ''.join(slab([-2.6, y, 3.02], [2.6, y + .06, 3.14]) for y in np.arange(.4, 2.6, .1).round(2).tolist())
SHADE = holes([(-2.6, .4, 2.6, 2.6)]) + ''.join(slab([x, .4, 3.0], [x + .14, 2.6, 3.02]) for x in np.arange(-2.6, 2.6, .2).round(2).tolist()) \
    + ''.join(slab([-2.6, y, 3.03], [2.6, y + .14, 3.05]) for y in np.arange(.4, 2.6, .2).round(2).tolist())
LAMP = slab([-.6, 2.95, -.6], [.6, 2.98, .6], 'lamp')

def open_place(sky, roof):
    text = shell('', sky); objects = text.index('[[objects]]')
    return text[:objects] + slab([-8, -.2, -8], [8, 0, 8], 'floor') + roof + slab([-1.6, .7, -1.6], [.2, .78, -.6]) + ball([-.9, 1.03, -1.1], .25, 'wall') + ball([1.2, .4, -1.2], .4)

SCENES = dict(
    window=shell(ONE), pane=shell(ONE + PANE), one=shell(holes([(.5, .9, 1.3, 2.2)]), eye=(-2.6, 1.5, 2.2), target=(1, .8, -1.5)),
    three=shell(holes([(-2.4, 1, -1.6, 2.2), (-.4, 1, .4, 2.2), (1.6, 1, 2.4, 2.2)]), eye=(2.7, 1.7, -2.6), target=(-1, .8, .6)), slats=shell(SLATS), shade=shell(SHADE),
    hiddensun=open_place(SUN, slab([-2.5, 2.4, -2.5], [2.5, 2.5, 2.5])), field=open_place(GRADIENT, ''), lamp=shell(slab([-3.2, 0, 3], [3.2, 3, 3.2]) + LAMP, sky=None),
    lampandwindow=shell(ONE + LAMP))

def render(program, folder, name, choice, seed, size, spp):
    """CPU seconds and the picture."""
    scene = folder / f'{name}.scene.toml'; scene.write_text(SCENES[name])
    picture = folder / f'{name}-{choice}-{seed}-{size}-{spp}.exr'
    command = [program, 'render', scene, '-s', size, '--spp', str(spp), '--seed', str(seed), '--threads', '1', '-q', '-o', picture, '--rung', f'sky-choice={choice}']
    child = subprocess.Popen(command); _, status, used = os.wait4(child.pid, 0)
    if status: raise SystemExit(f'{name}: the render failed')
    with OpenEXR.File(str(picture)) as file: pixels = np.array(file.channels()['RGB'].pixels, dtype=np.float64)[..., :3]
    picture.unlink()
    return used.ru_utime + used.ru_stime, pixels

def cells(program, scene):
    found = re.search(r'openings: .*', subprocess.run([program, 'explain', scene], capture_output=True, text=True, check=True).stdout)
    return found.group(0).removeprefix('openings: ') if found else 'none'

def trimmed(errors): return np.sort(errors.ravel())[:int(errors.size * .999)].mean()

def main():
    p = argparse.ArgumentParser(); p.add_argument('program'); p.add_argument('folder', type=pathlib.Path); p.add_argument('scenes', nargs='*')
    p.add_argument('--rounds', type=int, default=3); p.add_argument('--size', default='256x256'); p.add_argument('--spp', type=int, default=64); a = p.parse_args()
    a.folder.mkdir(parents=True, exist_ok=True)
    print('| scene | openings | variance | a sample | time to equal noise | mean, % |\n|---|---|---|---|---|---|')
    for name in a.scenes or SCENES:
        runs = {choice: [] for choice in ('power', 'openings')}
        for round in range(a.rounds):
            for choice in runs: runs[choice] += [render(a.program, a.folder, name, choice, 2 * round + k, a.size, a.spp) for k in (1, 2)]
        mean = np.mean([picture for all in runs.values() for _, picture in all], 0); weight = 1 / (mean ** 2 + .01 * (mean.mean() / .5) ** 2)
        noise = {c: [trimmed((x - y) ** 2 * weight) / 2 for (_, x), (_, y) in zip(all[::2], all[1::2])] for c, all in runs.items()}
        time = {c: [(s + t) / 2 for (s, _), (t, _) in zip(all[::2], all[1::2])] for c, all in runs.items()}
        ratio = lambda of: [of('openings', k) / of('power', k) for k in range(a.rounds)]
        spread = lambda r: f'{statistics.median(r):.3f} [{min(r):.3f}, {max(r):.3f}]'
        means = {c: np.array([picture.mean() for _, picture in all]) for c, all in runs.items()}
        error = np.hypot(*(m.std(ddof=1) / len(m) ** .5 / m.mean() for m in means.values()))
        print(f'| {name} | {cells(a.program, a.folder / f"{name}.scene.toml")} | {spread(ratio(lambda c, k: noise[c][k]))} | {spread(ratio(lambda c, k: time[c][k]))} | '
              f'{spread(ratio(lambda c, k: noise[c][k] * time[c][k]))} | {100 * (means["openings"].mean() / means["power"].mean() - 1):+.2f} ± {100 * error:.2f} |', flush=True)

if __name__ == '__main__': main()

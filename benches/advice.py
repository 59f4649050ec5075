#!/usr/bin/env python3
"""Follows the advice of `raywright accuracy`: every setting that it names is rendered whole with other seeds and compared with the truth.

    python -m venv venv && venv/bin/pip install numpy OpenEXR
    venv/bin/python benches/advice.py target/release/raywright FOLDER SCENE[@SPP][@WxH].. [--budgets 20s,60s] [--seeds 3] [--truth 4096] [--rows 64]

For each scene and budget: the setting in use, and each setting of the first sentence, with the error that was printed, its interval, the true
error (root of the mean relMSE of renders with other seeds), CPU time of rendering printed and measured, and how much light the setting changes.
With --rows N each row of the report whose error is known is rendered, up to N samples a pixel.
Truths stay in FOLDER: two renders of half of the samples each on the rungs of the report's reference, so that what a picture differs from the
one by, times what it differs from the other by, is free of their noise.
"""
import argparse, json, pathlib, re, subprocess, time, zlib
import numpy as np
import OpenEXR

def channels(path, name):
    with OpenEXR.File(str(path)) as file:
        return np.array(file.channels()[name].pixels, dtype=np.float64)[..., :3]

def flags(rungs):
    """Rungs that ask for a setting, as words."""
    return [word for rung in rungs for word in rung.split()]

def own_rungs(spp):
    return [f'--rung samples={spp}'] if spp else []

def joined(own, setting):
    chosen = {rung.split('=')[0] for rung in setting}
    return [rung for rung in own if rung.split('=')[0] not in chosen] + setting

def follow(a, spec, budget):
    """Rows of the table, and the settings that were measured."""
    scene, *rest = spec.split('@')
    size = next((word for word in rest if 'x' in word), None)
    spp = next((word for word in rest if 'x' not in word), None)
    base = [scene] + (['--size', size] if size else [])
    name = re.sub(r'\W', '-', f"{pathlib.Path(scene.removeprefix('preset:')).name.removesuffix('.scene.toml')}-{spp or 'own'}-{size or 'own'}")
    begun = time.monotonic()
    run = subprocess.run([a.program, 'accuracy', *base, *flags(own_rungs(spp)), '--budget', budget, '--json', '-q'], capture_output=True, text=True)
    wall = time.monotonic() - begun
    if run.returncode:
        print(f'| {name} | {budget} | {run.stderr.strip()} |', flush=True)
        return None
    report = json.loads(run.stdout)
    (a.folder / f'{name}-{budget}.json').write_text(run.stdout)
    exact = [rung for rung in report['reference']['rungs'] if not rung.startswith(('--spp', '--rung samples', '--rung precision'))]
    kind = zlib.crc32(' '.join(exact).encode())
    truths = [a.folder / f'{name}-truth{k}-{kind:08x}.exr' for k in (1, 2)]
    for k, truth in enumerate(truths):
        if not truth.exists():
            subprocess.run([a.program, 'render', *base, *flags(exact), '--spp', str(a.truth // 2), '--seed', str(900001 + k), '-q', '-o', truth], check=True)
    one, other = (channels(truth, 'RGB') for truth in truths)
    weight = 1 / ((np.maximum(one + other, 0) / 2) ** 2 + .01)
    advised = [('in use', [], report['own'])]
    for kind, key in (('half', 'half_the_error'), ('same', 'same_error')):
        advice = report['answer'][key]
        if advice and advice['flags'] not in [rungs for _, rungs, _ in advised]:
            advised.append((kind, advice['flags'], advice['measured']))
    rows = [('rung', [rung['flag']], rung['measured']) for ladder in report['ladders'] for rung in ladder['rungs'] if rung['flag']]
    rows += [('front', row['flags'], row['measured']) for row in report['frontier'] + report['combinations']]
    unknown = 0
    for kind, rungs, told in rows:
        samples = next((int(rung.split('=')[1]) for rung in rungs if rung.startswith('--rung samples=')), int(spp or 64))
        if not told or samples > a.rows or rungs in [other for _, other, _ in advised]: continue
        if not told['errors']['root_relmse']['known']: unknown += 1; continue
        advised.append((kind, rungs, told))
    errors, lights, times = ([[] for _ in advised] for _ in range(3))
    # In turns: a machine's speed changes, and short renders say little of it.
    turns = 0
    while turns < a.seeds:
        for at, (kind, rungs, told) in enumerate(advised):
            scratch = a.folder / 'scratch.exr'
            subprocess.run([a.program, 'render', *base, *flags(joined(own_rungs(spp), rungs)), '--seed', str(7000 + turns), '-o', scratch, '--stats', a.folder / 'stats.json', '-q'], check=True)
            times[at].append(json.loads((a.folder / 'stats.json').read_text())['seconds']['render_cpu'])
            denoised = any('denoised' in rung for rung in rungs)
            picture = channels(scratch, 'denoised' if denoised else 'RGB')
            errors[at].append(((picture - one) * (picture - other) * weight).mean())
            lights[at].append(picture.sum() / ((one + other) / 2).sum() - 1)
        turns += 1
    held = []
    for at, (kind, rungs, told) in enumerate(advised):
        true, true_time, light = np.sqrt(max(np.mean(errors[at]), 0)), np.median(times[at]), np.mean(lights[at])
        true_ratio = np.median(np.divide(times[at], times[0]))
        error, seconds = told['errors']['root_relmse'], told['seconds']
        value, low, high = (error[k] for k in ('value', 'low', 'high'))
        ratio = told['ratio']
        held.append(low <= true <= high)
        print(f"| {name} | {budget} | {kind} | {' '.join(rungs).replace('--rung ', '') or 'as it is'} | {value:.4f} ({low:.4f} to {high:.4f}) | {true:.4f} | "
              f"{'yes' if low <= true <= high else 'NO'} | {value / true - 1:+.0%} | {seconds['value']:.2f} / {true_time:.2f} | "
              f"{ratio['value'] or 1:.2f} ({ratio['low'] or 1:.2f} to {ratio['high'] or 1:.2f}) / {true_ratio:.2f} | {light:+.2%} |", flush=True)
    settings = sum(rung['measured'] is not None for ladder in report['ladders'] for rung in ladder['rungs']) + len(report['combinations'])
    print(f"| {name} | {budget} | | {settings} settings, {report['tiles']['measured']} of {report['tiles']['all']} tiles, {wall:.1f} s; "
          f"{sum(held)} of {len(held)} rows hold, {unknown} not known{', needs %.0f s' % report['needs'] if report['needs'] else ''} |", flush=True)

if __name__ == '__main__':
    p = argparse.ArgumentParser(); p.add_argument('program'); p.add_argument('folder', type=pathlib.Path); p.add_argument('scenes', nargs='+')
    p.add_argument('--budgets', default='20s,60s'); p.add_argument('--seeds', type=int, default=3); p.add_argument('--truth', type=int, default=4096); p.add_argument('--rows', type=int, default=0); a = p.parse_args()
    a.folder.mkdir(parents=True, exist_ok=True)
    print('| scene | budget | what | setting | error told | true | holds | off by | CPU s told / true | x in use told / true | light |\n|---|---|---|---|---|---|---|---|---|---|---|')
    for scene in a.scenes:
        for budget in a.budgets.split(','): follow(a, scene, budget)

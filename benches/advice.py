#!/usr/bin/env python3
"""Follows the advice of `raywright accuracy`: each row of its table whose error is known is rendered whole with other seeds and compared with the truth.

    python -m venv venv && venv/bin/pip install numpy OpenEXR
    venv/bin/python benches/advice.py target/release/raywright FOLDER SCENE[@SPP][@WxH].. [--budgets 20s,60s] [--seeds 3] [--truth 1024] [--rows 16] [--threads 1]

For each scene and budget: the setting in use, each setting of the first sentence, and each row of the report whose error is known, up to --rows
samples a pixel, with the error that was printed, its interval, the true error (root of the mean relMSE of renders with other seeds), CPU time
of rendering printed and measured, and how much light the setting changes. A last line judges the scene: how many rows hold, and whether the
sentence is right: its settings have the error that they promise, and it names one where the table has one.
Truths and the figures of renders stay in FOLDER. A truth is two renders of half of the samples each on the rungs of the report's reference, so
that what a picture differs from the one by, times what it differs from the other by, is free of their noise.
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

def joined(own, setting):
    chosen = {rung.split('=')[0] for rung in setting}
    return [rung for rung in own if rung.split('=')[0] not in chosen] + setting

def root(error):
    """Value and ends of an error; what is not known has none."""
    return tuple(np.nan if error[k] is None else error[k] for k in ('value', 'low', 'high'))

def follow(a, spec, budget):
    """Rows of the table, and the settings that were measured. Returns how many known rows hold, of how many, and how many rows are not known."""
    scene, *rest = spec.split('@')
    size = next((word for word in rest if 'x' in word), None)
    spp = next((word for word in rest if 'x' not in word), None)
    base = [scene] + (['--size', size] if size else []) + (['--threads', a.threads] if a.threads else [])
    name = re.sub(r'\W', '-', f"{pathlib.Path(scene.removeprefix('preset:')).name.removesuffix('.scene.toml')}-{spp or 'own'}-{size or 'own'}")
    own = [f'--rung samples={spp}'] if spp else []
    begun = time.monotonic()
    run = subprocess.run([a.program, 'accuracy', *base, *flags(own), '--budget', budget, '--json', '-q'], capture_output=True, text=True)
    wall = time.monotonic() - begun
    if run.returncode:
        print(f'| {name} | {budget} | {run.stderr.strip()} |', flush=True)
        return 0, 0, 0
    report = json.loads(run.stdout)
    (a.folder / f'{name}-{budget}.json').write_text(run.stdout)
    settings = report['settings']
    in_use = {ladder['ladder']: ladder['in_use'] for ladder in report['ladders']}
    if in_use.get('reconstruction') == 'denoised':
        # An EXR file of a model keeps its noise unless a flag says otherwise.
        own = [f"--rung samples={in_use['samples']}", '--rung reconstruction=denoised']
    exact = [rung for rung in report['reference']['rungs'] if not rung.startswith(('--spp', '--rung samples', '--rung precision'))]
    kind = f"{zlib.crc32(' '.join(exact).encode()):08x}"
    truths = [a.folder / f'{name}-truth{k}-{kind}.exr' for k in (1, 2)]
    for k, truth in enumerate(truths):
        if not truth.exists():
            subprocess.run([a.program, 'render', *base, *flags(exact), '--spp', str(a.truth // 2), '--seed', str(900001 + k), '-q', '-o', truth], check=True)
    one, other = (channels(truth, 'RGB') for truth in truths)
    weight = 1 / ((np.maximum(one + other, 0) / 2) ** 2 + .01)
    advice = {what: told and settings[told['row']] for what, told in report['recommendations'].items()}
    advised = [('in use', [], settings[0])]
    for what in ('half_the_error', 'same_error'):
        if advice[what] and advice[what]['flags'] not in [rungs for _, rungs, _ in advised]:
            advised.append((what.split('_')[0], advice[what]['flags'], advice[what]))
    rows = [('front' if row in report['frontier'] else 'rung', told['flags'], told) for row, told in enumerate(settings)]
    unknown = 0
    for what, rungs, told in rows:
        # Filters have truths of their own.
        if rungs in [others for _, others, _ in advised] or any('pixel-filter' in rung for rung in rungs): continue
        if not told['errors']['root_relmse']['known']: unknown += 1; continue
        if next((int(rung.split('=')[1]) for rung in rungs if rung.startswith('--rung samples=')), int(spp or 64)) <= a.rows: advised.append((what, rungs, told))
    store = a.folder / f'{name}-renders-{kind}.json'
    renders = json.loads(store.read_text()) if store.exists() else {}
    # In turns: a machine's speed changes, and short renders say little of it.
    for turn in range(a.seeds):
        for _, rungs, _ in advised:
            key = ' '.join(rungs) + f' {turn}'
            if key in renders: continue
            scratch = a.folder / 'scratch.exr'
            subprocess.run([a.program, 'render', *base, *flags(joined(own, rungs)), '--seed', str(7000 + turn), '-o', scratch, '--stats', a.folder / 'stats.json', '-q'], check=True)
            picture = channels(scratch, 'denoised' if any('denoised' in rung for rung in joined(own, rungs)) else 'RGB')
            renders[key] = [((picture - one) * (picture - other) * weight).mean(), picture.sum() / ((one + other) / 2).sum() - 1,
                            json.loads((a.folder / 'stats.json').read_text())['seconds']['render_cpu']]
            store.write_text(json.dumps(renders))
    held, true = [], {}
    for what, rungs, told in advised:
        figures = np.array([renders[' '.join(rungs) + f' {turn}'] for turn in range(a.seeds)])
        error, light, seconds = np.sqrt(max(figures[:, 0].mean(), 0)), figures[:, 1].mean(), np.median(figures[:, 2])
        true[what] = error, seconds
        value, low, high = root(told['errors']['root_relmse'])
        ratio = told['ratio']
        is_known = told['errors']['root_relmse']['known']
        if is_known: held.append(low <= error <= high)
        holds = ('yes' if held[-1] else 'NO') if is_known else 'not known'
        printed = f'{value:.4f} ({low:.4f} to {high:.4f})' if is_known else 'not known'
        print(f"| {name} | {budget} | {what} | {' '.join(rungs).replace('--rung ', '') or 'as it is'} | {printed} | {error:.4f} | {holds} | "
              f"{told['seconds']['value']:.2f} / {seconds:.2f} | {ratio['value'] or 1:.2f} / {seconds / true['in use'][1]:.2f} | {light:+.2%} |", flush=True)
    # The sentence is right if what it names is: about half the error, or no more of it in less time.
    verdict = []
    for what, most in (('half', .6), ('same', 1.1)):
        if what in true:
            is_right = true[what][0] <= most * true['in use'][0] and (what == 'half' or true[what][1] < true['in use'][1])
            verdict.append(f"{what} {'right' if is_right else 'WRONG'}: {true[what][0] / true['in use'][0]:.2f} of the error, {true[what][1] / true['in use'][1]:.2f} x the time")
    at_most = root(settings[0]['errors']['root_relmse'])[0] * .55
    if not advice['half_the_error'] and any(root(settings[row]['errors']['root_relmse'])[0] <= at_most for row in report['frontier']):
        verdict.append('half WRONG: the table has it, and the sentence does not')
    print(f"| {name} | {budget} | | {sum(held)} of {len(held)} known rows hold, {unknown} not known; {'; '.join(verdict) or 'no advice'}; "
          f"{report['tiles']['measured']} of {report['tiles']['all']} tiles, {wall:.1f} s |", flush=True)
    return sum(held), len(held), unknown

if __name__ == '__main__':
    p = argparse.ArgumentParser(); p.add_argument('program'); p.add_argument('folder', type=pathlib.Path); p.add_argument('scenes', nargs='+')
    p.add_argument('--budgets', default='20s,60s'); p.add_argument('--seeds', type=int, default=3); p.add_argument('--truth', type=int, default=1024)
    p.add_argument('--rows', type=int, default=16); p.add_argument('--threads'); a = p.parse_args()
    a.folder.mkdir(parents=True, exist_ok=True)
    print('| scene | budget | what | setting | error told | true | holds | CPU s told / true | x in use told / true | light |\n|---|---|---|---|---|---|---|---|---|---|')
    counts = np.array([follow(a, scene, budget) for scene in a.scenes for budget in a.budgets.split(',')]).sum(axis=0)
    print(f'{counts[0]} of {counts[1]} known rows hold; {counts[2]} rows are not known.')

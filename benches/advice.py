#!/usr/bin/env python3
"""Follows the advice of `raywright accuracy`: rows of its table whose error is known are rendered whole with other seeds and compared with the truth.

    python -m venv venv && venv/bin/pip install numpy OpenEXR
    venv/bin/python benches/advice.py target/release/raywright FOLDER SCENE[@SPP][@WxH].. [--budgets 30s] [--seeds 2] [--truth 1024] [--follow 60] [--threads 1]

Followed are, of each scene and budget, the setting in use, the settings of the sentence, those of the frontier, then the other known rows of at most
64 samples in an order by chance, until their renders took --follow CPU seconds. Each has a line: the error that was printed with its interval, the true
one (root of the mean relMSE of renders with other seeds), CPU time printed and measured, and how much light it changes. A further line judges the
scene: how many known rows hold, the share of known rows, their greatest ratio of ends, whether each setting of the sentence has error, time and light as
said, and its time over that of the fastest followed setting that does the same. Reports, truths and figures of renders stay in FOLDER and are used again;
`--follow 0` makes the reports alone. A truth is two renders of half of the samples each on the rungs of the report's reference, so that what a picture
differs from the one by, times what it differs from the other by, is free of their noise.
"""
import argparse, json, pathlib, re, subprocess, time, zlib
import numpy as np
import OpenEXR

def channels(path, name):
    with OpenEXR.File(str(path)) as file:
        return np.array(file.channels()[name].pixels, dtype=np.float64)[..., :3]

def words(flags):
    """Flags of a setting as words."""
    return [word for flag in flags for word in flag.split()]

def joined(own, setting):
    """Flags of a setting beside those in use: of one ladder the last counts. Too few samples are not denoised."""
    all = own + setting
    samples = next((int(flag.split()[1]) for flag in reversed(all) if flag.startswith('--spp ')), 64)
    return [flag for flag in all if flag != '--denoise' or samples >= 8]

def measured(a, spec, budget):
    """The scene's name in files, its flags, the rungs in use, and the report, measured now unless it is kept."""
    scene, *rest = spec.split('@')
    size = next((word for word in rest if 'x' in word), None)
    spp = next((word for word in rest if 'x' not in word), None)
    base = [scene] + (['--size', size] if size else []) + (['--threads', a.threads] if a.threads else [])
    name = re.sub(r'\W', '-', f"{pathlib.Path(scene.removeprefix('preset:')).name.removesuffix('.scene.toml')}-{spp or 'own'}-{size or 'own'}")
    own = [f'--spp {spp}'] if spp else []
    chosen = ['--rung', f'samples={spp}'] if spp else []
    kept = a.folder / f'{name}-{budget}{a.suffix}.json'
    if not kept.exists():
        begun = time.monotonic()
        run = subprocess.run([a.program, 'accuracy', *base, *chosen, '--budget', budget, '--json', '-q'], capture_output=True, text=True)
        report = json.loads(run.stdout) if run.returncode == 0 else {'failure': run.stderr.strip()}
        kept.write_text(json.dumps(report | {'wall': time.monotonic() - begun}))
    report = json.loads(kept.read_text())
    if 'settings' in report:
        in_use = {ladder['ladder']: ladder['in_use'] for ladder in report['ladders']}
        if in_use.get('reconstruction') == 'denoised':
            # An EXR file of a model keeps its noise unless a flag says otherwise.
            own = [f"--spp {in_use['samples']}", '--denoise']
    return name, base, own, report

class Follower:
    """Renders settings of a scene with other seeds, and keeps their figures."""
    def __init__(self, a, name, base, own, report):
        self.a, self.base, self.own = a, base, own
        exact = [rung for rung in report['reference']['rungs'] if not rung.startswith(('--spp', '--precision'))]
        kind = f"{zlib.crc32(' '.join(exact).encode()):08x}"
        truths = [a.folder / f'{name}-truth{k}-{kind}.exr' for k in (1, 2)]
        for k, truth in enumerate(truths):
            if not truth.exists():
                subprocess.run([a.program, 'render', *base, *words(exact), '--spp', str(a.truth // 2), '--seed', str(900001 + k), '-q', '-o', truth], check=True)
        self.truths = [channels(truth, 'RGB') for truth in truths]
        self.weight = 1 / ((np.maximum(sum(self.truths), 0) / 2) ** 2 + .01)
        self.store = a.folder / f'{name}-renders-{kind}.json'
        self.renders = json.loads(self.store.read_text()) if self.store.exists() else {}
        self.spent = 0

    def figures(self, rungs):
        """True error, change of light and CPU seconds of a setting."""
        for turn in range(self.a.seeds):
            key = ' '.join(rungs) + f' {turn}'
            if key not in self.renders:
                scratch, stats = (self.a.folder / f'scratch{self.store.stem}.{end}' for end in ('exr', 'json'))
                all = joined(self.own, rungs)
                subprocess.run([self.a.program, 'render', *self.base, *words(all), '--seed', str(7000 + turn), '-o', scratch, '--stats', stats, '-q'], check=True)
                picture = channels(scratch, 'denoised' if [flag for flag in all if flag.endswith('denoise')][-1:] == ['--denoise'] else 'RGB')
                one, other = self.truths
                seconds = json.loads(stats.read_text())['seconds']['render_cpu']
                self.renders[key] = [((picture - one) * (picture - other) * self.weight).mean(), 2 * picture.sum() / (one + other).sum() - 1, seconds]
                self.store.write_text(json.dumps(self.renders))
            self.spent += self.renders[key][2]
        rows = np.array([self.renders[' '.join(rungs) + f' {turn}'] for turn in range(self.a.seeds)])
        return np.sqrt(max(rows[:, 0].mean(), 0)), rows[:, 1].mean(), np.median(rows[:, 2])

def judged(report, advice, true):
    """Of each setting of the sentence: whether error, time and light are as said, and its time over that of the fastest that does the same."""
    own_error, own_light, own_seconds = true[0]
    for what, most in (('half_the_error', .56), ('same_error', 1.1)):
        if advice[what] not in true: continue
        row = report['settings'][advice[what]]
        error, light, seconds = true[advice[what]]
        best = min([seconds] + [of[2] for of in true.values() if of[0] <= max(most * own_error, error) and abs(of[1] - own_light) < .005])
        told = row['ratio']['value']
        is_right = error <= most * own_error and abs(seconds / own_seconds / told - 1) < .15
        yield what, is_right, f"{error / own_error:.2f} of the error, {seconds / own_seconds:.2f} x the time ({told:.2f} told), light {light - own_light:+.2%}, {seconds / best:.2f} of the fastest"

def follow(a, spec, budget):
    """Prints the lines of a scene. Returns how many followed known rows hold, of how many, how many rows are known, and of how many."""
    name, base, own, report = measured(a, spec, budget)
    if 'failure' in report:
        print(f"| {name} | {budget} | {report['failure']} |", flush=True)
        return 0, 0, 0, 0
    settings, seconds = report['settings'], float(budget.removesuffix('s'))
    # Filters have truths of their own.
    settings_of_truth = [row for row, told in enumerate(settings) if not any('pixel-filter' in rung for rung in told['flags'])]
    errors = [told['errors']['root_relmse'] for told in settings]
    known = [row for row in settings_of_truth if errors[row]['known']]
    ratios = [errors[row]['high'] / errors[row]['low'] for row in known if errors[row]['low']]
    summary = f"{len(known)} of {len(settings_of_truth)} rows known, ends within {max(ratios, default=1):.1f}; {report['wall'] / seconds:.2f} of the budget"
    if not a.follow:
        print(f'| {name} | {budget} | {summary} |', flush=True)
        return 0, 0, len(known), len(settings_of_truth)
    follower = Follower(a, name, base, own, report)
    advice = {what: told and told['row'] for what, told in report['recommendations'].items()}
    by_chance = sorted(known, key=lambda row: zlib.crc32(' '.join(settings[row]['flags']).encode()))
    samples = lambda row: next((int(flag.split()[1]) for flag in settings[row]['flags'] if flag.startswith('--spp ')), 0)
    must = [0] + [row for row in advice.values() if row]
    true, held = {}, 0
    for row in dict.fromkeys(must + [row for row in report['frontier'] + by_chance if row in known and samples(row) <= 64]):
        if row not in must and follower.spent > a.follow: break
        rungs, told = settings[row]['flags'], errors[row]
        error, light, cpu = true[row] = follower.figures(rungs)
        holds = told['known'] and told['low'] <= error <= told['high']
        held += holds
        printed = f"{told['value']:.4f} ({told['low']:.4f} to {told['high']:.4f})" if told['known'] else 'not known'
        print(f"| {name} | {budget} | {' '.join(rungs) if row else 'in use'} | {printed} | {error:.4f} | {('yes' if holds else 'NO') if told['known'] else '-'} | "
              f"{settings[row]['seconds']['value']:.2f} / {cpu:.2f} | {settings[row]['ratio']['value'] or 1:.2f} / {cpu / true[0][2]:.2f} | {light:+.2%} |", flush=True)
    followed = sum(errors[row]['known'] for row in true)
    verdicts = [f"{what}: {'right' if is_right else 'WRONG'}, {words}" for what, is_right, words in judged(report, advice, true)]
    print(f"| {name} | {budget} | **{held} of {followed} known rows hold**; {summary}; {'; '.join(verdicts) or 'no advice'} |", flush=True)
    return held, followed, len(known), len(settings_of_truth)

if __name__ == '__main__':
    p = argparse.ArgumentParser(); p.add_argument('program'); p.add_argument('folder', type=pathlib.Path); p.add_argument('scenes', nargs='+')
    p.add_argument('--budgets', default='30s'); p.add_argument('--seeds', type=int, default=2); p.add_argument('--truth', type=int, default=1024)
    p.add_argument('--follow', type=float, default=60); p.add_argument('--threads'); p.add_argument('--suffix', default=''); a = p.parse_args()
    a.folder.mkdir(parents=True, exist_ok=True)
    print('| scene | budget | setting | error told | true | holds | CPU s told / true | x in use told / true | light |\n|---|---|---|---|---|---|---|---|---|')
    counts = np.array([follow(a, scene, budget) for scene in a.scenes for budget in a.budgets.split(',')]).sum(axis=0)
    print(f'{counts[0]} of {counts[1]} known rows that were followed hold; {counts[2]} of {counts[3]} rows are known.')

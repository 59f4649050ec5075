#!/usr/bin/env python3
"""Renders scenes many times with few samples, denoises what is kept of each, and tells how often the claimed intervals hold the true error.

    python -m venv venv && venv/bin/pip install numpy OpenEXR
    venv/bin/python benches/claims.py target/release/raywright FOLDER SCENE.. [--renders 100] [--sizes 64x48,32x24] [--samples 16,64]

As `cargo bench --bench denoise` does, but films and truths stay in FOLDER, so that another program judges the very same noise: run it again
with that. A film of 64 x 48 pixels has 1.3 MB. The truth is two renders of 2048 samples: what a picture differs from the one by, times
what it differs from the other by, is free of their noise.
"""
import argparse, pathlib, re, subprocess
import numpy as np
import OpenEXR

def channels(path, name):
    with OpenEXR.File(str(path)) as file:
        return np.array(file.channels()[name].pixels, dtype=np.float64)[..., :3]

def cell(a, scene, size, samples):
    """A row of the table."""
    name = re.sub(r'\W', '-', pathlib.Path(scene.removeprefix('preset:')).name.removesuffix('.scene.toml'))
    base = [a.program, 'render', scene, '--integrator', 'path', '-s', size, '-q']
    truths = [a.folder / f'{name}-{size}-truth{k}.exr' for k in (1, 2)]
    for k, truth in enumerate(truths):
        if not truth.exists():
            subprocess.run(base + ['--spp', '2048', '--seed', str(900001 + k), '-o', truth], check=True)
    one, other = (channels(truth, 'RGB') for truth in truths)
    relative = lambda picture: ((picture - one) * (picture - other) / (np.maximum((one + other) / 2, 0) ** 2 + .01)).mean()
    before, after, claims, scratch = [], [], [], a.folder / 'scratch.exr'
    for seed in range(1, a.renders + 1):
        film = a.folder / f'{name}-{size}-{samples}-{seed}.film'
        if not film.exists():
            part = film.with_suffix('.part')
            subprocess.run(base + ['--spp', str(samples), '--seed', str(seed), '--denoise', '--checkpoint', part, '-o', scratch], check=True)
            part.rename(film)
        run = subprocess.run([a.program, 'denoise', film, '-v', '-o', scratch], capture_output=True, text=True, check=True)
        number, told = r'[\d.e-]+', r'(?:at most [\d.e-]+|[\d.e-]+ \([^)]*\))'
        # A claim with a reservation counts as none.
        claimed = re.search(rf'denoised \(biased\): root relMSE ({told}), RMSE {told};', run.stderr + run.stdout)
        figures = [float(x) for x in re.findall(number, claimed.group(1))] if claimed else [np.nan] * 3
        claims.append(figures if len(figures) == 3 else [0, 0, *figures])
        before.append(relative(channels(scratch, 'RGB'))); after.append(max(relative(channels(scratch, 'denoised')), 0))
    error, claims = np.sqrt(after), np.array(claims)
    known = ~np.isnan(claims[:, 0])
    held = f"{100 * np.mean((claims[:, 1] <= error)[known] & (error <= claims[:, 2])[known]):.1f} %" if known.any() else '-'
    value = f"{np.sqrt(np.mean(claims[known, 0] ** 2)):.4f}" if known.any() else '-'
    print(f'| {name} | {size} | {samples} | {a.renders} | {np.sqrt(np.mean(before)):.4f} | {np.sqrt(np.mean(after)):.4f} | {value} | {held} | {100 * np.mean(~known):.1f} % |', flush=True)

if __name__ == '__main__':
    p = argparse.ArgumentParser(); p.add_argument('program'); p.add_argument('folder', type=pathlib.Path); p.add_argument('scenes', nargs='+')
    p.add_argument('--renders', type=int, default=100); p.add_argument('--sizes', default='64x48,32x24'); p.add_argument('--samples', default='16,64'); a = p.parse_args()
    a.folder.mkdir(parents=True, exist_ok=True)
    print('| scene | size | samples | renders | root relMSE | denoised | claimed where known | interval holds | not known |\n|---|---|---|---|---|---|---|---|---|')
    for scene in a.scenes:
        for size in a.sizes.split(','):
            for samples in a.samples.split(','): cell(a, scene, size, int(samples))

#!/usr/bin/env python3
"""Renders scenes many times with few samples, and tells how often the claimed intervals of the noisy and the denoised picture hold the true error.

    python -m venv venv && venv/bin/pip install numpy OpenEXR
    venv/bin/python benches/claims.py target/release/raywright FOLDER SCENE.. [--renders 100] [--size 48x32] [--samples 16,64,256] [--truth 2048]

As `cargo bench --bench claims` does, but films and pictures stay in FOLDER, so that another program judges the very same noise: run it again with
that. A film of 48 x 32 pixels has 0.6 MB. The truth is the mean of a render of `--truth` samples and of all renders except the one that is judged;
its own variance is subtracted. Flagged renders claim nothing.
"""
import argparse, json, pathlib, re, subprocess
import numpy as np
import OpenEXR

def channels(path, name):
    with OpenEXR.File(str(path)) as file:
        return np.array(file.channels()[name].pixels, dtype=np.float64)[..., :3]

def renders(a, scene):
    """Number of samples, noisy and denoised picture, and claims of each render; those of the truth are none."""
    name = re.sub(r'\W', '-', pathlib.Path(scene.removeprefix('preset:')).name.removesuffix('.scene.toml'))
    base = [a.program, 'render', scene, '--integrator', 'path', '-s', a.size, '-q', '--threads', '1']
    truth, picture, stats = a.folder / f'{name}-{a.size}-truth.exr', a.folder / 'scratch.exr', a.folder / 'scratch.json'
    if not truth.exists():
        subprocess.run(base + ['--spp', str(a.truth), '--seed', '900001', '-o', truth], check=True)
    yield a.truth, channels(truth, 'RGB'), None, None
    for samples in a.samples:
        for seed in range(1, a.renders + 1):
            # A film that has all of its samples is read and judged, not rendered again.
            film = a.folder / f'{name}-{a.size}-{samples}-{seed}.film'
            subprocess.run(base + ['--spp', str(samples), '--seed', str(seed), '--denoise', '--checkpoint', film, '-o', picture, '--stats', stats], check=True)
            told = json.loads(stats.read_text())
            yield samples, channels(picture, 'RGB'), channels(picture, 'denoised'), [told['error'], told['denoised']]

def judge(a, scene):
    """Two rows of the table for each number of samples: noisy, denoised."""
    counts, noisy, denoised, claims = zip(*renders(a, scene))
    n, noisy = np.array(counts, float)[:, None, None, None], np.array(noisy)
    mean = (n * noisy).sum(0) / n.sum()
    variance = (n * (noisy - mean) ** 2).sum(0) / (len(n) - 1)
    for samples in a.samples:
        for kind in (0, 1):
            errors, known, held = [], [], 0
            for i in (i for i, of in enumerate(counts) if claims[i] and of == samples):
                rest = n.sum() - samples
                truth = (mean * n.sum() - samples * noisy[i]) / rest
                square = (((noisy, denoised)[kind][i] - truth) ** 2 - variance / rest) / (truth ** 2 + .01)
                errors.append(max(square.mean(), 0)); claim = claims[i][kind]
                if not claim['doubt']:
                    known.append(claim['root_relmse']['value'] ** 2)
                    held += claim['root_relmse']['low'] <= errors[-1] ** .5 <= claim['root_relmse']['high']
            value = f'{np.mean(known) ** .5:.4f}' if known else '-'
            print(f'| {scene} | {samples} | {("noisy", "denoised")[kind]} | {np.mean(errors) ** .5:.4f} | {value} | {held} of {len(known)} | {len(errors) - len(known)} |', flush=True)

if __name__ == '__main__':
    p = argparse.ArgumentParser(); p.add_argument('program'); p.add_argument('folder', type=pathlib.Path); p.add_argument('scenes', nargs='+')
    p.add_argument('--renders', type=int, default=100); p.add_argument('--size', default='48x32'); p.add_argument('--truth', type=int, default=2048)
    p.add_argument('--samples', type=lambda text: [int(n) for n in text.split(',')], default=[16, 64, 256]); a = p.parse_args()
    a.folder.mkdir(parents=True, exist_ok=True)
    print('| scene | samples | picture | root relMSE | claimed where known | interval holds | flagged |\n|---|---|---|---|---|---|---|')
    for scene in a.scenes: judge(a, scene)

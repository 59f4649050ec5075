#!/usr/bin/env python3
"""Renders scenes until a requested error, and tells how often they meet it and how many samples that costs beside an oracle.

    python -m venv venv && venv/bin/pip install numpy OpenEXR
    venv/bin/python benches/requested.py target/release/raywright FOLDER SCENE=ERROR.. [--denoise] [--renders 10] [--size 96x64] [--truth 512]

The oracle knows how many samples suffice if every pixel takes the same number, on average over two renders of each power of two. Errors are
relative to two renders of `--truth` samples: the difference from the one, times the difference from the other, is free of their noise. Pictures
stay in FOLDER and are not rendered again.
"""
import argparse, json, pathlib, re, subprocess
import numpy as np
import OpenEXR

def judge(a, scene, error):
    """A row of the table."""
    name = re.sub(r'\W', '-', pathlib.Path(scene.removeprefix('preset:')).name.removesuffix('.scene.toml'))
    layer = 'denoised' if a.denoise else 'RGB'
    def render(of, *flags):
        picture = a.folder / f'{name}-{a.size}-{of}.exr'
        if not picture.exists():
            base = [a.program, 'render', scene, '--integrator', 'path', '-s', a.size, '-q', '--threads', '1']
            subprocess.run(base + [*map(str, flags), '-o', picture, '--stats', picture.with_suffix('.json')], check=True)
        return picture
    def channels(picture, layer):
        with OpenEXR.File(str(picture)) as file:
            return np.array(file.channels()[layer].pixels, dtype=np.float64)[..., :3]
    one, other = (channels(render(f'truth{k}', '--spp', a.truth, '--seed', 900000 + k), 'RGB') for k in (1, 2))
    weights = 1 / (np.maximum((one + other) / 2, 0) ** 2 + .01)
    def root(pictures):
        squares = [max(((of - one) * (of - other) * weights).mean(), 0) for of in (channels(picture, layer) for picture in pictures)]
        return np.sqrt(np.mean(squares)), np.mean(np.array(squares) <= error ** 2)
    samples, now, before = 16, 0, 0
    while True:
        before, now = now, root([render(f'{samples}-{seed}', '--spp', samples, '--seed', seed, '--denoise') for seed in (1, 2)])[0]
        if now < error or samples >= 4096: break
        samples *= 2
    oracle = samples / 2 * 2 ** (np.log(before / error) / np.log(before / now)) if before else samples
    asked = ['--spp', 4096, '--max-error', error] + ['--denoise'] * a.denoise
    all = [render(f'{layer}-{error}-{seed}', '--seed', seed, *asked) for seed in range(1, a.renders + 1)]
    reached, within = root(all)
    width, height = map(int, a.size.split('x'))
    taken = np.mean([json.loads(picture.with_suffix('.json').read_text())['samples'] for picture in all]) / width / height
    print(f'| {name} | {len(all)} | {error} | {reached:.4f} | {100 * within:.0f} % | {taken:.0f} | {oracle:.0f} | {taken / oracle:.2f} |', flush=True)

if __name__ == '__main__':
    p = argparse.ArgumentParser(); p.add_argument('program'); p.add_argument('folder', type=pathlib.Path); p.add_argument('scenes', nargs='+')
    p.add_argument('--denoise', action='store_true'); p.add_argument('--renders', type=int, default=10)
    p.add_argument('--size', default='96x64'); p.add_argument('--truth', type=int, default=512); a = p.parse_args()
    a.folder.mkdir(parents=True, exist_ok=True)
    print('| scene | runs | requested | reached | within | samples | oracle\'s, the same everywhere | ratio |\n|---|---|---|---|---|---|---|---|')
    for scene in a.scenes:
        scene, error = scene.rsplit('=', 1)
        judge(a, scene, float(error))

"""How the error of path-traced pictures falls as samples grow: the slope of log RMSE over log samples, over whole pictures and where
they are smooth. A half is what chance alone gives; points that are even together do better where what they sample is smooth.

    venv/bin/python benches/convergence.py OUT --ours target/release/raywright [--scenes cornell,product] [--edge 64]

The error is the standard deviation of a pixel over pictures of different seeds (root of the mean variance over pixels and channels),
so that no converged picture is needed and none has to be trusted. Smooth is a pixel that differs from each of its eight neighbours by
less than a twentieth in the mean of all pictures at the most samples. Needs numpy and OpenEXR.
"""
import argparse, math, os, subprocess
import numpy as np
from paths import read_exr

def pictures(binary, out, scene, edge, spp, seeds):
    for seed in range(seeds):
        exr = f'{out}/convergence.exr'
        subprocess.run([binary, 'render', f'preset:{scene}', '--integrator', 'path', '--size', f'{edge}x{edge}', '--spp', str(spp), '--seed', str(seed), '-q', '-o', exr], check=True)
        yield read_exr(exr)

def smooth(picture):
    """Where each of the eight neighbours is nearly alike, in every channel; not at the picture's border."""
    edge = np.zeros(picture.shape[:2], bool); middle = picture[1:-1, 1:-1]; h, w = picture.shape[:2]
    alike = np.ones(middle.shape[:2], bool)
    for dy in range(3):
        for dx in range(3):
            other = picture[dy:dy + h - 2, dx:dx + w - 2]
            alike &= (np.abs(other - middle) <= .05 * np.abs(middle)).all(-1) & (middle.max(-1) > 0)
    edge[1:-1, 1:-1] = alike
    return edge

def slope(x, y):
    """Of the line through the points in both logarithms, by least squares."""
    return np.polyfit(np.log(x), np.log(y), 1)[0] if min(y) > 0 else float('nan')

def main():
    ap = argparse.ArgumentParser(); ap.add_argument('out'); ap.add_argument('--ours', required=True); ap.add_argument('--edge', type=int, default=64)
    ap.add_argument('--scenes', default='cornell,glossy-box,many-lights,product'); ap.add_argument('--seeds', type=int, default=8)
    ap.add_argument('--samples', default='4,16,64,256'); a = ap.parse_args()
    os.makedirs(a.out, exist_ok=True); samples = [int(s) for s in a.samples.split(',')]
    print('| scene | slope everywhere | where smooth | share of pixels that are | RMSE by samples, everywhere; where smooth |\n|---|---|---|---|---|')
    for scene in a.scenes.split(','):
        runs = [np.stack(list(pictures(a.ours, a.out, scene, a.edge, spp, a.seeds))) for spp in samples]
        even = smooth(runs[-1].mean(0))
        variances = [r.var(0, ddof=1) for r in runs]
        whole = [math.sqrt(v.mean()) for v in variances]
        part = [math.sqrt(v[even].mean()) if even.any() else 0. for v in variances]
        figures = lambda values: ', '.join(f'{s}: {v:.3g}' for s, v in zip(samples, values))
        print(f'| {scene} | {slope(samples, whole):.3f} | {slope(samples, part):.3f} | {even.mean():.2f} | {figures(whole)}; {figures(part)} |', flush=True)
if __name__ == '__main__': main()

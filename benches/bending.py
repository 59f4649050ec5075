#!/usr/bin/env python3
"""What bending normals (crates/core/src/material/bent.rs) does to the brightness of a matte surface with a normal map. Needs numpy.

    benches/bending.py

Normals lean from the surface's own to every side, spread evenly over a disc of so many degrees. For views so many degrees from the surface's
normal: the share of normals that bend, and how much brighter a matte surface is for it under an even sky and under a lamp at 36 degrees.
"""
import numpy as np

LEAST = .02
UP = np.array([0, 0, 1.])

def bent(n, d):
    """Normals as they are bent for rays along d, and which of them stay."""
    rise, own = n @ UP, -d @ UP
    height = -2 * (n @ d) * rise - own
    least = min(.9 * own, LEAST); half = least / 2
    stays = (height >= least) & (rise > 0)
    lifted = half + half * half / (half + least - np.minimum(height, least))
    across = n * (own + lifted)[:, None] + d * np.maximum(rise, 0)[:, None]
    along = across - UP * (across @ UP)[:, None]; along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-30)
    out = along * np.sqrt(1 - lifted ** 2)[:, None] + UP * lifted[:, None] - d
    return np.where(stays[:, None], n, out / np.linalg.norm(out, axis=1, keepdims=True)), stays

def main():
    random, count = np.random.default_rng(1), 200_000
    lamp = np.array([.5, .3, .81]); lamp /= np.linalg.norm(lamp)
    sky = lambda n: (1 + n[:, 2]) / 2
    key = lambda n: np.maximum(n @ lamp, 0)
    print('| slopes to | view | bent | under a sky | under a lamp |\n|---|---|---|---|---|')
    for slope in (10, 20, 30, 45):
        a, t = random.uniform(0, 2 * np.pi, count), np.radians(slope) * np.sqrt(random.uniform(0, 1, count))
        n = np.stack([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)], 1)
        for view in (20, 45, 60, 75, 85):
            d = -np.array([np.sin(np.radians(view)), 0, np.cos(np.radians(view))])
            b, stays = bent(n, d); seen = n @ -d > 0
            change = [100 * (light(b)[seen].mean() / light(n)[seen].mean() - 1) for light in (sky, key)]
            print(f'| {slope} | {view} | {100 * np.mean(~stays[seen]):.0f} % | {change[0]:+.2f} % | {change[1]:+.2f} % |')

if __name__ == '__main__':
    main()

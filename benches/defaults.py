#!/usr/bin/env python3
"""Renders every model of some folders at the defaults, puts the pictures on one sheet, and tells whether each is easy to see.

    benches/defaults.py target/release/raywright ../shared/assets/gltf ../shared/assets/obj -o sheet.png

For each picture: how far the object is from its surroundings (medians of luma, in codes), how much of the tighter side of the picture and of
its area the silhouette takes, how many pixels are clipped and whether all are black. The object is known by the coverage of a second picture
with a transparent background. A model with a camera of its own is framed by its author, so that its silhouette is not counted; one that shows
no triangle, or that is refused, is listed. Python's standard library alone.
"""

import argparse
import os
import pathlib
import statistics
import struct
import subprocess
import tempfile
import zlib

SUFFIXES = {".glb", ".gltf", ".obj", ".stl", ".ply"}
APART, SHARE, SIDE, CLIPPED = 40.0, (0.35, 0.75), 0.70, 0.01


def read_png(path):
    """Width, height and rows of (r, g, b, a) bytes of an 8-bit PNG of ours."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        chunk = data[at + 8 : at + 8 + length]
        at += 12 + length
        if kind == b"IHDR":
            width, height, _, colour = struct.unpack(">IIBB", chunk[:10])
        elif kind == b"IDAT":
            packed += chunk
    channels = 4 if colour == 6 else 3
    raw, stride, rows, above = zlib.decompress(packed), width * channels, [], None
    above = bytearray(stride)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for x in range(stride):
            left = row[x - channels] if x >= channels else 0
            corner = above[x - channels] if x >= channels else 0
            if kind == 1:
                guess = left
            elif kind == 2:
                guess = above[x]
            elif kind == 3:
                guess = (left + above[x]) // 2
            elif kind == 4:
                guess = min((abs(above[x] - corner), 0, left), (abs(left - corner), 1, above[x]), (abs(left + above[x] - 2 * corner), 2, corner))[2]
            else:
                break
            row[x] = (row[x] + guess) & 255
        rows.append(row)
        above = row
    return width, height, channels, rows


def write_png(path, width, rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, len(rows), 8, 2, 0, 0, 0)
    body = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 6)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b""))


def measure(picture, mask):
    """What the numbers are of one picture, by the coverage of the other."""
    width, height, channels, rows = picture
    alpha = [row[3::4] for row in mask[3]]
    inside = [(x, y) for y in range(height) for x in range(width) if alpha[y][x] >= 250]
    touched = [(x, y) for y in range(height) for x in range(width) if alpha[y][x] > 0]
    if not touched:
        return None

    def luma(x, y):
        r, g, b = rows[y][channels * x : channels * x + 3]
        return 0.2126 * r + 0.7152 * g + 0.0722 * b

    # What surrounds it: nothing is covered, and something is within a tenth of the height, along rows, columns and diagonals.
    reach = max(2, height // 10)
    near = bytearray(width * height)
    for x, y in touched:
        near[y * width + x] = 1
    for axis in (1, width, width + 1, width - 1):
        grown = bytearray(near)
        for place, there in enumerate(near):
            if there:
                for step in range(-reach, reach + 1, 2):
                    other = place + step * axis
                    if 0 <= other < width * height:
                        grown[other] = 1
        near = grown
    around = [(x, y) for y in range(height) for x in range(width) if near[y * width + x] and alpha[y][x] == 0]
    xs, ys = [x for x, _ in touched], [y for _, y in touched]
    pixels = [rows[y][channels * x : channels * x + 3] for y in range(height) for x in range(width)]
    return {
        "apart": abs(statistics.median(luma(x, y) for x, y in inside or touched) - statistics.median(luma(x, y) for x, y in around)) if around else None,
        "side": max((max(xs) - min(xs) + 1) / width, (max(ys) - min(ys) + 1) / height),
        "area": len(touched) / (width * height),
        "clipped": sum(max(pixel) == 255 for pixel in pixels) / len(pixels),
        "black": all(max(pixel) == 0 for pixel in pixels),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folders", type=pathlib.Path, nargs="+")
    parser.add_argument("-o", "--sheet", type=pathlib.Path)
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--columns", type=int, default=8)
    parser.add_argument("--skip", nargs="*", default=["Negative"], help="parts of paths that are left out")
    args = parser.parse_args()
    files = sorted(path for folder in args.folders for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
    files = [path for path in files if not any(part in str(path) for part in args.skip)]
    found, other, tiles = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        shown, covered = pathlib.Path(folder, "shown.png"), pathlib.Path(folder, "covered.png")
        for path in files:
            base = [str(args.program), "render", str(path), "--size", args.size, "--progress", "none"]
            run = subprocess.run(base + ["-v", "-o", str(shown)], capture_output=True, text=True, errors="replace")
            if run.returncode != 0:
                other.append((path, f"exit code {run.returncode}"))
                continue
            subprocess.run(base + ["--spp", "4", "--background", "transparent", "--ground", "none", "-q", "-o", str(covered)], check=True)
            picture = read_png(shown)
            numbers = measure(picture, read_png(covered))
            if numbers is None:
                other.append((path, "shows nothing"))
                continue
            framed, studio = "the whole scene is shown" in run.stderr, "the default studio lights it" in run.stderr
            tiles.append(picture)
            found.append((path, numbers, framed, studio))
            line = " ".join(f"{key} {value:.3f}" if isinstance(value, float) else f"{key} {value}" for key, value in numbers.items())
            print(f"{len(tiles):3} {path.name}: {line}{'' if framed else ' (own camera)'}{'' if studio else ' (own lights)'}", flush=True)
    for path, why in other:
        print(f"    {path.name}: {why}")
    apart = [n["apart"] >= APART for _, n, _, studio in found if studio and n["apart"] is not None]
    framed = [SHARE[0] <= n["area"] <= SHARE[1] or n["side"] >= SIDE for _, n, framed, _ in found if framed]
    print(f"{len(found)} pictures, {len(other)} models without one")
    print(f"object and surroundings at least {APART:.0f} codes apart: {sum(apart)} of {len(apart)} in the studio")
    print(f"silhouette {SHARE[0]:.0%} to {SHARE[1]:.0%} of the area or {SIDE:.0%} of the tighter side: {sum(framed)} of {len(framed)} framed ones")
    print(f"at least {CLIPPED:.0%} clipped: {sum(n['clipped'] >= CLIPPED for _, n, _, _ in found)}; black: {sum(n['black'] for _, n, _, _ in found)}")
    if args.sheet and tiles:
        width, height = tiles[0][:2]
        rows = []
        for first in range(0, len(tiles), args.columns):
            line = tiles[first : first + args.columns]
            for y in range(height):
                row = b"".join(bytes(tile[3][y]) for tile in line)
                rows.append(row + bytes(3 * width * args.columns - len(row)))
        write_png(args.sheet, width * args.columns, rows)


if __name__ == "__main__":
    main()

"""Packs the extension for Blender: python3 addons/blender/pack.py OUT.zip. Install it by *Install from Disk*."""

import pathlib
import sys
import zipfile

HERE = pathlib.Path(__file__).resolve().parent


def pack(out):
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as file:
        for path in sorted((HERE / "raywright").iterdir()):
            if path.suffix in (".py", ".toml"):
                file.write(path, path.name)
        for licence in ("LICENSE-MIT", "LICENSE-APACHE"):
            file.write(HERE.parents[1] / licence, licence)
    return out


if __name__ == "__main__":
    print(pack(sys.argv[1]))

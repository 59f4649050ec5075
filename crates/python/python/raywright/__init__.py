"""Pictures of models and scenes, with how far each is from the true one, and rays for arrays. No GPU, no display.

>>> import raywright as rw
>>> scene = rw.load("preset:cornell")
>>> picture = scene.render(size=(64, 64), spp=16, denoise=True)
>>> picture.rgb.shape, picture.rgb.dtype
((64, 64, 3), dtype('float32'))
>>> picture.error.low < picture.error.value < picture.error.high
True

Keywords are the flags of the program with underscores for hyphens, and mean what they mean there: `max_error=.05` is `--max-error 0.05`.
Lengths are metres and times seconds where a file does not say otherwise; radiance is linear, in Rec. 709 primaries. The interpreter goes
on while the work is done, and Ctrl-C ends it.
"""

import json as _json
import struct as _struct

import numpy as _np

from ._errors import Error, FileError, InputError, LimitError, UsageError
from ._raywright import Bvh, ErrorEstimate, Picture, Scene, __version__, compare
from ._raywright import load_bytes as _load_bytes
from ._raywright import load_path as _load_path
from ._viewer import Viewer, show

__all__ = [
    "Bvh",
    "Error",
    "ErrorEstimate",
    "FileError",
    "InputError",
    "LimitError",
    "Picture",
    "Scene",
    "UsageError",
    "Viewer",
    "__version__",
    "compare",
    "load",
    "show",
]


def load(source, faces=None, *, format=None, **flags):
    """Reads a scene or model, checks it and completes its lights.

    source: a path, or "preset:NAME"; the content of a file as bytes; a file object that is open for bytes; or anything with
    `export(file_type="glb")`, such as a mesh or scene of trimesh. With `faces`, an array of three indices a triangle, source is an array of
    vertices, three coordinates each, and the mesh is flat and grey. format: "glb", "gltf", "obj", "stl", "ply", "toml" or "json", where the
    content does not tell. flags: of the program, about the scene: `up="z"`, `variant="red"`, `animation="Walk"`, `env="sky.exr"`.

    Content without a path has no folder, so that files which it names can't be read.
    """
    if faces is not None:
        return _load_bytes("mesh.glb", _mesh_glb(source, faces), **flags)
    export = getattr(source, "export", None)
    if callable(export):
        source, format = export(file_type="glb"), "glb"
    name = getattr(source, "name", None)
    if hasattr(source, "read"):
        source = source.read()
        if isinstance(source, str):
            source = source.encode()
    if isinstance(source, (bytes, bytearray, memoryview)):
        name = name if isinstance(name, str) else "bytes"
        return _load_bytes(f"{name}.{format}" if format else name, bytes(source), **flags)
    if format is not None:
        with open(source, "rb") as file:
            return load(file, format=format, **flags)
    return _load_path(source, **flags)


def _mesh_glb(vertices, faces):
    """A GLB file of a mesh."""
    points, triangles = _np.asarray(vertices, "<f4"), _np.asarray(faces)
    if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
        raise UsageError(f"vertices have three coordinates each and faces three indices each, not shapes {points.shape} and {triangles.shape}")
    if not len(points) or not len(triangles) or triangles.min() < 0 or triangles.max() >= len(points):
        raise InputError(f"the indices of faces are from 0 to {len(points) - 1}, and at least one face is needed")
    body, indices = points.tobytes(), triangles.astype("<u4").tobytes()
    views = [{"buffer": 0, "byteLength": len(body)}, {"buffer": 0, "byteOffset": len(body), "byteLength": len(indices)}]
    corners = {"componentType": 5126, "type": "VEC3", "count": len(points), "min": points.min(0).tolist(), "max": points.max(0).tolist()}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.6, 0.6, 1], "metallicFactor": 0}}],
        "buffers": [{"byteLength": len(body) + len(indices)}],
        "bufferViews": views,
        "accessors": [{"bufferView": 0, **corners}, {"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": triangles.size}],
    }
    text = _json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body += indices
    head = _struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + len(body), len(text), b"JSON")
    return head + text + _struct.pack("<I4s", len(body), b"BIN\0") + body

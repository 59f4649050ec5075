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

from ._errors import Error, FileError, InputError, LimitError, UsageError
from ._raywright import Bvh, ErrorEstimate, Picture, Scene, __version__, compare
from ._raywright import load_bytes as _load_bytes
from ._raywright import load_path as _load_path

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
    "__version__",
    "compare",
    "load",
]


def load(source, *, format=None, **flags):
    """Reads a scene or model, checks it and completes its lights.

    source: a path, or "preset:NAME"; the content of a file as bytes; a file object that is open for bytes; or anything with
    `export(file_type="glb")`, such as a mesh or scene of trimesh. format: "glb", "gltf", "obj", "stl", "ply", "toml" or "json", where the
    content does not tell. flags: of the program, about the scene: `up="z"`, `variant="red"`, `animation="Walk"`, `env="sky.exr"`.

    Content without a path has no folder, so that files which it names can't be read.
    """
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

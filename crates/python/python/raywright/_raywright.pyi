import os
from typing import Any, Callable, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

__version__: str

_Path = Union[str, "os.PathLike[str]"]
_Triple = Union[str, Sequence[float]]

class ErrorEstimate:
    value: float
    low: float
    high: float
    rmse: Tuple[float, float, float]
    doubt: Optional[str]
    converged: Optional[bool]

class Picture:
    rgb: npt.NDArray[np.float32]
    sampled: npt.NDArray[np.float32]
    alpha: Optional[npt.NDArray[np.float32]]
    layers: Mapping[str, npt.NDArray[np.float32]]
    error: Optional[ErrorEstimate]
    size: Tuple[int, int]
    samples: str
    notes: Sequence[str]
    command: str
    hash: str
    def png(self) -> bytes: ...
    def save(self, path: _Path) -> None: ...
    def _repr_png_(self) -> bytes: ...

class Scene:
    warnings: Sequence[str]
    def render(
        self,
        *,
        size: Optional[Sequence[int]] = None,
        view: Union[str, Sequence[float], None] = None,
        camera: Union[str, int, None] = None,
        at: Optional[float] = None,
        eye: Optional[_Triple] = None,
        target: Optional[_Triple] = None,
        fov: Optional[float] = None,
        zoom: Optional[float] = None,
        crop: Optional[Sequence[int]] = None,
        background: Optional[_Triple] = None,
        max_error: Optional[float] = None,
        spp: Optional[int] = None,
        budget: Union[str, float, None] = None,
        denoise: bool = False,
        quick: bool = False,
        integrator: Optional[str] = None,
        max_depth: Optional[int] = None,
        seed: Optional[int] = None,
        precision: Optional[str] = None,
        exposure: Union[float, str, None] = None,
        tonemap: Optional[str] = None,
        layers: Union[str, Sequence[str], None] = ("depth",),
        threads: Optional[int] = None,
        progress: Union[Callable[[float], Any], bool, None] = None,
        **flags: Any,
    ) -> Picture: ...
    def explain(self, **flags: Any) -> dict[str, Any]: ...
    def accuracy(self, *, budget: Union[str, float] = 60, **flags: Any) -> dict[str, Any]: ...

class Bvh:
    def __init__(
        self, vertices: npt.ArrayLike, triangles: npt.ArrayLike, *, precision: str = "robust", threads: Optional[int] = None
    ) -> None: ...
    def closest(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        *,
        tmin: float = 0.0,
        tmax: float = ...,
        threads: Optional[int] = None,
    ) -> Tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], npt.NDArray[np.float64]]: ...
    def all_hits(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        *,
        tmin: float = 0.0,
        tmax: float = ...,
        threads: Optional[int] = None,
    ) -> Tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.int64], npt.NDArray[np.float64]]: ...
    def occluded(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        *,
        tmin: float = 0.0,
        tmax: float = ...,
        threads: Optional[int] = None,
    ) -> npt.NDArray[np.bool_]: ...

def compare(picture: Union[Picture, _Path], reference: Union[Picture, _Path], **flags: Any) -> dict[str, Any]: ...
def load_path(path: _Path, **flags: Any) -> Scene: ...
def load_bytes(name: str, bytes: bytes, **flags: Any) -> Scene: ...
def main(words: Sequence[str]) -> int: ...

import os
from typing import Any, Iterable, Iterator, Literal, Mapping, Optional, Sequence, Union, overload

import numpy
from numpy.typing import ArrayLike, DTypeLike, NDArray

__version__: str

_Path = Union[str, os.PathLike[str]]
_Image = Union[_Path, ArrayLike]
_Light = Union[_Path, ArrayLike]
_Lamp = Union[str, Sequence[Union[float, str]]]
_Object = Union[_Image, tuple[_Image, Optional[_Image]]]
_Floats = NDArray[numpy.float32]
_Gate = Literal["auto", "on", "off"]
_Transfer = Literal["srgb", "gamma22", "linear"]
_Balance = Literal["adapted", "light", "auto"]

class RelitWarning(UserWarning): ...

class Decomposition:
    normals: _Floats
    albedo: _Floats
    shading: _Floats
    highlight: _Floats
    confidence: _Floats
    mask: NDArray[numpy.bool_]
    light: NDArray[numpy.float64]
    specular: Optional[tuple[float, float]]
    saturated_fraction: float
    residual: float

def decompose(
    image: _Image,
    mask: Optional[_Image] = None,
    *,
    box: Optional[Sequence[int]] = None,
    transfer: Optional[_Transfer] = None,
    highlights: _Gate = "auto",
    mirror: bool = True,
) -> Decomposition: ...
@overload
def decompose_many(
    photographs: Iterable[_Object],
    *,
    threads: Optional[int] = None,
    return_exceptions: Literal[False] = False,
    **options: Any,
) -> Iterator[Decomposition]: ...
@overload
def decompose_many(
    photographs: Iterable[_Object],
    *,
    threads: Optional[int] = None,
    return_exceptions: bool,
    **options: Any,
) -> Iterator[Union[Decomposition, BaseException]]: ...
def relight(
    image: _Image,
    mask: Optional[_Image] = None,
    *,
    light: Optional[_Light] = None,
    lamp: Optional[_Lamp] = None,
    ambient: float = 0.15,
    light_angle: Union[float, Sequence[float], NDArray[Any]] = 0.0,
    background: Optional[Literal["photo", "light", "grey", "black", "white"]] = None,
    fov: float = 60.0,
    white_balance: _Balance = "adapted",
    exposure: float = 0.0,
    size: Optional[int] = None,
    box: Optional[Sequence[int]] = None,
    transfer: Optional[_Transfer] = None,
    highlights: _Gate = "auto",
) -> _Floats: ...
def insert(
    objects: Iterable[_Object],
    into: _Image,
    at: Optional[ArrayLike] = None,
    height: Optional[ArrayLike] = None,
    *,
    rotation: Optional[ArrayLike] = None,
    tint: Optional[ArrayLike] = None,
    gloss: Optional[ArrayLike] = None,
    shadow: Optional[ArrayLike] = None,
    brightness: Optional[ArrayLike] = None,
    light: Optional[_Light] = None,
    lamp: Optional[_Lamp] = None,
    ambient: float = 0.15,
    light_angle: float = 0.0,
    size: Sequence[int] = (1280, 960),
    fov: float = 60.0,
    down: float = 10.0,
    tilt: Optional[float] = None,
    match: bool = True,
    white_balance: _Balance = "adapted",
    exposure: float = 0.0,
    transfer: Optional[_Transfer] = None,
    highlights: _Gate = "auto",
) -> _Floats: ...
def mask(
    image: _Image,
    box: Optional[Sequence[int]] = None,
    *,
    seeds: Optional[_Image] = None,
    keep_all: bool = False,
) -> NDArray[numpy.bool_]: ...
def read_image(path: _Path, *, transfer: Optional[_Transfer] = None) -> _Floats: ...
def to_srgb(image: ArrayLike, dtype: DTypeLike = ...) -> NDArray[Any]: ...

class Turn:
    name: str
    normals: _Floats
    albedo: _Floats
    shading: _Floats
    confidence: _Floats
    expected_error: _Floats
    mask: NDArray[numpy.bool_]
    light: NDArray[numpy.float64]
    expected_error_deg: float
    specular: Optional[tuple[_Floats, _Floats]]

def solve_turn(
    shard: _Path,
    *,
    rotation: Optional[Literal["counter-clockwise", "clockwise"]] = None,
    elevation: Optional[float] = None,
    light: Optional[_Light] = None,
    material: Literal["diffuse", "metal"] = "diffuse",
) -> Turn: ...
def render(
    normals: ArrayLike,
    albedo: ArrayLike,
    light: _Light,
    *,
    specular: Optional[tuple[ArrayLike, ArrayLike]] = None,
    light_angle: Union[float, Sequence[float], NDArray[Any]] = 0.0,
    exposure: Union[Literal["auto"], float] = "auto",
    order: int = 48,
    diffuse_form: Literal["irradiance", "released"] = "irradiance",
    specular_form: Literal["lobe", "power"] = "lobe",
) -> _Floats: ...

class Cursor:
    epoch: int
    sample: int
    def __init__(self, epoch: int = 0, sample: int = 0) -> None: ...
    def state_dict(self) -> dict[str, int]: ...
    @classmethod
    def of(cls, state: Union[Cursor, Mapping[str, int]]) -> Cursor: ...

class Batch:
    images: _Floats
    masks: _Floats
    keys: list[str]
    records: list[Optional[dict[str, Any]]]
    damaged: list[str]
    cursor: Cursor
    def __len__(self) -> int: ...
    def torch(self) -> tuple[Any, Any]: ...

class Batches(Iterator[Batch]):
    cursor: Cursor
    def __iter__(self) -> Batches: ...
    def __next__(self) -> Batch: ...
    def state_dict(self) -> dict[str, int]: ...

class Dataset:
    turns: dict[str, int]
    def __init__(self, path: _Path, linear: bool = False) -> None: ...
    def __len__(self) -> int: ...
    def batches(
        self,
        batch: int = 12,
        *,
        draw: Literal["neighbours", "mixed"] = "neighbours",
        seed: Optional[int] = None,
        rank: int = 0,
        world_size: int = 1,
        cursor: Optional[Union[Cursor, Mapping[str, int]]] = None,
        epochs: Optional[int] = 1,
        threads: int = 1,
    ) -> Batches: ...
    def __iter__(self) -> Iterator[tuple[_Floats, _Floats, Optional[dict[str, Any]]]]: ...

def open(path: _Path, *, linear: bool = False) -> Dataset: ...

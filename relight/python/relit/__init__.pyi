import os
from typing import Any, Iterator, Literal, Mapping, Optional, Union

import numpy
from numpy.typing import NDArray

__version__: str

class Cursor:
    epoch: int
    sample: int
    def __init__(self, epoch: int = 0, sample: int = 0) -> None: ...
    def state_dict(self) -> dict[str, int]: ...
    @classmethod
    def of(cls, state: Union[Cursor, Mapping[str, int]]) -> Cursor: ...

class Batch:
    images: NDArray[numpy.float32]
    masks: NDArray[numpy.float32]
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
    def __init__(self, path: Union[str, os.PathLike[str]], linear: bool = False) -> None: ...
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
    def __iter__(
        self,
    ) -> Iterator[tuple[NDArray[numpy.float32], NDArray[numpy.float32], Optional[dict[str, Any]]]]: ...

def open(path: Union[str, os.PathLike[str]], *, linear: bool = False) -> Dataset: ...

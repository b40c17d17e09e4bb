"""Read relit's data sets: in order, shuffled, and from any position."""

from __future__ import annotations

import dataclasses
import json
import os

import numpy

from ._relit import Data as _Data

#: An epoch that is never reached.
_NEVER = 2**64 - 1


@dataclasses.dataclass(frozen=True)
class Cursor:
    """A position between two batches, the same for all ranks."""

    epoch: int = 0
    sample: int = 0

    def state_dict(self):
        return dataclasses.asdict(self)

    @classmethod
    def of(cls, state):
        """A cursor from a cursor or from the result of `state_dict`."""
        return state if isinstance(state, cls) else cls(**state)


@dataclasses.dataclass(frozen=True)
class Batch:
    """Frames as arrays, with their records."""

    images: numpy.ndarray
    masks: numpy.ndarray
    keys: list
    records: list
    damaged: list
    cursor: Cursor

    def __len__(self):
        return len(self.keys)

    def torch(self):
        """Images and masks as torch tensors that share memory with the arrays."""
        import torch

        return torch.from_numpy(self.images), torch.from_numpy(self.masks)


class Batches:
    """An iterator over batches. `cursor` is the position after the last batch."""

    def __init__(self, stream, cursor):
        self._stream = stream
        self.cursor = cursor

    def __iter__(self):
        return self

    def __next__(self):
        found = self._stream.next()
        if found is None:
            raise StopIteration
        images, masks, keys, records, damaged, (epoch, sample) = found
        self.cursor = Cursor(epoch, sample)
        records = [record and json.loads(record) for record in records]
        return Batch(images, masks, keys, records, damaged, self.cursor)

    def state_dict(self):
        return self.cursor.state_dict()


class Dataset:
    """An open data set: a shard, a folder of shards, or what relit-extract has written."""

    def __init__(self, path, linear=False):
        self._data = _Data(os.fspath(path), linear)
        self.turns = dict(zip(self._data.names(), self._data.samples()))

    def __len__(self):
        """The number of samples, with damaged ones."""
        return sum(self._data.samples())

    def batches(self, batch=12, *, draw="neighbours", seed=None, rank=0, world_size=1, cursor=None, epochs=1, threads=1):
        """Batches from `cursor` on, up to `epochs` epochs in total; None never ends.

        `draw`: "neighbours" (frames that follow each other in a shard: any 12 cover the whole turn) or "mixed". Without
        a seed they come in stored order. The same arguments always give the same batches.
        """
        if draw not in ("neighbours", "mixed"):
            raise ValueError(f"draw is {draw!r}: give 'neighbours' or 'mixed'")
        cursor = Cursor.of(cursor or Cursor())
        end = _NEVER if epochs is None else epochs
        stream = self._data.stream(
            batch, draw == "mixed", seed, (rank, world_size), (cursor.epoch, cursor.sample), end, threads
        )
        return Batches(stream, cursor)

    def __iter__(self):
        """The frames in stored order: image, mask, record."""
        for batch in self.batches():
            yield from zip(batch.images, batch.masks, batch.records)


def open(path, *, linear=False):
    """Open the data set at `path`: a shard, a folder of shards, or a folder that relit-extract has written. `linear` gives
    linear values in place of sRGB."""
    return Dataset(path, linear)

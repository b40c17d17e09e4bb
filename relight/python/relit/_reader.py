"""Data sets of relit, in order, shuffled, and from any place on."""

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
    """A place between two batches. It is the same for all ranks."""

    epoch: int = 0
    sample: int = 0

    def state_dict(self):
        return dataclasses.asdict(self)

    @classmethod
    def of(cls, state):
        """A cursor out of a cursor or of what `state_dict` gave."""
        return state if isinstance(state, cls) else cls(**state)


@dataclasses.dataclass(frozen=True)
class Batch:
    """Frames as arrays, and what is known of them."""

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
    """An iterator over batches. `cursor` is the place behind the last one that it gave."""

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
    """A data set that is opened: a shard, a folder of shards, or what relit-extract has written."""

    def __init__(self, path, linear=False):
        self._data = _Data(os.fspath(path), linear)
        self.turns = dict(zip(self._data.names(), self._data.samples()))

    def __len__(self):
        """How many samples there are, damaged ones included."""
        return sum(self._data.samples())

    def batches(self, batch=12, *, draw="neighbours", seed=None, rank=0, world_size=1, cursor=None, epochs=1, threads=1):
        """Batches from `cursor` on, up to the end of `epochs` epochs in all; None goes on for ever.

        `draw`: "neighbours" (frames that follow each other in a shard: any 12 cover the whole turn) or "mixed". Without
        a seed they come as they stand. The same arguments always give the same batches.
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
        """One frame after the other, as they stand: image, mask, record."""
        for batch in self.batches():
            yield from zip(batch.images, batch.masks, batch.records)


def open(path, *, linear=False):
    """Opens a data set: the `path` of a shard, of a folder of shards, or of what relit-extract has written. `linear` gives values
    in proportion to light in place of sRGB."""
    return Dataset(path, linear)

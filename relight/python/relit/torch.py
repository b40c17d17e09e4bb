"""For torch.utils.data: batches of a data set as an iterable data set that goes on where it stopped.

    data = relit.torch.TurnBatches("dataset", seed=1)
    loader = torch.utils.data.DataLoader(data, batch_size=None, num_workers=2)
    for images, masks, state in loader:
        ...
        data.load_state_dict(state)        # in a new process, before the loader is made
"""

from __future__ import annotations

import torch.utils.data

from . import Cursor
from . import open as _open


class TurnBatches(torch.utils.data.IterableDataset):
    """Images, masks and the state behind them, batch by batch. Each worker of a loader draws its own batches, as if it
    were a rank of its own. With `n` workers the state moves on behind every `n`-th batch: who goes on from it may read
    up to `n - 1` batches again, and misses none."""

    def __init__(self, path, batch=12, *, linear=False, rank=0, world_size=1, epochs=1, **options):
        self._path, self._linear = path, linear
        self._batch, self._epochs, self._options = batch, epochs, options
        self._rank, self._world_size = rank, world_size
        self._cursor = Cursor()

    def load_state_dict(self, state):
        self._cursor = Cursor.of(state)

    def __iter__(self):
        worker = torch.utils.data.get_worker_info()
        count, number = (worker.num_workers, worker.id) if worker else (1, 0)
        # Opened here, so that each worker has files of its own.
        batches = _open(self._path, linear=self._linear).batches(
            self._batch,
            rank=self._rank * count + number,
            world_size=self._world_size * count,
            cursor=self._cursor,
            epochs=self._epochs,
            **self._options,
        )
        state = self._cursor.state_dict()
        for batch in batches:
            # The cursor is behind the batches of all workers: only the last one's is behind what a loop has had.
            if number == count - 1:
                state = batch.cursor.state_dict()
            if batch.damaged:
                raise ValueError("; ".join(batch.damaged))
            yield (*batch.torch(), state)
            state = batch.cursor.state_dict()

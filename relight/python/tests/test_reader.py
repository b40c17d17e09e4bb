"""The package as it is installed, on a data set that the test is given: RELIT_DATA."""

import os

import numpy
import pytest

relit = pytest.importorskip("relit", reason="the package relit is not installed")
DATA = os.environ.get("RELIT_DATA")
pytestmark = pytest.mark.skipif(not DATA, reason="RELIT_DATA names no data set")


def keys(stream):
    return [key for batch in stream for key in batch.keys]


def test_a_batch_has_images_masks_and_records():
    batch = next(relit.open(DATA).batches())
    assert batch.images.dtype == numpy.float32 and batch.images.shape[:2] == (12, 3)
    assert batch.masks.shape == (12, 1, *batch.images.shape[2:])
    assert (batch.images * (1 - batch.masks) == 0).all() and batch.images.max() <= 1
    assert batch.damaged == [] and batch.records[0]["index"] >= 0


def test_every_sample_comes_once_an_epoch_with_any_number_of_threads():
    data = relit.open(DATA)
    one = keys(data.batches(seed=3))
    assert len(set(one)) == len(one) == len(data)
    assert keys(data.batches(seed=3, threads=3)) == one
    assert keys(data.batches(seed=4)) != one


def test_reading_goes_on_in_the_middle_of_an_epoch():
    data = relit.open(DATA)
    whole = keys(data.batches(seed=5, epochs=2))
    stream = data.batches(seed=5, epochs=2)
    first = [key for _ in range(3) for key in next(stream).keys]
    rest = keys(relit.open(DATA).batches(seed=5, epochs=2, cursor=stream.state_dict()))
    assert first + rest == whole


def test_two_ranks_read_different_samples():
    data = relit.open(DATA)
    parts = [set(keys(data.batches(seed=6, rank=rank, world_size=2))) for rank in (0, 1)]
    assert not parts[0] & parts[1]


def test_what_cannot_be_opened_is_named(tmp_path):
    with pytest.raises(OSError, match=str(tmp_path)):
        relit.open(tmp_path)
    with pytest.raises(ValueError, match="draw"):
        relit.open(DATA).batches(draw="sideways")
    with pytest.raises(ValueError, match="batch"):
        relit.open(DATA).batches(0)


def test_a_loader_of_torch_goes_on_where_it_stopped():
    torch = pytest.importorskip("torch", reason="torch is not installed")
    from relit.torch import TurnBatches

    loader = torch.utils.data.DataLoader(TurnBatches(DATA, seed=7), batch_size=None)
    seen = list(loader)
    again = TurnBatches(DATA, seed=7)
    again.load_state_dict(seen[1][2])
    rest = list(torch.utils.data.DataLoader(again, batch_size=None))
    assert len(rest) == len(seen) - 2
    assert torch.equal(rest[0][0], seen[2][0])


def test_each_epoch_of_a_loop_has_an_order_of_its_own():
    pytest.importorskip("torch", reason="torch is not installed")
    from relit.torch import TurnBatches

    batches = TurnBatches(DATA, seed=7)
    epochs = []
    for epoch in range(2):
        batches.set_epoch(epoch)
        epochs.append([images.double().sum().item() for images, _, _ in batches])
    assert len(epochs[0]) == len(epochs[1])
    assert epochs[0] != epochs[1]
    state = [state for _, _, state in batches][0]
    batches.load_state_dict(state)
    batches.set_epoch(1)
    assert [images.double().sum().item() for images, _, _ in batches] == epochs[1][1:]


@pytest.mark.parametrize("workers", [2, 3])
def test_no_batch_is_missed_from_the_state_of_any_worker(workers):
    torch = pytest.importorskip("torch", reason="torch is not installed")
    from relit.torch import TurnBatches

    def seen(data):
        loader = torch.utils.data.DataLoader(data, batch_size=None, num_workers=workers)
        return [(images.double().sum().item(), state) for images, _, state in loader]

    whole = seen(TurnBatches(DATA, seed=7))
    for stop in range(workers + 1):
        again = TurnBatches(DATA, seed=7)
        again.load_state_dict(whole[stop][1])
        rest = [value for value, _ in seen(again)]
        assert {value for value, _ in whole[stop + 1 :]} <= set(rest)
        assert len(rest) < len(whole) - stop - 1 + workers

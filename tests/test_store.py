"""Stores hold what was saved, whole or not at all."""

import numpy as np
import pytest
import xarray as xr

from rippletwin import store


def dataset(value):
    return xr.Dataset(
        {
            "values": (("sensor", "frequency"), np.full((2, 5), value), {"units": "Pa"}),
            "label": (("sensor",), np.array(["p1", "p2"])),
        },
        coords={"frequency": ("frequency", np.arange(5.0), {"units": "Hz"})},
        attrs={"source": "test"},
    )


@pytest.mark.parametrize("compressed", [True, False])
def test_round_trip(tmp_path, compressed):
    """Complex values, text, units and attributes come back identical."""
    saved = dataset(1 + 2j)
    store.save(saved, tmp_path / "deep" / "a.zarr", compressed=compressed)
    with store.load(tmp_path / "deep" / "a.zarr") as loaded:
        xr.testing.assert_identical(loaded.load(), saved)
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["a.zarr"]


def test_saving_replaces_the_whole_store(tmp_path):
    """Variables of an earlier save are gone; a store read from disk can be saved elsewhere."""
    path = tmp_path / "a.zarr"
    store.save(dataset(1.0).assign(extra=3), path)
    store.save(dataset(2.0), path)
    assert "extra" not in store.load(path)
    store.save(store.load(path), tmp_path / "b.zarr", compressed=False)
    xr.testing.assert_identical(store.load(tmp_path / "b.zarr").load(), dataset(2.0))


def test_a_failed_save_leaves_the_old_store_and_nothing_else(tmp_path):
    """A value that cannot be written stops the save; what was there is still whole."""
    path = tmp_path / "a.zarr"
    store.save(dataset(1.0), path)
    with pytest.raises(Exception, match=r".+"):
        store.save(dataset(2.0).assign(bad=((), object())), path)
    xr.testing.assert_identical(store.load(path).load(), dataset(1.0))
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.zarr"]


def test_a_store_that_is_not_there(tmp_path):
    with pytest.raises(FileNotFoundError):
        store.load(tmp_path / "nowhere.zarr")

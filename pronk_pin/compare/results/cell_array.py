"""The strides of all cells of an experiment as one dataset, read when they are asked for."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import xarray as xr
from xarray.core import indexing

from ..._typing import IntArray
from ..experiment import Cell, Experiment

CELLS = ("controller", "scenario", "seed", "speed")
"""Dimensions along which the cells lie; those of a quantity itself follow. The last is "command"
where speeds are commanded."""

_CURVES = {"phase", "tick"}
"""What has none of these dimensions takes little memory, and is read at once."""

_COMMON = ("robot", "base", "mjcf", "mjcf_sha256", "timestep", "switch")
"""Attributes of the cells that the whole has, too, where all cells agree."""

_LOCK = threading.Lock()
"""NetCDF's library answers one at a time."""

Opener: TypeAlias = Callable[[Cell], xr.Dataset]
"""What opens the strides of a cell."""

Place: TypeAlias = tuple[int, int, int, IntArray]
"""Where a cell is: its indices along controller, scenario and seed, and those of its speeds."""


class CellArray(xr.backends.BackendArray):
    """A quantity of all cells as one array, NaN where there is nothing.

    Of what is asked for, those cells are read that have a share in it, one after the other.

    Attributes:
        name: Name of the quantity.
        places: The cells that are there.
        open: Opens the strides of a cell.
        kept: Its values in the cells, where they were read already; None where they are not.
        shape: Its shape, the four dimensions of `CELLS` first.
        dtype: Its type, a floating one.
    """

    def __init__(
        self,
        name: str,
        places: Mapping[Cell, Place],
        open: Opener,
        kept: Mapping[Cell, npt.NDArray[Any]] | None,
        shape: tuple[int, ...],
        dtype: np.dtype[Any],
    ) -> None:
        self.name = name
        self.places = places
        self.open = open
        self.kept = kept
        self.shape = shape
        self.dtype = dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        outer = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, outer, self._read)

    def _read(self, key: tuple[Any, ...]) -> npt.NDArray[Any]:
        """What is at an integer, a slice or an array of indices along each dimension."""
        wanted = [
            np.atleast_1d(np.arange(size)[of]) for of, size in zip(key, self.shape, strict=True)
        ]
        found = np.full([len(indices) for indices in wanted], np.nan, self.dtype)
        whole = np.full(self.shape[len(CELLS) :], np.nan, self.dtype)
        for cell, (*where, speeds) in self.places.items():
            rows = [np.flatnonzero(of == at) for of, at in zip(wanted, where, strict=False)]
            columns = np.flatnonzero(np.isin(wanted[3], speeds))
            if not columns.size or not all(of.size for of in rows):
                continue
            values = self._of(cell)
            if values is None:
                continue
            for column in columns:
                row = values[int(np.flatnonzero(speeds == wanted[3][column])[0])]
                whole[...] = np.nan
                whole[tuple(map(slice, row.shape))] = row
                part = whole[np.ix_(*wanted[len(CELLS) :])]
                for place in itertools.product(*rows):
                    found[(*place, column)] = part
        return found[tuple(0 if isinstance(of, int | np.integer) else slice(None) for of in key)]

    def _of(self, cell: Cell) -> npt.NDArray[Any] | None:
        """The quantity in a cell, speeds first; None if it has no such."""
        if self.kept is not None:
            return self.kept.get(cell)
        with _LOCK, self.open(cell) as file:
            return _values(file[self.name]) if self.name in file else None


def _values(quantity: xr.DataArray) -> npt.NDArray[Any]:
    return np.asarray(quantity.transpose(*{"speed", "command"}.intersection(quantity.dims), ...))


def join_cells(experiment: Experiment, cells: Sequence[Cell], open: Opener) -> xr.Dataset:
    """The strides of several cells of an experiment as one dataset; see `Results.dataset`.

    Args:
        experiment: The experiment.
        cells: Those of its cells that are there, one or more.
        open: Opens the strides of one of them.
    """
    labels: dict[str, list[Any]] = {
        "controller": list(dict.fromkeys(cell.controller for cell in experiment.compared)),
        "scenario": list(experiment.scenario_names),
        "seed": list(experiment.seeds),
    }
    robots = "command" if experiment.commands else "speed"
    labels[robots] = list(experiment.commands or experiment.speeds)
    places: dict[Cell, Place] = {}
    sizes: dict[Hashable, int] = {}
    quantities: dict[Hashable, xr.Variable] = {}
    kept: dict[Hashable, dict[Cell, npt.NDArray[Any]]] = {}
    coordinates: dict[Hashable, xr.Variable] = {}
    attributes: list[Mapping[Any, Any]] = []
    for cell in cells:
        places[cell] = (
            labels["controller"].index(cell.controller),
            labels["scenario"].index(cell.scenario),
            labels["seed"].index(cell.seed),
            np.array([labels[robots].index(own) for own in cell.commands or cell.speeds]),
        )
        with open(cell) as file:
            for dim, size in file.sizes.items():
                sizes[dim] = max(size, sizes.get(dim, 0))
            for name, values in file.data_vars.items():
                quantities.setdefault(name, values.variable)
                if not _CURVES.intersection(map(str, values.dims)):
                    kept.setdefault(name, {})[cell] = _values(values)
            for name, values in file.coords.items():
                if name != robots and values.size == sizes[values.dims[0]]:
                    coordinates[name] = values.load().variable
            attributes.append(file.attrs)
    sizes |= {name: len(of) for name, of in labels.items()}
    variables = {}
    for name, quantity in quantities.items():
        dims = (*CELLS[:-1], robots, *(dim for dim in quantity.dims if dim != robots))
        shape = tuple(sizes[dim] for dim in dims)
        dtype = np.result_type(quantity.dtype, np.float32)  # NaN for counts, too
        array = CellArray(str(name), places, open, kept.get(name), shape, dtype)
        lazy: Any = indexing.LazilyIndexedArray(array)
        cached = indexing.MemoryCachedArray(lazy)  # type: ignore[no-untyped-call]
        variables[name] = xr.Variable(dims, cached, quantity.attrs)
    joined = xr.Dataset(variables, {**coordinates, **labels})
    if not experiment.commands:
        joined["speed"].attrs["units"] = "m/s"
    found = {name: {each[name] for each in attributes if name in each} for name in _COMMON}
    return joined.assign_attrs({name: of.pop() for name, of in found.items() if len(of) == 1})

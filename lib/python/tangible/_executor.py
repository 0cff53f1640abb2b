"""Work on other processes or machines, by an executor of `concurrent.futures`."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
T = TypeVar("T")

# Parts for each worker, so that none waits long for one that has slow rows.
_PARTS = 4
# Workers of an executor that does not say how many it has.
_WORKERS = 16


def check(executor: object) -> None:
    """Refuses what is no executor: with a method submit, as those of concurrent.futures, of mpi4py
    and of dask have it."""
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise TypeError(
            "executor: expected one of concurrent.futures, with a method submit, got "
            f"{type(executor).__name__}"
        )


def in_order(executor: Executor, function: Callable[..., T], calls: Sequence[tuple[Any, ...]]) -> list[T]:
    """The results of all calls in their order, whichever ends first. After an error what has not
    begun is not begun."""
    futures: list[Future[T]] = []
    try:
        futures.extend(executor.submit(function, *arguments) for arguments in calls)
        return [future.result() for future in futures]
    except BaseException:
        for future in futures:
            future.cancel()
        raise


def parts_of(executor: Executor, rows: int) -> list[slice]:
    """Rows as parts of about one size, some for each worker."""
    said = getattr(executor, "_max_workers", None)
    workers = said if isinstance(said, int) and said > 0 else max(_WORKERS, os.cpu_count() or 1)
    count = max(1, min(rows, _PARTS * workers))
    ends = [rows * part // count for part in range(count + 1)]
    return [slice(begin, end) for begin, end in zip(ends, ends[1:])]


def call(name: str, core: Any, arrays: Sequence[Floats | None], threads: int) -> Any:
    """A method of the core, in the worker's process."""
    return getattr(core, name)(*arrays, threads)


def of_rows(
    executor: Executor | None, name: str, core: Any, arrays: Sequence[Floats | None], threads: int
) -> Any:
    """The method of the core for all rows of the arrays: a list of one item a row, or a tuple of
    such lists and of arrays. With an executor its workers do the rows, a thread each unless
    `threads` says how many."""
    if executor is None:
        return call(name, core, arrays, threads)
    rows = next(len(array) for array in arrays if array is not None)
    calls = [
        (name, core, [None if a is None else np.ascontiguousarray(a[part]) for a in arrays], threads or 1)
        for part in parts_of(executor, rows)
    ]
    found = in_order(executor, call, calls)
    if isinstance(found[0], list):
        return [item for part in found for item in part]
    return tuple(
        np.concatenate(items) if isinstance(items[0], np.ndarray) else [x for item in items for x in item]
        for items in zip(*found)
    )

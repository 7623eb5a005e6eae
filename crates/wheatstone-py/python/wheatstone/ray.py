"""Ray: locating points of a Ray dataset, and many calibrations at once.

Needs Ray: ``pip install wheatstone[ray]``. Wheatstone must be installed where the workers run.
"""

# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# Ray's types are partial.

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
import ray
import ray.data
from ray.exceptions import RayError

from ._arguments import share
from ._inputs import Data
from ._named import Columns
from ._sigmas import sigma_or_columns
from ._workers import Model, loaded, model_bytes, use_threads
from .calibration import Calibration
from .data import Dataset, of_arrays
from .errors import ArgumentError
from .fitting import fit

__all__ = ["fit_many", "locate"]

Key = TypeVar("Key", bound=Hashable)


class _Locator:
    """An actor: it loads the model once, and locates the batches that it gets."""

    def __init__(
        self,
        model: bytes,
        covariance: bool,
        test: dict[str, Any],
        columns: Columns | None,
        threads: int,
    ) -> None:
        use_threads(threads)
        self.calibration = loaded(model)
        self.settings: dict[str, Any] = {"covariance": covariance, "columns": columns, **test}

    def __call__(self, batch: Any) -> Any:
        return self.calibration.locate_arrow(batch, **self.settings)


def locate(
    dataset: ray.data.Dataset,
    model: Model,
    *,
    covariance: bool = False,
    false_alarm: float = 0.001,
    pixel_sigma: float | str | Sequence[str] | None = None,
    columns: Columns | None = None,
    concurrency: int | tuple[int, int] | None = None,
    num_cpus: float = 1,
) -> ray.data.Dataset:
    """Appends places to a Ray dataset of matched pixels: the same rows, in the same order.

    Lazy, as all of Ray Data. The columns are those of `Calibration.locate_arrow`, and so are the bits. Rows
    that cannot be located keep their place, with nulls.

    Parameters
    ----------
    dataset : ray.data.Dataset
        With columns ``x1, y1, x2, y2, ...`` in pixels, or those that `columns` names; others go along. The
        order of blocks is preserved for it too.
    model : Calibration, bytes, or path
        The model, the content of its file, or the path, which is read here and not on the workers.
    covariance : bool
        Whether to append the whole covariance of each point.
    false_alarm : float
        The share of correct matches that may be called a mismatch.
    pixel_sigma : float, str, or sequence of str, optional
        Standard deviation of a pixel coordinate, or the column or columns that have it, as in
        `Calibration.locate_arrow`.
    columns : mapping or sequence, optional
        What the dataset calls its columns; see `wheatstone.read`.
    concurrency : int or (int, int), optional
        The number of workers, or the least and the most; Ray chooses otherwise. A small cluster starts with
        fewer, since reading and writing need a CPU.
    num_cpus : float
        CPUs that Ray reserves for a worker. A worker has as many threads, one at least, unless
        ``WHEATSTONE_THREADS`` says their number.

    Returns
    -------
    ray.data.Dataset
        A batch whose worker died is located by another one.

    Examples
    --------
    >>> import ray, wheatstone.ray
    >>> rows = ray.data.read_parquet("matched/")  # doctest: +SKIP
    >>> wheatstone.ray.locate(rows, "model.json").write_parquet("located/")  # doctest: +SKIP
    """
    test = {"false_alarm": share(false_alarm, "false_alarm"), "pixel_sigma": sigma_or_columns(pixel_sigma)}
    threads = max(1, int(num_cpus))
    cpus = _cpus()
    if 0 < cpus <= num_cpus:
        num_cpus = max(0.0, cpus - 1)
    result = dataset.map_batches(
        _Locator,
        fn_constructor_args=(model_bytes(model), covariance, test, columns, threads),
        batch_format="pyarrow",
        batch_size=None,
        compute=_workers(concurrency, cpus, num_cpus),
        num_cpus=num_cpus,
        max_restarts=-1,
        max_task_retries=-1,
    )
    result.context.execution_options.preserve_order = True
    return result


def fit_many(
    tables: Mapping[Key, Data] | Iterable[tuple[Key, Data]], *, num_cpus: float = 1, **settings: Any
) -> dict[Key, Calibration | Exception]:
    """Fits many models, each in a Ray task.

    Parameters
    ----------
    tables : mapping, or iterable of (key, data)
        What each model is fitted to: a `Dataset`, a table or a path, as `wheatstone.fit` takes it. An
        iterable is asked for as many as there are CPUs to fit them, and some more.
    num_cpus : float
        CPUs that Ray reserves for a fit, which has as many threads, one at least, unless
        ``WHEATSTONE_THREADS`` says their number.
    **settings
        Of `wheatstone.fit`, for all of them.

    Returns
    -------
    dict
        The models by their keys, in the order of `tables`. In place of one whose fit failed stands its
        exception.

    Examples
    --------
    >>> import wheatstone as ws, wheatstone.ray
    >>> rigs = {"left": "left.csv", "right": "right.csv"}
    >>> models = wheatstone.ray.fit_many(rigs, method="brown")  # doctest: +SKIP
    >>> failed = [key for key in models if isinstance(models[key], Exception)]  # doctest: +SKIP
    """
    if not ray.is_initialized():
        ray.init()
    threads = max(1, int(num_cpus))
    task = ray.remote(_fitted).options(num_cpus=num_cpus, max_retries=3)
    given: Any = tables.items() if isinstance(tables, Mapping) else tables
    pairs: Iterable[tuple[Key, Data]] = given
    most = 2 * _places(_cpus(), num_cpus)
    fitted: dict[Key, Calibration | Exception] = {}
    running: dict[Any, Key] = {}

    def collect(count: int) -> None:
        done, _ = ray.wait(list(running), num_returns=count)
        for reference in done:
            key = running.pop(reference)
            try:
                result = ray.get(reference)
            except RayError as problem:
                result = problem
            fitted[key] = Calibration.from_bytes(result) if isinstance(result, bytes) else result

    order: dict[Key, None] = {}
    for key, data in pairs:
        if key in order:
            raise ArgumentError(f"key {key!r} stands there twice", hint="give each table a key of its own")
        order[key] = None
        if len(running) >= most:
            collect(1)
        running[task.remote(_parts(data), settings, threads)] = key
    if running:
        collect(len(running))
    return {key: fitted[key] for key in order}


def _cpus() -> float:
    """CPUs of the cluster as it is now."""
    cluster: Any = ray
    resources: dict[str, float] = cluster.cluster_resources()
    return resources.get("CPU", 0.0)


def _places(cpus: float, num_cpus: float) -> int:
    """How many workers these CPUs are enough for; one at least."""
    return max(1, int(cpus / max(num_cpus, 0.01)))


def _workers(
    concurrency: int | tuple[int, int] | None, cpus: float, num_cpus: float
) -> ray.data.ActorPoolStrategy:
    if concurrency is None:
        return ray.data.ActorPoolStrategy(min_size=1)
    least, most = concurrency if isinstance(concurrency, tuple) else (concurrency, concurrency)
    # Workers that held every CPU would wait for rows that nobody is left to read.
    least = min(least, _places(cpus - 1, num_cpus))
    return ray.data.ActorPoolStrategy(min_size=least, max_size=most)


def _parts(data: Data) -> Any:
    """A dataset as what can be sent to another process."""
    if not isinstance(data, Dataset):
        return data
    points, board, ids, names = data.points, data.board, data.ids, data.view_names
    return _Parts(
        data.pixels,
        points=None if np.isnan(points).all() else points,
        board=None if np.isnan(board).all() else board,
        views=[names[view] for view in data.views] if names else None,
        ids=None if any(name is None for name in ids) else ids,
        unit=data.unit,
    )


class _Parts:
    """The arrays of a `Dataset`."""

    def __init__(self, pixels: Any, **others: Any) -> None:
        self.pixels = pixels
        self.others = others

    def whole(self) -> Dataset:
        return of_arrays(self.pixels, **self.others)


def _fitted(data: Any, settings: dict[str, Any], threads: int) -> bytes | Exception:
    use_threads(threads)
    try:
        return fit(data.whole() if isinstance(data, _Parts) else data, **settings).to_bytes()
    except Exception as problem:
        return problem

"""Training sets of simulated slides."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _frames, _wstac
from ._models import Configuration, Path, as_json, native_config
from ._wstac import Error


def dataset(
    sweep: Union[Path, Mapping[str, Any]],
    *,
    input: str = "frames",
    config: Configuration = None,
    threads: Optional[int] = None,
) -> dict[str, NDArray[Any]]:
    """Simulates a training set: the arrays that `wstac dataset` writes, in memory.

    `sweep` is a path, SWEEP.toml, or its keys (`wstac dataset --help` lists them); {} is 1000 slides of the paper's ten
    specimens. The arrays of n samples are X int16 (n, 10, 70), y_specimen, y_pattern, y_depth, speed, direction, seed,
    reliable, duration and source. There are also scale and fps. `threads` is the number of slides that are made at a
    time, by default the number of processors. The same sweep gives the same arrays. Slides without a complete sample
    are left out.

    With `input` "path", "taxel-path" or "taxels", the arrays are those of `wstac dataset --input`: a sweep is of random
    slides, and X_path, X_taxel_path or X_taxels takes the place of X. `split` says which slides are for tests.

    >>> import wstac
    >>> data = wstac.dataset({"specimens": ["Saw3", "Fla0"], "slides": 3})
    >>> data["X"].shape, data["X"].dtype, data["y_specimen"].tolist()
    ((6, 10, 70), dtype('int16'), ['Saw3', 'Saw3', 'Saw3', 'Fla0', 'Fla0', 'Fla0'])
    >>> data = wstac.dataset({"specimens": ["Saw3", "Fla0"], "slides": 8, "sensors": 4}, input="path")
    >>> data["X_path"].shape, sorted(set(data["split"].tolist()))
    ((8, 10, 70), ['test', 'train'])
    """
    is_table = isinstance(sweep, Mapping)
    text = as_json("sweep", sweep) if isinstance(sweep, Mapping) else os.fsdecode(sweep)
    if threads is not None:
        threads = _frames.count("threads", threads, 1, 1024)
    if input != "frames":
        if config is not None:
            raise Error(f"config: a sweep for the input {input!r} has the default one; leave it out")
        with np.load(io.BytesIO(_wstac.path_dataset(text, is_table, input, threads))) as arrays:
            return dict(arrays)
    made, no_event, incomplete = _wstac.dataset(text, is_table, native_config(config), threads)
    with np.load(io.BytesIO(made)) as arrays:
        data = dict(arrays)
    if not len(data["X"]):
        counts = f"{no_event} had no event and {incomplete} an incomplete sample"
        raise Error(f"sweep: no slide became a sample ({counts}); try other speeds, or a scene with more light")
    return data

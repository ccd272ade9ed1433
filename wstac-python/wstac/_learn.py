"""Models of new textures from a few slides of each."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _wstac
from ._models import Model, Path
from ._save import write
from ._wstac import Error


def learn(
    base: Union[Path, Model],
    X: NDArray[np.int16],
    y: Sequence[str],
    *,
    path: Optional[Path] = None,
    note: Optional[str] = None,
    force: bool = False,
) -> Model:
    """Makes a model of new textures from a few slides of each, as `wstac model learn` does.

    `base` is a calibrated model: "builtin:taxel-embedding" (25 taxels, which tells textures apart better),
    "builtin:embedding" (ten sums) or a file. X has samples as `Model.predict` of the base takes them, and y the name of
    each. Five slides of each texture are enough. From three of each on, the model also says how sure an answer is and
    what is unknown. Rows of zeros are left out.

    Writes the file `path`, if it is given, with the text `note` in it. Returns the model, which names only the textures
    of y. Raises `Error` for fewer than two textures.

    >>> import numpy, wstac
    >>> def sample(specimen, seed):
    ...     scene = f"{specimen}@{80 + 20 * seed},{50 * seed}deg,seed={seed}"
    ...     [event] = wstac.simulate(scene, frames=False, path_samples=True).events
    ...     return event.taxel_path_sample
    >>> slides = [("denim", "Saw3"), ("cork", "Sin4")]
    >>> X = numpy.stack([sample(specimen, seed) for _, specimen in slides for seed in range(1, 6)])
    >>> y = [name for name, _ in slides for _ in range(5)]
    >>> model = wstac.learn("builtin:taxel-embedding", X, y)
    >>> model.labels, model.predict(sample("Sin4", 7)[None]).tolist()
    (['cork', 'denim'], ['cork'])
    """
    model = base if isinstance(base, Model) else Model.load(base)
    samples, names = model._samples(X), list(y)
    if len(names) != len(samples):
        raise Error(f"y: {len(names)} names, expected {len(samples)} as of X")
    for name in names:
        if not isinstance(name, (str, int, np.integer)):
            raise Error(f"y: {name!r} is of {type(name).__name__}, expected names")
    file = None if path is None else os.fsdecode(path)
    made = _wstac.learn(model._native, samples, [str(name) for name in names], note)
    learned = Model.from_bytes(made, file or "learned")
    if file is not None:
        write(learned, file, force)
    return learned

"""Training of texture models."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _frames, _wstac
from ._models import Configuration, Model, Path, native_config


@dataclass(frozen=True)
class Training:
    """A trained model, and its test.

    >>> import pathlib, tempfile, wstac
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> _ = (folder / "sweep.toml").write_text("specimens = ['Fla0', 'Saw4']\\nslides = 100\\nsensors = 20")
    >>> trained = wstac.train(folder / "sweep.toml", output=folder / "my.wsm", test=0.25)
    >>> trained.model.labels, trained.groups, trained.test_groups, trained.confusion.shape
    (['Fla0', 'Saw4'], 16, 4, (2, 3))
    """

    model: Model
    """The model, as `Model.load` gives it."""
    slides: int
    """Slides that it was trained on."""
    groups: int
    """Sensors or recordings that it was trained on."""
    left_out: int
    """Slides for training that have no sample."""
    calibrated: bool
    """Whether the model says how sure it is (`Model.predict_proba`)."""
    test_slides: int
    """Slides of the test, all of other sensors or recordings; 0 without a test."""
    test_groups: int
    """Sensors or recordings of the test."""
    accuracy: Optional[float]
    """Fraction of slides with a right answer in the test, 0 to 1; None without a test. A slide without an answer counts
    as wrong."""
    interval: Optional[tuple[float, float]]
    """Wilson's interval of 95 % of `accuracy`."""
    accuracy_of_answered: Optional[float]
    """Fraction of right answers among the slides with an answer: neither without a sample, nor said to be unknown."""
    confusion: Optional[NDArray[np.int64]] = field(repr=False, compare=False)
    """Slides by label and answer, in the order of `model.labels`. The last column is that of slides without an
    answer."""


def train(
    sets: Union[Path, Sequence[Path]] = (),
    *,
    output: Path,
    input: str = "path",
    task: str = "specimen",
    test: float = 0.2,
    note: Optional[str] = None,
    config: Configuration = None,
    threads: Optional[int] = None,
    force: bool = False,
) -> Training:
    """Trains a texture model, tests it, and writes the model file `output`: what `wstac train` does, without a figure.

    `sets` are data sets (.npz), recordings (.mcap, or folders of them) or a sweep (.toml); without any, slides of 500
    sensors are simulated, which takes about a minute. Slides of one sensor or recording are never on both sides of the
    test. The arguments are the options of the command. Raises `Error` if all slides are of one group; `test=0` trains
    without a test.

    >>> import pathlib, tempfile, wstac
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> _ = (folder / "sweep.toml").write_text("specimens = ['Fla0', 'Saw4']\\nslides = 300\\nsensors = 30")
    >>> trained = wstac.train(folder / "sweep.toml", output=folder / "my.wsm")
    >>> trained.model.labels, trained.groups, trained.test_groups, trained.accuracy > 0.9
    (['Fla0', 'Saw4'], 24, 6, True)
    """
    several = [sets] if isinstance(sets, (str, bytes, os.PathLike)) else list(sets)
    if threads is not None:
        threads = _frames.count("threads", threads, 1, 1024)
    path = os.fsdecode(output)
    names = [os.fsdecode(name) for name in several]
    made = _wstac.train(names, path, input, task, float(test), note, native_config(config), threads, force)
    tested = "right" in made
    return Training(
        model=Model.load(path),
        slides=made["slides"],
        groups=made["groups"],
        left_out=made["left_out"],
        calibrated=made["calibrated"],
        test_slides=made.get("test_slides", 0),
        test_groups=made.get("test_groups", 0),
        accuracy=made["right"] / made["test_slides"] if tested else None,
        accuracy_of_answered=made["right"] / max(made["answered"], 1) if tested else None,
        interval=(made["interval"][0], made["interval"][1]) if tested else None,
        confusion=np.array(made["confusion"], dtype=np.int64) if tested else None,
    )

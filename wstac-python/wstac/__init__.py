"""Tactile events from the camera frames of a WSTac sensor.

The arithmetic is that of the command `wstac` and of the firmware, bit for bit: features are int16 in units of 1/2048 of
a natural logarithm, and a model gives the same answer here as on a board.

>>> import wstac
>>> scene = wstac.simulate("Saw3@150,90deg,seed=7", size=(400, 400), models="builtin")
>>> scene.frames.shape, scene.frames.dtype, scene.features.shape
((141, 400, 400), dtype('uint8'), (141, 10))
>>> [event] = scene.events
>>> event.contact, event.speed.mm_s, event.direction.deg, event.texture.specimen, event.sample.shape
('slide', 150.1, 90.0, 'Saw3', (10, 70))
>>> event.touch_frame, event.time_s, event.speed.sd, event.direction.sd
(46, 1.5333, 1.21, 0.05)
>>> scene.contact_ends
[ContactEnd(frame=75, event_frame=35, time_s=2.5)]

Frames of your own go through `features`, or one by one through a `Pipeline`. `open` gives the events of any source of
the command, such as a camera, as they come, and its frames with taxels and features; in asyncio, too. `read` reads all
of a recording. `plot_event` and `plot_features` draw with matplotlib. `fit_speed` fits the speed law to slides.
`dataset` simulates training sets, `train` trains a `Model`, which names textures, `learn` makes one from a few slides
of each texture, `save` makes one of an estimator of yours, and `TextureClassifier` is an estimator of scikit-learn.
`Config` configures everything. `Skin` makes light of whiskers' overlaps, and `wstac.mujoco` puts a sensor on a body of
a MuJoCo model. `wstac.lerobot` writes data sets of LeRobot.
What cannot be used raises `Error`, a `ValueError` with the words of the command; that of a file that does not exist is
a `FileNotFoundError`, too. Ctrl-C raises `KeyboardInterrupt` within a second.
"""

from __future__ import annotations

from ._answers import (
    Acceleration,
    ContactEnd,
    Direction,
    EarlyTexture,
    End,
    Event,
    Fault,
    Incomplete,
    Lost,
    Measured,
    Motion,
    Slip,
    Speed,
    Texture,
)
from ._classifier import TextureClassifier
from ._dataset import dataset
from ._errors import NotFoundError
from ._learn import learn
from ._models import Config, Model
from ._pipeline import Pipeline, features
from ._plots import plot_event, plot_features
from ._recording import Recording, Truth, read, simulate
from ._samples import EventSamples
from ._save import save
from ._skin import Skin
from ._speed import SpeedFit, fit_speed
from ._stream import FeatureFrame, Frame, Stream, open
from ._train import Training, train
from ._wstac import Error, __version__

__all__ = [
    "Acceleration",
    "Config",
    "ContactEnd",
    "Direction",
    "EarlyTexture",
    "End",
    "Error",
    "Event",
    "EventSamples",
    "Fault",
    "FeatureFrame",
    "Frame",
    "Incomplete",
    "Lost",
    "Measured",
    "Model",
    "Motion",
    "NotFoundError",
    "Pipeline",
    "Recording",
    "Skin",
    "Slip",
    "Speed",
    "SpeedFit",
    "Stream",
    "Texture",
    "TextureClassifier",
    "Training",
    "Truth",
    "__version__",
    "dataset",
    "features",
    "fit_speed",
    "learn",
    "open",
    "plot_event",
    "plot_features",
    "read",
    "save",
    "simulate",
    "train",
]

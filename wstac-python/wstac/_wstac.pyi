"""The extension module, which only converts. Programs use `wstac`."""

import os
from typing import Any, Optional, Union, final

import numpy as np
from numpy.typing import NDArray

from ._answers import Record

__version__: str

__all__ = [
    "Config",
    "Error",
    "Model",
    "Pipeline",
    "Source",
    "__version__",
    "dataset",
    "fit",
    "import_model",
    "is_camera",
    "learn",
    "open_scene",
    "open_source",
    "path_dataset",
    "row_bytes",
    "train",
]

class Error(ValueError):
    """What cannot be used: what was found and what was expected, in the words of the command wstac."""

    kind: Optional[str]

@final
class Config:
    def __new__(cls, toml: str = "") -> Config: ...
    @staticmethod
    def read(path: Union[str, os.PathLike[str]]) -> Config: ...
    @staticmethod
    def from_json(json: str) -> Config: ...
    @property
    def toml(self) -> str: ...

@final
class Model:
    @staticmethod
    def load(path: Union[str, os.PathLike[str]]) -> Model: ...
    @staticmethod
    def from_bytes(name: str, content: bytes) -> Model: ...
    def to_bytes(self) -> bytes: ...
    @property
    def name(self) -> str: ...
    @property
    def labels(self) -> list[str]: ...
    @property
    def task(self) -> str: ...
    @property
    def frames(self) -> int: ...
    @property
    def input(self) -> str: ...
    def classes(self, samples: NDArray[np.int16]) -> NDArray[np.uint8]: ...
    def known(self, samples: NDArray[np.int16]) -> Optional[NDArray[np.bool_]]: ...
    def scores(self, samples: NDArray[np.int16]) -> NDArray[np.float64]: ...
    def probabilities(self, samples: NDArray[np.int16]) -> Optional[NDArray[np.float64]]: ...

@final
class Pipeline:
    def __new__(
        cls,
        format: str,
        size: tuple[int, int],
        bytes_per_row: Optional[int],
        rate: tuple[int, int],
        matrix: Optional[str],
        range: Optional[str],
        config: Config,
        models: list[Model],
        motion: bool,
        paths: bool,
        timed: bool,
        record: Optional[str],
        labels: dict[str, str],
    ) -> Pipeline: ...
    def push(self, frames: NDArray[np.uint8], time_ns: Optional[int] = None) -> tuple[list[Record], NDArray[np.int16]]: ...
    def lose(self, frames: int) -> tuple[list[Record], NDArray[np.int16]]: ...
    def finish(self) -> tuple[list[Record], NDArray[np.int16]]: ...
    def taxels(self) -> Optional[NDArray[np.float32]]: ...
    def next_frame(self) -> int: ...

@final
class Source:
    @property
    def about(self) -> str: ...
    @property
    def shape(self) -> tuple[str, int, int, int]: ...
    @property
    def rate(self) -> tuple[int, int]: ...
    @property
    def labels(self) -> dict[str, str]: ...
    @property
    def models(self) -> list[str]: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def config(self) -> Config: ...
    def next(self) -> list[Record]: ...
    def next_frame(self, with_picture: bool) -> dict[str, Any]: ...
    def gather(self, with_frames: bool) -> dict[str, Any]: ...
    def close(self) -> None: ...

def row_bytes(format: str, width: int) -> int: ...
def is_camera(spec: str) -> bool: ...
def open_source(spec: str, options: dict[str, Any], features: bool) -> Source: ...
def open_scene(
    scene: str, is_table: bool, options: dict[str, Any]
) -> tuple[Source, list[tuple[str, str | None, float | None, float | None, int, float, float]]]: ...
def dataset(sweep: str, is_table: bool, config: Optional[Config], threads: Optional[int]) -> tuple[bytes, int, int]: ...
def path_dataset(sweep: str, is_table: bool, input: str, threads: Optional[int]) -> bytes: ...
def fit(
    samples: NDArray[np.int16],
    labels: list[str],
    groups: list[str],
    input: str,
    task: Optional[str],
    threads: Optional[int],
) -> bytes: ...
def import_model(
    name: str,
    content: bytes,
    labels: Optional[list[str]],
    task: Optional[str],
    input: Optional[str],
    samples: NDArray[np.int16],
    note: Optional[str],
) -> bytes: ...
def learn(base: Model, samples: NDArray[np.int16], names: list[str], note: Optional[str]) -> bytes: ...
def train(
    sets: list[str],
    output: str,
    input: str,
    task: str,
    test: float,
    note: Optional[str],
    config: Optional[Config],
    threads: Optional[int],
    force: bool,
) -> dict[str, Any]: ...

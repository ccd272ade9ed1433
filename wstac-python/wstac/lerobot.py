"""Recordings as a data set of LeRobot v3.0, with the wheel's extra `lerobot` and ffmpeg.

    import wstac.lerobot

    wstac.lerobot.write("set", ["saw3.mcap", "fla0.mcap"], arm="arm.toml")

It is what `wstac dataset --lerobot set saw3.mcap fla0.mcap --arm arm.toml` runs. Every source is an episode.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _arm, _stream
from ._models import Config, Configuration
from ._rows import Rows
from ._stream import Frame, Stream
from ._video import CHUNK, MOST_MB, NAME, PICTURE, Video
from ._wstac import Error, visible_lines

try:
    import pyarrow as pa  # type: ignore[import, unused-ignore]
    import pyarrow.parquet as pq  # type: ignore[import, unused-ignore]
except ImportError as _error:
    raise ImportError("pyarrow: is not installed\nhelp: install the wheel with [lerobot] (docs/SETS.md)") from _error

__all__ = ["Summary", "write"]

# Size of a file above which the next episode has the next one: that of LeRobot.
_DATA_MB = 100
_DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_QUANTILES = (0.01, 0.10, 0.50, 0.90, 0.99)


@dataclass
class Summary:
    """What `write` has written."""

    episodes: int = 0
    frames: int = 0
    lost: int = 0
    """Frames that the cameras lost: they have no row."""
    cut: int = 0
    """Frames before the first and after the last values of an arm: they have no row."""
    notes: list[str] = field(default_factory=list)
    """What a person should know of the episodes."""


def write(
    folder: Union[str, os.PathLike[str]],
    sources: Iterable[Union[str, os.PathLike[str]]],
    *,
    arm: Union[str, os.PathLike[str], None] = None,
    task: Optional[str] = None,
    size: Optional[tuple[int, int]] = None,
    sensor: Optional[str] = None,
    config: Configuration = None,
    say: Optional[Callable[[str], object]] = None,
) -> Summary:
    """Writes a new folder with a data set of LeRobot v3.0.

    Every source is an episode: a recording, each one of a folder, or a scene.

    `arm` is a TOML file that says how the arm's state and action are joined (`wstac dataset --help`). `task` is that of
    recordings without the label task; else it is made of the label specimen. `size` scales the pictures. `sensor` is
    that of recordings of several. `say` is called with a line as each source begins. Raises `Error` if a source or the
    arm cannot be used; no folder is left then.
    """
    target = Path(folder)
    if target.exists():
        raise Error(f"{target}: exists, expected the name of a new folder")
    _check_size(size)
    joins = {} if arm is None else _arm.read_tables(Path(arm))
    found = list(_found(sources))
    target.absolute().parent.mkdir(parents=True, exist_ok=True)
    hidden = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.absolute().parent))
    try:
        # A folder in it has the mode that the umask gives.
        new = hidden / "set"
        new.mkdir()
        writer = _Writer(new, size)
        try:
            for number, source in enumerate(found, 1):
                if say:
                    say(f"{source}: source {number} of {len(found)}")
                with _stream.open(source, config=config, motion=True, sensor=sensor) as stream:
                    name = Path(source).stem
                    arms = {key: _arm.Arm(keys, Path(arm or "").parent, name) for key, keys in joins.items()}
                    writer.episode(source, stream, arms, task)
            summary = writer.finish()
        except BaseException:
            writer.abandon()
            raise
        new.rename(target)
        return summary
    finally:
        shutil.rmtree(hidden, ignore_errors=True)


def _check_size(size: Optional[tuple[int, int]]) -> None:
    if size is not None and (min(size) < 2 or size[0] % 2 or size[1] % 2):
        raise Error(f"size is {size[0]}x{size[1]}, expected even numbers, as H.264 demands")


def _found(sources: Iterable[Union[str, os.PathLike[str]]]) -> Iterator[str]:
    """Yields sources, and the recordings of folders in the order of names."""
    count = 0
    for source in sources:
        name = os.fsdecode(source)
        path = Path(name)
        names = sorted(str(file) for file in path.glob("*.mcap")) if path.is_dir() else [name]
        if not names:
            raise Error(f"{name}: has no recordings, expected files .mcap")
        count += len(names)
        yield from names
    if not count:
        raise Error("sources: has none, expected at least one recording or scene")


def _stats(values: NDArray[Any]) -> Optional[dict[str, Any]]:
    """Returns the statistics of columns (n, k), without what is missing; None if a column has nothing else."""
    known = np.asarray(values, np.float64)
    known = known[np.isfinite(known).all(axis=1)]
    if not len(known):
        return None
    made = {name: getattr(known, name)(0) for name in ("min", "max", "mean", "std")}
    made["count"] = np.array([len(known)])
    made.update(zip((f"q{round(100 * q):02d}" for q in _QUANTILES), np.quantile(known, _QUANTILES, axis=0)))
    return made


def _merged(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """Returns the statistics of all episodes. As LeRobot has it, quantiles are the bounds of those of episodes."""
    count = np.array([part["count"][0] for part in parts])
    stacked = {name: np.stack([part[name] for part in parts]) for name in parts[0] if name != "count"}
    weights = (count / count.sum()).reshape(-1, *[1] * (stacked["mean"].ndim - 1))
    mean = (stacked["mean"] * weights).sum(0)
    variance = ((stacked["std"] ** 2 + (stacked["mean"] - mean) ** 2) * weights).sum(0)
    least = ("min", "q01", "q10", "q50")
    made = {name: values.min(0) if name in least else values.max(0) for name, values in stacked.items()}
    return {**made, "mean": mean, "std": np.sqrt(variance), "count": np.array([count.sum()])}


class _Writer:
    """A data set that grows by episodes."""

    def __init__(self, folder: Path, size: Optional[tuple[int, int]]) -> None:
        self._folder, self._size = folder, size
        self._features: dict[str, dict[str, Any]] = {}
        self._fps = 0
        self._video: Optional[Video] = None
        self._data: Optional[pq.ParquetWriter] = None
        self._data_number = 0
        self._tasks: dict[str, int] = {}
        self._episodes: list[dict[str, Any]] = []
        self._stats: list[dict[str, Optional[dict[str, Any]]]] = []
        self._summary = Summary()

    def episode(self, source: str, stream: Stream, arms: dict[str, _arm.Arm], task: Optional[str]) -> None:
        """Adds an episode."""
        self._check_rate(source, stream)
        specimen = stream.labels.get("specimen")
        name = stream.labels.get("task") or task or (f"touch {specimen}" if specimen else "touch")
        rows = Rows(source, stream, arms)
        from_frame = None
        for frame in rows:
            if from_frame is None:
                from_frame = self._begin(source, stream, frame)
            if (frame.picture is None) != (self._video is None):
                raise Error(f"{source}: has {'no ' if self._video else ''}pictures, unlike the episodes before it")
            if self._video and frame.picture is not None:
                self._video.add(frame.picture)
        if from_frame is None:
            raise Error(f"{source}: {rows.why_none()}")
        rows.check_end()
        self._define(source, rows)
        length, first = rows.length, self._summary.frames
        columns = rows.columns
        columns["timestamp"] = np.arange(length, dtype=np.float32) / np.float32(self._fps)
        columns["frame_index"] = np.arange(length)
        columns["episode_index"] = np.full(length, len(self._episodes))
        columns["index"] = np.arange(first, first + length)
        columns["task_index"] = np.full(length, self._tasks.setdefault(name, len(self._tasks)))
        self._write_rows(columns)
        about = {"episode_index": len(self._episodes), "tasks": [name], "length": length}
        about.update({"data/chunk_index": self._data_number // CHUNK, "data/file_index": self._data_number % CHUNK})
        about.update(dataset_from_index=first, dataset_to_index=first + length)
        if self._video:
            chunk, at = divmod(self._video.number, CHUNK)
            to = {"chunk_index": chunk, "file_index": at, "from_timestamp": from_frame / self._fps}
            to["to_timestamp"] = (from_frame + length) / self._fps
            about.update({f"videos/{PICTURE}/{key}": value for key, value in to.items()})
        about.update({"wstac/source": source, "wstac/lost_frames": rows.lost, "wstac/start_ns": rows.start_ns})
        self._episodes.append(about)
        self._stats.append({key: _stats(values.reshape(length, -1)) for key, values in columns.items()})
        self._summary.frames += length
        self._summary.lost += rows.lost
        self._summary.cut += rows.cut
        self._summary.notes += rows.notes()

    def _check_rate(self, source: str, stream: Stream) -> None:
        fps = max(1, round(stream.fps))
        if self._fps not in (0, fps):
            raise Error(f"{source}: {stream.fps:g} frames per second, expected {self._fps} as before")
        if abs(stream.fps - fps) > 1e-9:
            self._summary.notes.append(f"{source}: {stream.fps:.3f} frames per second, of which the set says {fps}")
        self._fps = fps

    def _begin(self, source: str, stream: Stream, frame: Frame) -> int:
        """Begins the video of an episode, if it has pictures. Returns its first frame in the file."""
        if frame.picture is None:
            return 0
        if self._video is None and not self._episodes:
            self._video = Video(self._folder, self._fps, self._size)
        if self._video is None:
            return 0
        self._video.begin(source, stream)
        return self._video.frames

    def _define(self, source: str, rows: Rows) -> None:
        """Defines what the columns are, by the first episode."""
        features = rows.features()
        integer = {"dtype": "int64", "shape": [1], "names": None}
        features["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
        features.update({key: integer for key in ("frame_index", "episode_index", "index", "task_index")})
        if self._features:
            of_rows = {key: value for key, value in self._features.items() if key != PICTURE}
            for key in (*of_rows, *features):
                if of_rows.get(key) != features.get(key):
                    was, now = ((of.get(key) or {}).get("names") for of in (of_rows, features))
                    raise Error(f"{source}: {key} has {now}, expected {was} as in the first episode")
            return
        if self._video:
            assert self._video.size
            width, height = self._video.size
            info = {"video.height": height, "video.width": width, "video.codec": "h264", "video.pix_fmt": "yuv420p"}
            info.update({"video.fps": self._fps, "video.channels": 3, "is_depth_map": False, "has_audio": False})
            names = ["height", "width", "channels"]
            picture = {"dtype": "video", "shape": [height, width, 3], "names": names, "info": info}
            features = {PICTURE: picture, **features}
        self._features = features

    def _write_rows(self, columns: dict[str, NDArray[Any]]) -> None:
        """Writes the rows of an episode as a row group."""
        table = pa.table({key: _array(values, self._features[key]) for key, values in columns.items()})
        if self._data and self._data_path().stat().st_size > _DATA_MB << 20:
            self._data.close()
            self._data, self._data_number = None, self._data_number + 1
        if self._data is None:
            self._data_path().parent.mkdir(parents=True, exist_ok=True)
            self._data = pq.ParquetWriter(self._data_path(), table.schema)
        self._data.write_table(table)

    def _data_path(self) -> Path:
        return self._folder / _DATA.format(chunk_index=self._data_number // CHUNK, file_index=self._data_number % CHUNK)

    def finish(self) -> Summary:
        """Writes what describes the set."""
        if self._data:
            self._data.close()
        if self._video:
            self._video.end()
            self._add_picture_stats(self._video)
        meta = self._folder / "meta"
        (meta / "episodes/chunk-000").mkdir(parents=True)
        # The names are the index of a table of pandas.
        tasks = pa.table({"task_index": pa.array(range(len(self._tasks))), "task": pa.array(list(self._tasks))})
        keys = ("name", "field_name", "pandas_type", "numpy_type", "metadata")
        of = [dict(zip(keys, column)) for column in _TASKS]
        described = {"index_columns": ["task"], "column_indexes": [], "columns": of, "pandas_version": "2.2.3"}
        pq.write_table(tasks.replace_schema_metadata({"pandas": json.dumps(described)}), meta / "tasks.parquet")
        for episode, stats in zip(self._episodes, self._stats):
            for key in self._features:
                values = stats.get(key)
                names = values or _stats(np.zeros((1, 1))) or {}
                episode.update({f"stats/{key}/{name}": values and values[name].tolist() for name in names})
            episode.update({"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0})
        pq.write_table(pa.Table.from_pylist(self._episodes), meta / "episodes/chunk-000/file-000.parquet")
        parts = {key: [known for of in self._stats if (known := of.get(key))] for key in self._features}
        all_stats = {key: _merged(known) for key, known in parts.items() if known}
        lists = {key: {name: values.tolist() for name, values in of.items()} for key, of in all_stats.items()}
        (meta / "stats.json").write_text(json.dumps(lists, indent=4))
        count = len(self._episodes)
        info = {"codebase_version": "v3.0", "fps": self._fps, "features": self._features, "total_episodes": count}
        info.update(total_frames=self._summary.frames, total_tasks=len(self._tasks), chunks_size=CHUNK)
        info.update(data_files_size_in_mb=_DATA_MB, video_files_size_in_mb=MOST_MB, data_path=_DATA)
        info.update(video_path=NAME if self._video else None, robot_type="wstac", splits={"train": f"0:{count}"})
        (meta / "info.json").write_text(json.dumps(info, indent=4))
        self._summary.episodes = count
        return self._summary

    def _add_picture_stats(self, video: Video) -> None:
        """Adds the statistics of pictures, from 0 to 1, to those of each episode."""
        for number in range(video.number + 1):
            chunk, at = divmod(number, CHUNK)
            place = (f"videos/{PICTURE}/chunk_index", f"videos/{PICTURE}/file_index")
            here = [episode for episode in self._episodes if (episode[place[0]], episode[place[1]]) == (chunk, at)]
            path = self._folder / NAME.format(video_key=PICTURE, chunk_index=chunk, file_index=at)
            # The video first: it is read to its end, which it checks.
            for pictures, episode in zip(video.sampled([episode["length"] for episode in here], path), here):
                of = _stats(pictures.reshape(-1, 3) / 255) or {}
                shaped = {name: values if name == "count" else values.reshape(3, 1, 1) for name, values in of.items()}
                self._stats[episode["episode_index"]][PICTURE] = {**shaped, "count": np.array([len(pictures)])}

    def abandon(self) -> None:
        """Stops writing, also on a full disk."""
        try:
            if self._video:
                self._video.abandon()
        finally:
            if self._data:
                with contextlib.suppress(OSError, pa.ArrowException):
                    self._data.close()


_TASKS = (("task_index", "task_index", "int64", "int64", None), ("task", "task", "unicode", "object", None))


def _array(values: NDArray[Any], feature: dict[str, Any]) -> pa.Array:
    """Returns a column in the type that its feature has."""
    flat = pa.array(np.asarray(values, feature["dtype"]).reshape(-1))
    width = feature["shape"][0]
    return flat if width == 1 else pa.FixedSizeListArray.from_arrays(flat, width)


def _size_of(text: str) -> tuple[int, int]:
    width, x, height = text.partition("x")
    if not (x and width.isdecimal() and height.isdecimal()):
        raise Error(f"--size is {text!r}, expected WIDTHxHEIGHT such as 320x240")
    size = int(width), int(height)
    _check_size(size)
    return size


def _say(text: object) -> None:
    print(visible_lines(f"wstac: {text}"), file=sys.stderr, flush=True)


def main(arguments: Optional[list[str]] = None) -> int:
    """Runs the command, and returns its exit code."""
    parser = argparse.ArgumentParser(prog="wstac dataset --lerobot", allow_abbrev=False)
    parser.add_argument("folder", type=Path)
    parser.add_argument("sources", nargs="+")
    for name in ("arm", "task", "size", "sensor", "config"):
        parser.add_argument(f"--{name}")
    given = parser.parse_args(arguments)
    came: list[int] = []

    def stop(number: int, _frame: object) -> None:
        # The first one stops; further ones would stop what removes the folder.
        came.append(number)
        if len(came) == 1:
            raise KeyboardInterrupt

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        # What nohup ignores stays so.
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, stop)
    try:
        size = None if given.size is None else _size_of(given.size)
    except Error as error:
        _say(error)
        return 2
    try:
        config = None if given.config is None else Config.read(given.config)
        options = {"arm": given.arm, "task": given.task, "size": size, "sensor": given.sensor}
        summary = write(given.folder, given.sources, config=config, say=_say, **options)
    except KeyboardInterrupt:
        return 128 + (came or [signal.SIGINT])[0]
    except (Error, OSError) as error:
        _say(error)
        return 1
    for note in summary.notes:
        _say(note)
    counted = [(summary.episodes, "episode"), (summary.frames, "frame")]
    episodes, frames = (f"{count} {what}{'s' if count != 1 else ''}" for count, what in counted)
    lost = f", {summary.lost} frame{'s' if summary.lost != 1 else ''} lost" if summary.lost else ""
    _say(f"{given.folder}: {episodes}, {frames}{lost}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""The state and the action of an arm, joined to frames by time."""

from __future__ import annotations

import bisect
import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from ._errors import NotFoundError
from ._wstac import Error, visible_line

Values = NDArray[np.float64]

# The keys of a table, with their defaults. `_` stands for what has none.
_KEYS: dict[str, Any] = {
    "file": None,
    "topic": None,
    "columns": None,
    "field": "position",
    "time": None,
    "unit": "s",
    "clock": "wall",
    "join": "linear",
    "within_ms": 20,
}
_CHOICES = {
    "field": ("position", "velocity", "effort"),
    "unit": ("s", "ms", "us", "ns"),
    "clock": ("wall", "driver", "start"),
    "join": ("linear", "nearest"),
}
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# Numbers of seconds since 1970 are rounded to a quarter of a microsecond.
_ROUNDING = 1e-6


def read_tables(path: Path) -> dict[str, dict[str, Any]]:
    """Reads the tables [state] and [action] of a TOML file, each with the defaults of its keys."""
    try:
        import tomllib
    except ImportError:
        try:
            import tomli as tomllib  # type: ignore[import-not-found, no-redef, unused-ignore]
        except ImportError:
            raise Error(f"{path}: needs Python 3.11 or tomli\nhelp: pip install tomli") from None
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise _unread(path, error) from None
    except ValueError as error:
        raise Error(f"{path}: {error}") from None
    if not tables or not set(tables) <= {"state", "action"}:
        raise Error(f"{path}: has {sorted(tables)}, expected the tables [state] and [action], or one of them")
    return {name: _keys(f"{path}: [{name}]", table) for name, table in tables.items()}


def _keys(where: str, table: Any) -> dict[str, Any]:
    """Returns the keys of a table, checked."""
    if not isinstance(table, Mapping):
        raise Error(f"{where} is {table!r}, expected a table")
    for key, value in table.items():
        if key not in _KEYS:
            raise Error(f"{where}: unknown key {key!r}, expected one of {', '.join(_KEYS)}")
        choices = _CHOICES.get(key)
        if choices and value not in choices:
            raise Error(f"{where} {key} is {value!r}, expected one of {', '.join(choices)}")
        if key in ("file", "topic", "time") and not (isinstance(value, str) and value):
            raise Error(f"{where} {key} is {value!r}, expected text")
        if key == "columns" and not (
            isinstance(value, list) and value and all(isinstance(name, str) for name in value)
        ):
            raise Error(f"{where} columns is {value!r}, expected a list of names")
        if key == "columns" and len(set(value)) < len(value):
            raise Error(f"{where} columns is {value!r}, expected names that differ")
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if key == "within_ms" and not (is_number and 0 < value < math.inf):
            raise Error(f"{where} within_ms is {value!r}, expected a number of milliseconds above 0")
    if "file" not in table:
        raise Error(f'{where}: no key "file", expected the name of a .csv, .parquet or .mcap file')
    return {**_KEYS, **table}


def _unread(path: Path, error: OSError) -> Error:
    if isinstance(error, FileNotFoundError):
        return NotFoundError(f"{path}: no such file")
    return Error(f"{path}: {error.strerror or error}")


class Arm:
    """Values of an arm over time, of one table of the file."""

    def __init__(self, keys: Mapping[str, Any], folder: Path, name: str) -> None:
        self.file = folder / keys["file"].replace("{name}", name)
        self._linear, self._within = keys["join"] == "linear", keys["within_ms"] / 1e3
        self.clock: str = keys["clock"]
        readers = {".csv": _csv, ".parquet": _parquet, ".mcap": _mcap}
        reader = readers.get(self.file.suffix.lower())
        if reader is None:
            raise Error(f"{self.file}: ends in {self.file.suffix!r}, expected .csv, .parquet or .mcap")
        try:
            self.names, times, self._values = reader(self.file, keys)
        except OSError as error:
            raise _unread(self.file, error) from None
        if not len(times):
            raise Error(f"{self.file}: has no rows, expected those of an arm")
        back = np.flatnonzero(np.diff(times) < 0)
        if len(back):
            row = int(back[0]) + 1
            raise Error(
                f"{self.file}: row {row + 1}: the time goes back from {times[row - 1]:.6f} s to {times[row]:.6f} s"
            )
        self._times: list[float] = times.tolist()

    @property
    def span(self) -> str:
        """The times that it covers, for a person."""
        return f"{self._times[0]:.3f} s to {self._times[-1]:.3f} s"

    def at(self, time: float) -> Optional[Values]:
        """Returns the values at a time, or None if it is more than within_ms before the first or after the last.

        Raises `Error` in a gap: no row is as near as the key within_ms demands.
        """
        times = self._times
        after = bisect.bisect_left(times, time)
        before = max(after - 1, 0)
        after = min(after, len(times) - 1)
        nearest = before if time - times[before] <= times[after] - time else after
        away = abs(time - times[nearest])
        if away > self._within + _ROUNDING:
            if not times[0] <= time <= times[-1]:
                return None
            found = f"row {nearest + 1} is the nearest to {time:.3f} s and {away * 1e3:.1f} ms away"
            raise Error(f"{self.file}: {found}, expected within_ms = {self._within * 1e3:g}")
        span = times[after] - times[before]
        if not self._linear or span <= 0 or not times[before] <= time <= times[after]:
            values: Values = self._values[nearest]
            return values
        share = (time - times[before]) / span
        between: Values = self._values[before] * (1 - share) + self._values[after] * share
        return between


def _listed(names: list[str]) -> str:
    """Returns names of a file as one line."""
    return visible_line(", ".join(names))


def _numbers(file: Path, row: int, column: str, text: Any) -> float:
    """Returns a number of a table, or tells where there is none."""
    try:
        value = float(text)
    except (TypeError, ValueError):
        value = math.nan
    if not math.isfinite(value):
        raise Error(f"{file}: row {row}: column {column!r} is {text!r}, expected a number")
    return value


def _columns(file: Path, keys: Mapping[str, Any], there: list[str]) -> tuple[str, list[str]]:
    """Returns the column of times, and the columns of values."""
    time = keys["time"] or "time"
    names = keys["columns"] or [name for name in there if name != time]
    for name in (time, *names):
        if name not in there:
            raise Error(f"{file}: has no column {name!r}, expected one of {_listed(there)}")
        if there.count(name) > 1:
            raise Error(f"{file}: has {there.count(name)} columns {name!r}, expected names that differ")
    if not names:
        raise Error(f"{file}: has no column besides {time!r}, expected those of an arm")
    return time, names


def _damaged(file: Path, kind: str, error: Exception) -> Error:
    said = " ".join(str(error).split()) or type(error).__name__
    return Error(f"{file}: is no {kind}, or is damaged ({visible_line(said)}), expected a whole file: copy it again")


def _csv(file: Path, keys: Mapping[str, Any]) -> tuple[list[str], Values, Values]:
    """Reads a table with a line of names. Row 1 is behind them; empty lines are no rows."""
    with open(file, newline="", encoding="utf-8-sig") as opened:
        try:
            rows = [row for row in csv.reader(opened) if row]
        except (ValueError, csv.Error) as error:
            raise Error(f"{file}: is no CSV: {error}") from None
    if not rows:
        raise Error(f"{file}: is empty, expected a line with the names of columns")
    there = [name.strip() for name in rows[0]]
    time, names = _columns(file, keys, there)
    places = [there.index(name) for name in (time, *names)]
    values = []
    for number, row in enumerate(rows[1:], 1):
        texts = [row[place] if place < len(row) else "" for place in places]
        values.append([_numbers(file, number, name, text) for name, text in zip((time, *names), texts)])
    table = np.array(values, np.float64).reshape(len(values), 1 + len(names))
    return names, table[:, 0] * _SECONDS[keys["unit"]], table[:, 1:]


def _parquet(file: Path, keys: Mapping[str, Any]) -> tuple[list[str], Values, Values]:
    """Reads a table whose columns are numbers; that of times may have times."""
    import pyarrow as pa  # type: ignore[import, unused-ignore]
    import pyarrow.parquet as pq  # type: ignore[import, unused-ignore]

    try:
        table = pq.read_table(file)
    except (pa.ArrowException, OSError) as error:
        # Damage has no number of an error of the system.
        if isinstance(error, OSError) and error.errno:
            raise
        raise _damaged(file, "Parquet", error) from None
    time, names = _columns(file, keys, table.column_names)
    columns, unit = [], _SECONDS[keys["unit"]]
    for name in (time, *names):
        column = table[name].combine_chunks()
        if name == time and pa.types.is_timestamp(column.type):
            # Not in ns: 64 bits of them end in 2262.
            unit, column = _SECONDS[column.type.unit], column.cast(pa.int64())
        try:
            column = column.cast(pa.float64(), safe=False)
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
            raise Error(f"{file}: column {name!r} has the type {column.type}, expected numbers") from None
        numbers = column.to_numpy(zero_copy_only=False)
        bad = np.flatnonzero(~np.isfinite(numbers))
        if len(bad):
            row = int(bad[0])
            raise Error(f"{file}: row {row + 1}: column {name!r} is {column[row].as_py()}, expected a number")
        columns.append(numbers)
    return names, columns[0] * unit, np.column_stack(columns[1:])


def _mcap(file: Path, keys: Mapping[str, Any]) -> tuple[list[str], Values, Values]:
    """Reads messages of ROS 2 as the schema in the file has them: JointState, or another with its fields."""
    try:
        from mcap.reader import make_reader  # type: ignore[import, unused-ignore]
        from mcap_ros2.decoder import DecoderFactory  # type: ignore[import, unused-ignore]
    except ImportError:
        raise Error(f"{file}: needs the reader of MCAP\nhelp: pip install mcap-ros2-support") from None
    topic, field, stamp = keys["topic"] or "/joint_states", keys["field"], keys["time"] or "header.stamp"
    if stamp not in ("header.stamp", "log_time"):
        raise Error(f'{file}: time is {stamp!r}, expected "header.stamp" or "log_time"')
    names: list[str] = keys["columns"] or []
    times, values = [], []
    with open(file, "rb") as opened:
        try:
            reader = make_reader(opened, decoder_factories=[DecoderFactory()])
            found = reader.get_summary()
            topics = sorted({channel.topic for channel in found.channels.values()}) if found else []
            if found and topic not in topics:
                raise Error(f"{file}: has no topic {topic!r}, expected one of {_listed(topics) or 'none'}")
            for row, one in enumerate(reader.iter_decoded_messages(topics=[topic]), 1):
                message, schema = one.decoded_message, one.schema.name if one.schema else "none"
                if not hasattr(message, "name") or not hasattr(message, field):
                    raise Error(f"{file}: {topic} has messages {schema}, expected sensor_msgs/msg/JointState")
                joints, numbers = list(message.name), list(getattr(message, field))
                names = names or joints
                if len(set(joints)) < len(joints):
                    raise Error(f"{file}: row {row}: name has {_listed(joints)}, expected names that differ")
                if len(joints) != len(numbers):
                    raise Error(
                        f"{file}: row {row}: {field} has {len(numbers)} values, expected {len(joints)} as name has"
                    )
                at = dict(zip(joints, numbers))
                absent = [name for name in names if name not in at]
                if absent:
                    raise Error(f"{file}: row {row}: has no joint {absent[0]!r}, expected one of {_listed(joints)}")
                values.append([_numbers(file, row, name, at[name]) for name in names])
                nanoseconds = one.message.log_time
                if stamp == "header.stamp":
                    nanoseconds = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
                    if not nanoseconds:
                        raise Error(f'{file}: row {row}: header.stamp is 0\nhelp: set time = "log_time"')
                times.append(nanoseconds * 1e-9)
        except (Error, OSError):
            raise
        except Exception as error:
            # Damaged bytes reach struct, zstandard, lz4 and the decoder, each with errors of its own.
            raise _damaged(file, "MCAP with messages of ROS 2", error) from None
    return names, np.array(times), np.array(values, np.float64)

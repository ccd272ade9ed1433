"""Checks how wstac.lerobot joins an arm: from CSV, Parquet and MCAP, by every clock, and what it refuses."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import wstac
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from mcap_ros2.writer import Writer
from wstac._arm import _KEYS, Arm

STATE, ACTION = ["shoulder", "elbow"], ["goal"]
JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def motion_of_arm(seconds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the arm's true state and action at times."""
    return np.stack([np.sin(seconds), 0.5 * seconds - 1], 1), 0.25 * seconds


def table(start: float, end: float, rate: float = 100) -> tuple[np.ndarray, np.ndarray]:
    """Returns times, and the columns of state and action."""
    seconds = np.arange(round(start * rate), round(end * rate)) / rate
    state, action = motion_of_arm(seconds)
    return seconds, np.column_stack([state, action])


def csv(path: Path, seconds: np.ndarray, values: np.ndarray) -> None:
    """Writes a table with a column that is not asked for."""
    lines = [f"{s:.9f},{','.join(f'{v:.9f}' for v in row)},note" for s, row in zip(seconds, values)]
    path.write_text("\n".join(["time,shoulder,elbow,goal,text", *lines, ""]))


def joined(**keys: object) -> str:
    """Returns the two tables of arm.toml."""
    written = {"file": "{name}.csv", "clock": "start", **keys}
    lines = "".join(f"{key} = {str(value).lower() if value is True else repr(value)}\n" for key, value in written.items())
    return f"[state]\n{lines}columns = {STATE}\n[action]\n{lines}columns = {ACTION}\n"


def write_csv(folder: Path, files: list[Path]) -> None:
    """Writes a table for each recording, and the file that joins them."""
    folder.mkdir()
    for file in files:
        csv(folder / f"{file.stem}.csv", *table(-1, 12))
    (folder / "arm.toml").write_text(joined())


def write_mcap(path: Path, nanoseconds: list[int], values: np.ndarray, **change: object) -> None:
    """Writes messages as a robot's recorder does, the joints in another order in each second one; `change` breaks row 5."""
    with open(path, "wb") as opened:
        writer = Writer(opened)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        for row, (at, line) in enumerate(zip(nanoseconds, values), 1):
            step = 1 if row % 2 else -1
            header = {"stamp": {"sec": at // 10**9, "nanosec": at % 10**9}, "frame_id": "base"}
            message = {"header": header, "name": [*STATE, *ACTION][::step], "position": line.tolist()[::step], "velocity": [], "effort": []}
            if row == 5:
                message.update(change)
            writer.write_message("/arm/joint_states", schema, message, log_time=at + 5_000_000)
        writer.finish()


def read(found: Path) -> dict[str, np.ndarray]:
    """Returns the columns of a set."""
    rows = pq.read_table(found / "data")
    return {name: np.array(rows[name].to_pylist()) for name in rows.column_names}


def check_values(found: Path, start: float, within: float, name: str) -> dict[str, np.ndarray]:
    """Compares the arm's columns with the truth; `start` is the arm's time of the first row."""
    rows = read(found)
    state, action = motion_of_arm(rows["tactile.time_s"] + start)
    assert np.abs(rows["observation.state"] - state).max() < within, (name, np.abs(rows["observation.state"] - state).max())
    assert np.abs(rows["action"] - action).max() < within, (name, np.abs(rows["action"] - action).max())
    return rows


def timed(folder: Path) -> Path:
    """Records a slide whose frames come with jitter, by the clock of a driver."""
    path = folder / "timed.mcap"
    scene = wstac.simulate("Saw3@150", size=(400, 400))
    jitter = np.random.default_rng(1).uniform(-0.004, 0.004, len(scene.frames))
    base = time.monotonic_ns() - 8 * 10**9
    with wstac.Pipeline(fps=30, timed=True, record=path, labels={"specimen": "Saw3"}) as pipeline:
        for number, frame in enumerate(scene.frames):
            pipeline.push(frame, base + round((number / 30 + jitter[number]) * 1e9))
    return path


def with_wall_clock(plain: Path, path: Path) -> None:
    """Copies a recording, and adds the wall-clock time that a camera's recording has."""
    with open(plain, "rb") as source, open(path, "wb") as target:
        reader, writer = make_reader(source), McapWriter(target)
        writer.start(profile="", library=reader.get_header().library)
        about = {found.name: found.metadata for found in reader.iter_metadata()}
        for name in ("wstac.stream", "wstac.configuration", "wstac.layout", "wstac.labels"):
            writer.add_metadata(name, about[name])
        channels: dict[str, int] = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            # Sums are those of the messages of the other file.
            if channel.topic == "/sums/json":
                continue
            if channel.topic not in channels:
                made = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, made)
            if not channels.get("/clock/json") and channel.topic == "/camera":
                made = writer.register_schema("wstac.Record", "jsonschema", b"{}")
                channels["/clock/json"] = writer.register_channel("/clock/json", "json", made)
                stamp = datetime.now(timezone.utc).isoformat().replace("+00:00", "000Z")
                line = {"kind": "clock", "time_ns": message.publish_time, "stamp": stamp, "within_ns": 500_000}
                writer.add_message(channels["/clock/json"], message.log_time, json.dumps(line).encode(), message.publish_time)
            writer.add_message(channels[channel.topic], message.log_time, message.data, message.publish_time, message.sequence)
        writer.add_metadata("wstac.end", about["wstac.end"])
        writer.finish()


def check_clocks(folder: Path, run: Callable[..., str]) -> None:
    """Joins by the driver's clock, and by wall-clock time from Parquet and MCAP."""
    file = folder / "wall.mcap"
    with_wall_clock(timed(folder), file)
    frames = list(wstac.open(file).frames())
    driver, wall = frames[0].timestamp, frames[0].stamp.timestamp()
    seconds, values = table(-1, 8)
    here = folder / "clocks"
    here.mkdir()
    csv(here / "wall.csv", seconds + driver, values)
    (here / "driver.toml").write_text(joined(clock="driver"))
    run("dataset", "--lerobot", folder / "by-driver", file, "--arm", here / "driver.toml")
    rows = check_values(folder / "by-driver", 0, 1e-4, "driver")
    assert np.std(np.diff(rows["tactile.time_s"])) > 1e-3, "the light's own times are in the set"

    stamps = pa.array([round((wall + s) * 1e9) for s in seconds], pa.timestamp("ns"))
    columns = {"stamp": stamps, **{name: pa.array(values[:, k]) for k, name in enumerate([*STATE, *ACTION])}}
    pq.write_table(pa.table(columns), here / "timed.parquet")
    (here / "wall.toml").write_text(joined(file="timed.parquet", clock="wall", time="stamp"))
    run("dataset", "--lerobot", folder / "by-wall", file, "--arm", here / "wall.toml")
    check_values(folder / "by-wall", 0, 2e-4, "wall")

    write_mcap(here / "timed.mcap", [round((wall + s) * 1e9) for s in seconds], values)
    for stamp, late in (("header.stamp", 0.0), ("log_time", -0.005)):
        (here / "ros.toml").write_text(joined(file="timed.mcap", clock="wall", topic="/arm/joint_states", time=stamp))
        run("dataset", "--lerobot", folder / f"by-{stamp}", file, "--arm", here / "ros.toml")
        check_values(folder / f"by-{stamp}", late, 2e-4, stamp)
    # All joints, in the order of the first message.
    (here / "ros.toml").write_text("[state]\nfile = 'timed.mcap'\ntopic = '/arm/joint_states'\n")
    run("dataset", "--lerobot", folder / "all", file, "--arm", here / "ros.toml")
    assert read(folder / "all")["observation.state"].shape[1] == 3


def check_join(folder: Path, file: Path, run: Callable[..., str]) -> None:
    """Compares nearest with linear, and cuts what the arm does not cover."""
    here = folder / "join"
    here.mkdir()
    csv(here / f"{file.stem}.csv", *table(-1, 12, 10))
    for join, within, at_least in (("linear", 2e-3, 0.0), ("nearest", 0.06, 0.02)):
        (here / "arm.toml").write_text(joined(join=join, within_ms=60))
        run("dataset", "--lerobot", folder / join, file, "--arm", here / "arm.toml")
        rows = check_values(folder / join, 0, within, join)
        off = np.abs(rows["observation.state"] - motion_of_arm(rows["tactile.time_s"])[0]).max()
        assert off > at_least, (join, off)
    csv(here / f"{file.stem}.csv", *table(1, 3.5))
    (here / "arm.toml").write_text(joined())
    said = run("dataset", "--lerobot", folder / "cut", file, "--arm", here / "arm.toml")
    rows = read(folder / "cut")
    frames = [frame.timestamp for frame in wstac.open(file).frames()]
    kept = [at for at in frames if 0.98 <= at - frames[0] <= 3.51]
    assert len(rows["index"]) == len(kept) and f"{len(frames) - len(kept)} frames before and after" in said, (len(kept), said)
    assert np.allclose(rows["tactile.time_s"], np.array(kept) - kept[0])


def check_limit(folder: Path) -> None:
    """A frame that is just as far from the last row, or from the rows about a gap, as is allowed has values."""
    file = folder / "limit.csv"
    seconds, values = table(0, 4)
    csv(file, *(part[(seconds < 1.985) | (seconds > 2.015)] for part in (seconds, values)))
    for start in (0.0, 1.7e9):
        lines = file.read_text().splitlines()
        moved = [f"{start + float(line.split(',')[0]):.6f},{line.split(',', 1)[1]}" for line in lines[1:]]
        (folder / "moved.csv").write_text("\n".join([lines[0], *moved]))
        arm = Arm({**_KEYS, "file": "moved.csv", "columns": STATE}, folder, "moved")
        for at in (-0.02, 2.0, 4.01):
            assert arm.at(start + at) is not None, (start, at)
        assert arm.at(start - 0.0201) is None and arm.at(start + 4.0101) is None


def check_refused(folder: Path, file: Path, run: Callable[..., str]) -> int:
    """Checks the errors: each names the file, and the row and column where there are some."""
    here = folder / "refused"
    here.mkdir()
    seconds, values = table(-1, 12)
    good = np.flatnonzero((seconds < 2) | (seconds > 2.5))
    csv(here / "gap.csv", seconds[good], values[good])
    csv(here / "late.csv", seconds + 1000, values)
    csv(here / "good.csv", seconds, values)
    csv(here / "none.csv", seconds[:0], values[:0])
    lines = (here / "good.csv").read_text().splitlines()
    (here / "back.csv").write_text("\n".join([*lines[:50], lines[3], *lines[50:]]))
    (here / "nan.csv").write_text("\n".join([*lines[:7], "-0.94,nan,1,2,x", *lines[8:]]))
    (here / "short.csv").write_text("\n".join([*lines[:7], "-0.94,1", *lines[8:]]))
    (here / "empty.csv").write_text("")
    (here / "no.mcap").write_text("no recording")
    (here / "no.parquet").write_text("no table")
    (here / "twice.csv").write_text("\n".join(["time,shoulder,elbow,goal,shoulder", *lines[1:]]))
    (here / "blank.csv").write_text("\n".join([lines[0], "", *lines[1:7], "", "-0.94,nan,1,2,x", *lines[8:]]))
    (here / "forged.csv").write_text("\n".join(["time,\x1b[2J,elbow,goal,text", *lines[1:]]))
    numbers = [float(s) if k != 8 else None for k, s in enumerate(values[:, 0])]
    far = {"time": pa.array([10**18 + k for k in range(len(values))], pa.timestamp("us"))}
    pq.write_table(pa.table({**far, **{name: pa.array(values[:, k]) for k, name in enumerate([*STATE, *ACTION])}}), here / "far.parquet")
    for name, shoulder in (("null", pa.array(numbers)), ("text", pa.array(["a"] * len(values)))):
        of = {"time": pa.array(seconds), "shoulder": shoulder, "elbow": pa.array(values[:, 1]), "goal": pa.array(values[:, 2])}
        pq.write_table(pa.table(of), here / f"{name}.parquet")
    nanoseconds = [round((s + 2) * 1e9) for s in seconds]
    zero = {"header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}}
    for name, change in (("absent", {"name": ["a", "b", "c"]}), ("fewer", {"position": [1.0]}), ("zero", zero)):
        write_mcap(here / f"{name}.mcap", nanoseconds, values, **change)
    write_mcap(here / "twice.mcap", nanoseconds, values, name=["elbow", "elbow", "goal"])
    for name in ("zero.mcap", "null.parquet"):
        whole = bytearray((here / name).read_bytes())
        # The names and sizes at its ends stay.
        whole[64 : len(whole) // 2] = bytes(byte ^ 0xA5 for byte in whole[64 : len(whole) // 2])
        (here / f"damaged.{name.split('.')[1]}").write_bytes(whole)
    ros = {"topic": "/arm/joint_states"}
    refused = [
        ({"file": "gap.csv"}, "gap.csv: row 300 is the nearest to 2.0"),
        ({"file": "late.csv"}, "late.csv (start clock) is from 999.000 s to 1011.990 s, the frames from 0.000 s to"),
        ({"file": "good.csv", "clock": "wall"}, "has no wall-clock times, which the arm needs"),
        ({"file": "good.csv", "clock": "driver"}, "has no times of a driver, which the arm needs"),
        ({"file": "none.csv"}, "none.csv: has no rows"),
        ({"file": "empty.csv"}, "empty.csv: is empty"),
        ({"file": "back.csv"}, "back.csv: row 50: the time goes back from"),
        ({"file": "nan.csv"}, "nan.csv: row 7: column 'shoulder' is 'nan', expected a number"),
        ({"file": "blank.csv"}, "blank.csv: row 7: column 'shoulder' is 'nan', expected a number"),
        ({"file": "twice.csv"}, "twice.csv: has 2 columns 'shoulder', expected names that differ"),
        ({"file": "forged.csv"}, "forged.csv: has no column 'shoulder', expected one of time, \\u001b[2J, elbow"),
        ({"file": "far.parquet", "time": "time"}, "far.parquet (start clock) is from 1000000000000.000 s"),
        ({"file": "damaged.parquet"}, "damaged.parquet: is no Parquet, or is damaged ("),
        ({"file": "damaged.mcap", **ros}, "damaged.mcap: is no MCAP with messages of ROS 2, or is damaged ("),
        ({"file": "twice.mcap", **ros}, "twice.mcap: row 5: name has elbow, elbow, goal, expected names that differ"),
        ({"file": "short.csv"}, "short.csv: row 7: column 'elbow' is '', expected a number"),
        ({"file": "there-is-none.csv"}, "there-is-none.csv: no such file"),
        ({"file": "good.csv", "time": "t"}, "good.csv: has no column 't', expected one of time, shoulder, elbow, goal, text"),
        ({"file": "null.parquet"}, "null.parquet: row 9: column 'shoulder' is"),
        ({"file": "text.parquet"}, "text.parquet: column 'shoulder' has the type string"),
        ({"file": "no.parquet"}, "no.parquet: is no Parquet"),
        ({"file": "no.mcap"}, "no.mcap: is no MCAP"),
        ({"file": "absent.mcap"}, "absent.mcap: has no topic '/joint_states', expected one of /arm/joint_states"),
        ({"file": "absent.mcap", **ros}, "absent.mcap: row 5: has no joint 'shoulder', expected one of a, b, c"),
        ({"file": "fewer.mcap", **ros}, "fewer.mcap: row 5: position has 1 values, expected 3"),
        ({"file": "zero.mcap", **ros}, "zero.mcap: row 5: header.stamp is 0"),
        ({"file": "arm.txt"}, "arm.txt: ends in '.txt', expected .csv, .parquet or .mcap"),
        ({"clok": "wall"}, "[state]: unknown key 'clok', expected one of file, topic"),
        ({"clock": "utc"}, "[state] clock is 'utc', expected one of wall, driver, start"),
        ({"within_ms": 0}, "[state] within_ms is 0, expected a number of milliseconds above 0"),
    ]
    for keys, said in refused:
        (here / "arm.toml").write_text(joined(**keys))
        found = run("dataset", "--lerobot", folder / "new", file, "--arm", here / "arm.toml", fails=True)
        assert said in found and "\x1b" not in found and "Traceback" not in found, (keys, found)
    for text, said in (("", "has [], expected the tables [state] and [action]"), ("[state]\nclock = 'start'", 'no key "file"'), ("[", "arm.toml: ")):
        (here / "arm.toml").write_text(text)
        assert said in run("dataset", "--lerobot", folder / "new", file, "--arm", here / "arm.toml", fails=True), text
    return len(refused) + 3


def check_arms(folder: Path, files: list[Path], run: Callable[..., str]) -> None:
    """Checks all of it."""
    check_clocks(folder, run)
    check_join(folder, files[1], run)
    check_limit(folder)
    count = check_refused(folder, files[1], run)
    print(f"arms: by three clocks, from CSV, Parquet and MCAP; {count} mistakes are refused")

"""Checks wstac.lerobot: the files of a set are those that LeRobot v3.0 publishes, what is in them is what the recordings
have, Hugging Face's `datasets` reads them, the video shows the frames, and the arm is joined by time. The camera runs on
LeRobot's own base class.

    check.py WSTAC    the command
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from importlib.metadata import distributions
from pathlib import Path
from unittest import mock

CAMERA_PACKAGE = Path(__file__).resolve().parents[2] / "wstac-python/lerobot_camera_wstac"
# All that LeRobot asks for is 8 GB, and its cameras need none of it. A copy is built: pip writes into the folder.
with tempfile.TemporaryDirectory() as copy:
    shutil.copytree(CAMERA_PACKAGE, copy, dirs_exist_ok=True)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, "--no-deps", "--force-reinstall", "lerobot==0.4.4", copy], check=True)
os.environ["HF_HUB_OFFLINE"] = "1"
import datasets  # noqa: E402
import numpy as np  # noqa: E402
import pandas  # noqa: E402
import pyarrow as pa  # noqa: E402
import pyarrow.parquet as pq  # noqa: E402
import wstac  # noqa: E402
import wstac._video  # noqa: E402
import wstac.lerobot  # noqa: E402
from lerobot.cameras.utils import make_cameras_from_configs  # noqa: E402
from lerobot_camera_wstac import WstacCameraConfig  # noqa: E402

from arms import check_arms, motion_of_arm, write_csv  # noqa: E402

WSTAC = Path(sys.argv[1]).resolve()
PICTURE = "observation.images.tactile"
# lerobot/datasets/utils.py, class DatasetInfo, at version 0.6.2.
INFO = {
    "codebase_version", "fps", "features", "total_episodes", "total_frames", "total_tasks", "chunks_size", "data_files_size_in_mb",
    "video_files_size_in_mb", "data_path", "video_path", "robot_type", "splits",
}  # fmt: skip
# lerobot/utils/constants.py, DEFAULT_FEATURES.
DEFAULTS = {"timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64", "task_index": "int64"}
# The episodes of lerobot/datasets/dataset_writer.py and dataset_metadata.py.
EPISODE = {
    "episode_index", "tasks", "length", "data/chunk_index", "data/file_index", "dataset_from_index", "dataset_to_index",
    "meta/episodes/chunk_index", "meta/episodes/file_index", *(f"videos/{PICTURE}/{key}" for key in ("chunk_index", "file_index", "from_timestamp", "to_timestamp")),
}  # fmt: skip
STATS = {"min", "max", "mean", "std", "count", "q01", "q10", "q50", "q90", "q99"}
# Levels of 255 by which a picture may be off on average, and one pixel at most, after H.264.
MEAN_OFF, MOST_OFF = 0.5, 12

CAMERA = "[sensor]\nsize = [400, 400]\n"
SCENES = {
    "a": ('specimen = "Saw3"\nspeed = 150\ndirection = 30\nseed = 5\n' + CAMERA + "dropped = 0.03\n", ["specimen=Saw3"]),
    "b": ('specimen = "Fla0"\nspeed = 80\nseed = 2\n' + CAMERA, ["task=wipe the table", "specimen=Fla0"]),
    "c": ('[[touch]]\nkind = "slide"\nspecimen = "Sin2"\nhold = 1\nspeed = 60\n' + CAMERA, []),
}


def run(*arguments: object, fails: bool = False) -> str:
    """Runs the command, and returns what it says."""
    environment = os.environ | {"WSTAC_PYTHON": sys.executable}
    done = subprocess.run([WSTAC, *map(str, arguments)], capture_output=True, text=True, env=environment, check=False)
    assert (done.returncode != 0) == fails, (arguments, done.returncode, done.stderr)
    return done.stderr


def record(folder: Path) -> list[Path]:
    """Records the scenes."""
    (folder / "slides").mkdir()
    for name, (scene, labels) in SCENES.items():
        (folder / f"{name}.toml").write_text(scene)
        options = [option for label in labels for option in ("--label", label)]
        run("record", f"scene:{folder / name}.toml", "-o", folder / f"slides/{name}.mcap", *options)
    return sorted((folder / "slides").iterdir())


def check_layout(found: Path) -> tuple[dict, pa.Table, pa.Table]:
    """Compares the files with the published layout. Returns the description, the rows and the episodes."""
    files = sorted(str(file.relative_to(found)) for file in found.rglob("*") if file.is_file())
    data, video = "data/chunk-000/file-000.parquet", f"videos/{PICTURE}/chunk-000/file-000.mp4"
    assert files == [data, "meta/episodes/chunk-000/file-000.parquet", "meta/info.json", "meta/stats.json", "meta/tasks.parquet", video], files
    info = json.loads((found / "meta/info.json").read_text())
    assert set(info) == INFO and info["codebase_version"] == "v3.0" and info["fps"] == 30, info
    assert info["data_path"].format(chunk_index=0, file_index=0) == data
    assert info["video_path"].format(video_key=PICTURE, chunk_index=0, file_index=0) == video
    rows = pq.read_table(found / data)
    features = info["features"]
    assert set(rows.column_names) == set(features) - {PICTURE}
    assert {key: features[key]["dtype"] for key in DEFAULTS} == DEFAULTS
    for key in rows.column_names:
        kind = rows.schema.field(key).type
        value = {"float32": pa.float32(), "float64": pa.float64(), "int64": pa.int64(), "bool": pa.bool_()}[features[key]["dtype"]]
        width = features[key]["shape"][0]
        assert kind == (value if width == 1 else pa.list_(value, width)), (key, kind)
        names = features[key]["names"]
        assert names is None or len(names) == width, (key, names)
    shape = features[PICTURE]
    assert shape["dtype"] == "video" and shape["shape"] == [400, 400, 3] and shape["names"] == ["height", "width", "channels"], shape
    # A row group for each episode.
    assert pq.ParquetFile(found / data).num_row_groups == len(SCENES)
    episodes = pq.read_table(found / "meta/episodes/chunk-000/file-000.parquet")
    own = {"wstac/source", "wstac/lost_frames", "wstac/start_ns"}
    expected = {f"stats/{key}/{name}" for key in features for name in STATS}
    assert set(episodes.column_names) == EPISODE | own | expected, set(episodes.column_names) ^ (EPISODE | own | expected)
    # As lerobot/datasets/io_utils.py, load_tasks, and dataset_reader.py, get_item, read it.
    tasks = pandas.read_parquet(found / "meta/tasks.parquet")
    assert list(tasks.index) == ["touch Saw3", "wipe the table", "touch"] and list(tasks["task_index"]) == [0, 1, 2], tasks
    assert tasks.iloc[1].name == "wipe the table"
    return info, rows, episodes


def columns(rows: pa.Table) -> dict[str, np.ndarray]:
    """Returns the columns as arrays (n,) or (n, k)."""
    return {name: np.array(rows[name].to_pylist()) for name in rows.column_names}


def check_rows(found: Path, files: list[Path], rows: pa.Table, episodes: pa.Table) -> dict[str, np.ndarray]:
    """Compares the rows with what wstac.read and wstac.open say of the recordings."""
    all_rows, listed, first = columns(rows), episodes.to_pylist(), 0
    slips = motions = lost = 0
    for number, (file, episode) in enumerate(zip(files, listed)):
        recording = wstac.read(file)
        n = len(recording.frame_numbers)
        of = {key: values[first : first + n] for key, values in all_rows.items()}
        assert (episode["length"], episode["dataset_from_index"], episode["dataset_to_index"]) == (n, first, first + n)
        assert (of["episode_index"] == number).all() and (of["task_index"] == number).all()
        assert (of["index"] == np.arange(first, first + n)).all() and (of["frame_index"] == np.arange(n)).all()
        assert np.allclose(of["timestamp"], np.arange(n) / 30, atol=1e-5)
        place = f"videos/{PICTURE}"
        assert math.isclose(episode[f"{place}/from_timestamp"], first / 30) and math.isclose(episode[f"{place}/to_timestamp"], (first + n) / 30)
        assert np.array_equal(of["observation.tactile.taxels"].astype("f4").reshape(-1, 5, 5), recording.taxels)
        at = {int(frame): row for frame, row in zip(recording.feature_frames, recording.features)}
        assert np.array_equal(of["observation.tactile.features"] * 2048, np.array([at[int(k)] for k in recording.frame_numbers]))
        # The time of the light, in which lost frames are a gap, and their number.
        assert np.allclose(of["tactile.time_s"], recording.timestamps - recording.timestamps[0], atol=1e-9)
        assert np.array_equal(of["tactile.lost"], np.diff(recording.frame_numbers, prepend=-1) - 1)
        assert of["tactile.lost"].sum() == recording.end.dropped == episode["wstac/lost_frames"]
        lost += recording.end.dropped
        stream = wstac.open(file, motion=True)
        list(stream)
        known = {motion.frame: motion for motion in stream.motions if motion.direction.deg is not None}
        has = of["observation.tactile.motion_known"]
        assert np.array_equal(np.isfinite(of["observation.tactile.motion"].astype(float)).all(axis=1), has)
        assert np.array_equal(np.isnan(of["observation.tactile.motion"].astype(float)).all(axis=1), ~has)
        assert [int(k) for k in recording.frame_numbers[has]] == sorted(known), (file, sorted(known))
        for frame, (x, y) in zip(recording.frame_numbers[has], of["observation.tactile.motion"][has]):
            motion = known[int(frame)]
            assert math.isclose(math.hypot(x, y), motion.speed.mm_s, rel_tol=1e-5)
            assert abs((math.degrees(math.atan2(y, x)) - motion.direction.deg + 180) % 360 - 180) < 1e-3
        assert [int(k) for k in recording.frame_numbers[of["observation.tactile.slip"]]] == [slip.frame for slip in recording.slips]
        slips, motions, first = slips + len(recording.slips), motions + len(known), first + n
    assert slips == 1 and motions >= 15 and lost >= 3 and first == rows.num_rows, (slips, motions, lost, first)
    print(f"rows: {first} of {len(files)} episodes, {motions} with a motion, {slips} with a slip, {lost} frames lost")
    return all_rows


def check_stats(found: Path, all_rows: dict[str, np.ndarray], episodes: pa.Table, pictures: np.ndarray) -> None:
    """Compares the statistics with those of numpy."""
    stats = json.loads((found / "meta/stats.json").read_text(), parse_constant=lambda name: sys.exit(f"stats.json has {name}"))
    for key, values in all_rows.items():
        values = values.reshape(len(values), -1).astype(float)
        values = values[np.isfinite(values).all(axis=1)]
        assert set(stats[key]) == STATS and stats[key]["count"] == [len(values)], (key, stats[key])
        for name in ("min", "max", "mean", "std"):
            assert np.allclose(stats[key][name], getattr(values, name)(0), rtol=1e-5, atol=1e-7), (key, name)
    for of in [stats[PICTURE], *({name: episode[f"stats/{PICTURE}/{name}"] for name in STATS} for episode in episodes.to_pylist())]:
        assert all(np.shape(of[name]) == (3, 1, 1) for name in STATS - {"count"}), of
    # Of up to 100 pictures of each episode, all over it, with fewer pixels.
    means = []
    for episode in episodes.to_pylist():
        first, n = episode["dataset_from_index"], episode["length"]
        means.append(pictures[first + np.linspace(0, n - 1, min(n, 100)).round().astype(int)].mean() / 255)
        assert np.allclose(episode[f"stats/{PICTURE}/mean"], means[-1], rtol=0.05), (episode[f"stats/{PICTURE}/mean"], means[-1])
    assert np.allclose(stats[PICTURE]["mean"], np.mean(means), rtol=0.05), (stats[PICTURE]["mean"], means)


def check_video(found: Path, files: list[Path]) -> np.ndarray:
    """Compares the decoded video with the frames. Returns the decoded pictures."""
    video = found / f"videos/{PICTURE}/chunk-000/file-000.mp4"
    command = ["ffmpeg", "-v", "error", "-i", video, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    decoded = np.frombuffer(subprocess.run(command, check=True, capture_output=True).stdout, np.uint8).reshape(-1, 400, 400, 3)
    frames = np.concatenate([wstac.read(file).frames for file in files])
    assert len(decoded) == len(frames), (len(decoded), len(frames))
    off = np.abs(decoded.astype(int) - frames[..., None])
    assert off.mean() < MEAN_OFF and off.max() <= MOST_OFF, (off.mean(), off.max())
    # Another frame is farther away: the order counts.
    bright = int(frames.reshape(len(frames), -1).sum(1).argmax())
    other = np.abs(decoded[bright].astype(int) - frames[bright + 3][..., None]).mean()
    assert other > 2 * off[bright].mean(), (other, off[bright].mean())
    probe = ["ffprobe", "-v", "error", "-show_entries", "packet=pts_time,flags", "-of", "csv=p=0", video]
    packets = [line.split(",")[:2] for line in subprocess.run(probe, check=True, capture_output=True, text=True).stdout.split()]
    # LeRobot's reader allows 0.1 ms.
    assert all(abs(float(pts) - k / 30) < 1e-4 for k, (pts, _) in enumerate(packets)), packets[:5]
    assert sum("K" in flags for _, flags in packets) >= len(packets) // 2, packets[:5]
    print(f"video: {len(decoded)} pictures, off by {off.mean():.3f} of 255 on average and {off.max()} at most")
    return decoded


def check_datasets(found: Path, info: dict, rows: pa.Table) -> None:
    """Reads the rows with Hugging Face's datasets, by themselves, and with the features that LeRobot makes of info.json."""
    files = str(found / "data/*/*.parquet")
    loaded = datasets.load_dataset("parquet", data_files=files, split="train", cache_dir=str(found.parent / "cache"))
    assert len(loaded) == rows.num_rows and loaded.features["observation.tactile.taxels"].length == 25, loaded.features
    # lerobot/datasets/feature_utils.py, get_hf_features_from_features.
    features = datasets.Features({
        key: datasets.Value(of["dtype"]) if of["shape"] == [1] else datasets.Sequence(datasets.Value(of["dtype"]), length=of["shape"][0])
        for key, of in info["features"].items() if of["dtype"] != "video"
    })  # fmt: skip
    paths = [str(file) for file in sorted((found / "data").glob("*/*.parquet"))]
    cast = datasets.Dataset.from_parquet(paths, features=features, cache_dir=str(found.parent / "cache"))
    last = cast.with_format("numpy")[-1]
    assert last["observation.tactile.taxels"].shape == (25,) and int(last["index"]) == rows.num_rows - 1, last
    listed = datasets.Dataset.from_parquet(str(found / "meta/episodes/chunk-000/file-000.parquet"), cache_dir=str(found.parent / "cache"))
    assert listed["length"][0] > 0 and listed["tasks"][1] == ["wipe the table"]
    print(f"datasets {datasets.__version__}: {len(loaded)} rows")


def check_rate(folder: Path) -> None:
    """At 60 frames per second, each second frame completes features, which the row behind it repeats."""
    run("record", "scene:Saw3@150", "--fps", "60", "--size", "400x400", "-o", folder / "60.mcap")
    run("dataset", "--lerobot", folder / "fast", folder / "60.mcap")
    rows = columns(pq.read_table(folder / "fast/data"))
    features, known = rows["observation.tactile.features"].astype(float), rows["observation.tactile.motion_known"]
    assert np.isnan(features[0]).all() and np.isfinite(features[1:]).all() and known.any(), features[:3]
    at = {int(frame): row for frame, row in enumerate(wstac.read(folder / "60.mcap").features)}
    assert all(np.array_equal(features[k] * 2048, at[(k - 1) // 2]) for k in range(1, len(features))), features.shape
    # As long as the next is not known.
    assert np.array_equal(known[1:-1:2], known[2::2][: len(known[1:-1:2])]), known
    info = json.loads((folder / "fast/meta/info.json").read_text())
    assert info["fps"] == 60, info


def check_stopped(folder: Path) -> None:
    """A signal leaves no folder, nor does a full disk, and a video that is cut is found."""
    code = "import sys, wstac.lerobot; sys.exit(wstac.lerobot.main(sys.argv[1:]))"
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        command = [sys.executable, "-c", code, folder / "stopped", "scene:Saw3@150"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            while not list(folder.glob(".stopped.*/set/videos")):
                assert process.poll() is None, process.stderr.read()
                time.sleep(0.01)
            process.send_signal(number)
            assert process.wait(30) == 128 + number, (number, process.stderr.read())
        assert not list(folder.glob("*stopped*")) and not list(folder.glob(".stopped*")), number

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with mock.patch.multiple(wstac.lerobot.pq.ParquetWriter, write_table=full, close=full):
        try:
            wstac.lerobot.write(folder / "full", ["scene:Saw3@150"], size=(96, 64))
            raise AssertionError("a full disk is written to")
        except OSError as error:
            assert error.errno == 28, error
    assert not list(folder.glob("*full*")) and not list(folder.glob(".full*"))
    video = wstac._video.Video(folder, 30, (96, 64))
    whole = next((folder / "small/videos").rglob("*.mp4"))
    for length, said in ((10**4, "ends at frame "), (1, "has more frames than its episodes")):
        try:
            list(video.sampled([length], whole))
            raise AssertionError(f"a video of {length} frames")
        except wstac.Error as error:
            assert said in str(error), error


def check_others(folder: Path, files: list[Path]) -> None:
    """Checks sets without pictures, with scaled ones, of scenes, and what is refused."""
    run("record", f"scene:{folder}/b.toml", "-o", folder / "sums.mcap", "--features-only")
    run("dataset", "--lerobot", folder / "sums", folder / "sums.mcap")
    info = json.loads((folder / "sums/meta/info.json").read_text())
    assert info["video_path"] is None and PICTURE not in info["features"] and not (folder / "sums/videos").exists()
    run("dataset", "--lerobot", folder / "small", "scene:Saw3@150", "--size", "96x64", "--task", "feel")
    info = json.loads((folder / "small/meta/info.json").read_text())
    assert info["features"][PICTURE]["shape"] == [64, 96, 3], info["features"][PICTURE]
    assert pandas.read_parquet(folder / "small/meta/tasks.parquet").index[0] == "feel"
    # A motion that is never known has no statistics, and no number that stands for it.
    quiet = folder / "quiet.toml"
    quiet.write_text('[[touch]]\nkind = "press"\n' + CAMERA)
    run("dataset", "--lerobot", folder / "quiet", f"scene:{quiet}")
    assert "observation.tactile.motion" not in json.loads((folder / "quiet/meta/stats.json").read_text())
    assert np.isnan(columns(pq.read_table(folder / "quiet/data"))["observation.tactile.motion"]).all()
    new, [a, b, _] = folder / "new", files
    check_rate(folder)
    (folder / "plain").mkdir()
    assert (folder / "small").stat().st_mode == (folder / "plain").stat().st_mode, oct((folder / "small").stat().st_mode)
    check_stopped(folder)
    (folder / "bad.mcap").write_text("no recording")
    (folder / "empty").mkdir()
    refused = [
        (["--lerobot", folder / "small", a], "small: exists"),
        (["--lerobot", new, folder / "none.mcap"], "none.mcap"),
        (["--lerobot", new, a, folder / "bad.mcap"], "bad.mcap"),
        (["--lerobot", new, folder / "empty"], "empty: has no recordings"),
        (["--lerobot", new], "--lerobot: has no recordings"),
        (["--lerobot", new, a, "--size", "33x20"], "size is 33x20, expected even numbers"),
        (["--lerobot", new, a, "--size", "big"], "--size is 'big'"),
        (["--lerobot", new, a, folder / "sums.mcap"], "sums.mcap: has no pictures"),
        (["--lerobot", new, a, "scene:Saw3@150"], "frames of 1280x720, expected those of the first episode"),
        (["--lerobot", new, a, "--units", "0..1"], "cannot be used with"),
        ([a, "-o", folder / "a.npz", "--arm", "arm.toml"], "cannot be used with '--arm"),
    ]
    for arguments, said in refused:
        found = run("dataset", *arguments, fails=True)
        assert said in found, (arguments, found)
        assert "Traceback" not in found, found
        assert not list(folder.glob("*new*")) and not list(folder.glob(".new*")), list(folder.iterdir())
    for size in ("33x20", "big"):
        assert wstac.lerobot.main(["--size", size, str(new), str(a)]) == 2, size
    environment = os.environ | {"WSTAC_PYTHON": sys.executable, "PATH": "/nowhere"}
    done = subprocess.run([WSTAC, "dataset", "--lerobot", new, a], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 1 and "ffmpeg is not installed" in done.stderr, done
    environment["WSTAC_PYTHON"] = "/nowhere/python3"
    done = subprocess.run([WSTAC, "dataset", "--lerobot", new, a], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 2 and "help: install the wheel with [lerobot]" in done.stderr, done
    print(f"refused: {len(refused) + 2} mistakes")


def check_camera() -> None:
    """Runs the camera as LeRobot makes it."""
    # LeRobot imports what has such a name.
    assert "lerobot_camera_wstac" in {found.metadata["Name"] for found in distributions()}
    shown = {}
    for show in ("picture", "taxels"):
        config = WstacCameraConfig(source="scene:Saw3@150", show=show)
        assert config.type == "wstac"
        [camera] = make_cameras_from_configs({"tactile": config}).values()
        with camera:
            assert camera.is_connected and camera.fps == 30
            before, shown[show] = None, []
            for _ in range(70):
                frame = camera.async_read(2000)
                assert frame.dtype == np.uint8 and frame.shape == (camera.height, camera.width, 3) and frame is not before
                shown[show].append(frame)
                before = frame
            assert camera.read_latest(2000) is not None
        assert not camera.is_connected
    assert shown["picture"][0].shape == (720, 1280, 3) and shown["taxels"][0].shape == (80, 80, 3)
    # The slide lights up both.
    assert all(max(frame.max() for frame in frames) > 2 * frames[0].max() for frames in shown.values())
    camera = make_cameras_from_configs({"tactile": WstacCameraConfig(source="scene:Saw3@150", show="taxels")})["tactile"]
    # Connected again, it is new: the end of before is not its own.
    for _ in range(3):
        camera.connect()
        assert camera.async_read(2000) is not None
        time.sleep(0.1)
        assert camera.async_read(2000) is not None
        camera.disconnect()
    camera.connect()
    try:
        camera.connect()
        raise AssertionError("a camera is connected twice")
    except ConnectionError as error:
        assert "is connected" in str(error), error
    with mock.patch.object(camera, "async_read", side_effect=TimeoutError), contextlib.suppress(TimeoutError):
        camera.disconnect()
        camera.connect()
    assert not camera.is_connected
    camera.connect()
    time.sleep(6)
    try:
        camera.async_read(10), camera.async_read(10)
        raise AssertionError("an ended source gave a frame")
    except RuntimeError as error:
        assert "has ended" in str(error), error
    print("camera: 140 frames through LeRobot's base class")


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = record(folder)
        write_csv(folder / "arms", files)
        said = run("dataset", "--lerobot", folder / "set", folder / "slides", "--arm", folder / "arms/arm.toml")
        assert "frames were lost and have no row" in said and "3 episodes" in said, said
        info, rows, episodes = check_layout(folder / "set")
        all_rows = check_rows(folder / "set", files, rows, episodes)
        for key, names in (("observation.state", ["shoulder", "elbow"]), ("action", ["goal"])):
            assert info["features"][key]["names"] == names, info["features"][key]
            assert np.allclose(all_rows[key], motion_of_arm(all_rows["tactile.time_s"])[names[0] == "goal"], atol=1e-4), key
        check_stats(folder / "set", all_rows, episodes, check_video(folder / "set", files))
        check_datasets(folder / "set", info, rows)
        check_arms(folder, files, run)
        check_others(folder, files)
    check_camera()
    print("lerobot: a set of LeRobot v3.0 has what the recordings have")


if __name__ == "__main__":
    main()

"""Counts what a firmware of any settings takes on emulated boards, whose events and features must be the host's."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import boards
from boards import BOARDS
from host import features, host, same

SCENE = Path(__file__).with_name("clip.toml")
# What WSTAC_PIXELS calls a format, and V4L2, as scenes do.
FORMATS = {"GREY": "GREY", "Y16": "Y16", "RGB24": "RGB3", "RGB565": "RGBP", "BAYER8": "RGGB", "YUYV": "YUYV"}
CORES = tuple(board.core for board in BOARDS)


@dataclass(frozen=True)
class Setting:
    """What is built: a name of `formats()`, a stride, a logarithm, a model's file."""

    format: str = "GREY"
    stride: int = 1
    ln: str = "fixed"
    model: Path | None = None

    def toml(self):
        yuv = self.format.partition(" ")[2] or "exact"
        return f'[green]\nstride = {self.stride}\nyuv = "{yuv}"\n[features]\nln = "{self.ln}"\n'


def formats():
    """Formats, and of YUYV both ways to green."""
    for pixels in FORMATS:
        yield from ([f"{pixels} exact", f"{pixels} linear"] if pixels == "YUYV" else [pixels])


class Counter:
    """Builds, runs and counts; frames are rendered once a format."""

    def __init__(self, wstac, folder, debug=False):
        self.wstac, self.folder, self.debug = Path(wstac).resolve(), Path(folder), debug
        self.expected = cache(self.expected)

    def scene(self, pixels, frames):
        """A scene of a format with the arguments that end it after so many frames, and the folder of its frames."""
        place = self.folder / f"{pixels} {frames}"
        scene = place / "clip.toml"
        asked = [f"scene:{scene}", *([] if frames is None else ["--frames", str(frames)])]
        if not place.exists():
            place.mkdir()
            text = SCENE.read_text()
            scene.write_text(text.replace("[sensor]\n", f'[sensor]\nformat = "{FORMATS[pixels]}"\n'))
            host(self.wstac, "run", *asked, "--save-raw", place / "frames")
        return asked, place

    def expected(self, pixels, toml, model, frames):
        """The events and features that the host prints of a scene."""
        asked, place = self.scene(pixels, frames)
        (place / "host.toml").write_text(toml)
        asked += [] if model is None else ["--model", model]
        lines = host(self.wstac, "run", *asked, "--json", "--features", "--config", place / "host.toml")
        numbers = [record["f"] for record in map(json.loads, lines) if record["kind"] == "features"]
        return [line for line in lines if '"kind":"features"' not in line], numbers

    def count(self, board, programs, pixels, toml, model, frames):
        """What one board takes for what is built."""
        _, place = self.scene(pixels, frames)
        events, numbers = self.expected(pixels, toml, model, frames)
        own = place / board.core
        own.mkdir(exist_ok=True)
        if not (own / "frames").exists():
            (own / "frames").symlink_to(place / "frames")
        what = f"{pixels}, {toml!r}, {model}"
        boards.run(board, programs / "emulated", own, "file:serial")
        stack = int.from_bytes((own / "stack").read_bytes(), "little")
        same(board, f"events of {what}", host(self.wstac, "monitor", own / "serial", "--json"), events)
        said = json.loads(boards.run(board, programs / "cost", own))
        same(board, f"features of {what}", features(own), numbers)
        size = boards.sizes(programs / "emulated")
        whole = {"frame": said["stripes"], "event": said["texture"], "flash": size.flash, "ram": size.ram + stack}
        return whole | {key: said[key] for key in ("trigger", "speed", "direction")}

    def build(self, target, pixels, toml, model):
        """The programs of a configuration, valid until the next one's."""
        config = self.folder / f"{target}.toml"
        config.write_text(toml)
        programs = ("--bin", "cost", "--bin", "emulated")
        return boards.build(target, *programs, model=model, config=config, pixels=pixels, debug=self.debug)

    def setting(self, setting, frames=None, every_board=False, cores=CORES):
        """What these cores take for a setting. The Cortex-M7 runs the M4F's program, and is asked where every board is."""
        pixels = setting.format.partition(" ")[0]
        what = (pixels, setting.toml(), setting.model)
        self.expected(*what, frames)

        def of_target(target):
            programs = self.build(target, *what)
            on = [board for board in BOARDS if board.target == target and board.core in cores]
            counts = [self.count(board, programs, *what, frames) for board in (on if every_board else on[:1])]
            return {board.core: counts[min(i, len(counts) - 1)] for i, board in enumerate(on)}

        with ThreadPoolExecutor() as pool:
            return {core: count for counts in pool.map(of_target, {board.target for board in BOARDS if board.core in cores}) for core, count in counts.items()}

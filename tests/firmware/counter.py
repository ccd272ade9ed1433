"""Counts the cost of a firmware with any settings on emulated boards. Its events and features must be the host's."""

import json
import struct
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import boards
from boards import BOARDS, TARGETS, Board
from host import features, host, on_board, same

SCENE = Path(__file__).with_name("clip.toml")
# A slide with every specimen, as taxel sums.
SLIDES = Path(__file__).with_name("slides.toml")
# The name of a format in WSTAC_PIXELS, and in V4L2 and scenes.
FORMATS = {"GREY": "GREY", "Y16": "Y16", "RGB24": "RGB3", "RGB565": "RGBP", "BAYER8": "RGGB", "YUYV": "YUYV"}
# The scene's first event has ended by then.
FRAMES = 110
# A little light is left in the dark, so that no format's sums are 0: the logarithm of 0 is skipped, and would cost
# nothing.
DARK = "black_level = 2.0\nread_noise = 100"
CORES = tuple(board.core for board in BOARDS)

# A Cortex-M3 counts a Cortex-M0's code by a wave: the counter takes more than the 16 KiB of a microbit.
ROOMY = Board("M0", "mps2-an385", TARGETS[0])


@dataclass(frozen=True)
class Setting:
    """A build: a name of `formats()`, a stride, a logarithm, a model's file, and a key of `[speed]`."""

    format: str = "GREY"
    stride: int = 1
    ln: str = "fixed"
    model: Path | None = None
    law: str = 'estimator = "coherence"'

    def toml(self):
        yuv = self.format.partition(" ")[2] or "exact"
        return f'[green]\nstride = {self.stride}\nyuv = "{yuv}"\n[features]\nln = "{self.ln}"\n[speed]\n{self.law}\n'


def law_of(toml):
    """Returns the name of a configuration's law."""
    speed = tomllib.loads(toml).get("speed", {})
    return speed.get("estimator", "wave") if speed.get("law", "arrival") == "arrival" else "published"


def over_time(model):
    """Returns whether a model's file takes the sample over time, and not along the path."""
    return model is None or Path(model).read_bytes()[30] == 0


def formats():
    """Returns the formats, and both methods to green for YUYV."""
    for pixels in FORMATS:
        yield from ([f"{pixels} exact", f"{pixels} linear"] if pixels == "YUYV" else [pixels])


def write_samples(wstac, file):
    """Writes the samples of ten slides, frame by frame. Models classify them while instructions are counted, whatever
    the camera's format.
    """
    events = map(json.loads, host(wstac, "run", f"scene:{SLIDES}", "--json", "--samples"))
    samples = [event["sample"] for event in events if event["kind"] == "event"]
    numbers = [round(2048 * line[frame]) for sample in samples for frame in range(len(sample[0])) for line in sample]
    Path(file).write_bytes(struct.pack(f"<{len(numbers)}h", *numbers))


class Counter:
    """Builds, runs and counts. Frames are rendered once per format."""

    def __init__(self, wstac, folder, debug=False):
        self.wstac, self.folder, self.debug = Path(wstac).resolve(), Path(folder), debug
        self.expected = cache(self.expected)
        write_samples(wstac, self.folder / "samples")

    def scene(self, pixels):
        """Returns the host's name of a format's scene, and the folder of its frames."""
        place = self.folder / pixels
        scene = place / "clip.toml"
        asked = [f"scene:{scene}", "--frames", str(FRAMES)]
        if not place.exists():
            place.mkdir()
            text = SCENE.read_text().replace("[sensor]\n", f'[sensor]\nformat = "{FORMATS[pixels]}"\n{DARK}\n')
            scene.write_text(text)
            host(self.wstac, "run", *asked, "--save-raw", place / "frames")
        return asked, place

    def expected(self, pixels, toml, model):
        """Returns the events and features that the host prints for a scene."""
        asked, place = self.scene(pixels)
        (place / "host.toml").write_text(toml)
        asked += ["--model", "none" if model is None else model]
        lines = host(self.wstac, "run", *asked, "--json", "--features", "--config", place / "host.toml")
        numbers = [record["f"] for record in map(json.loads, lines) if record["kind"] == "features"]
        if not any('"kind":"event"' in line for line in lines):
            sys.exit(f"{pixels}, {toml!r}: the host sees no event, which says little about a board")
        return [line for line in lines if '"kind":"features"' not in line], numbers

    def count(self, board, programs, pixels, toml, model):
        """Returns the cost of a build on one board."""
        board = ROOMY if board.core == ROOMY.core and law_of(toml) == "wave" else board
        _, place = self.scene(pixels)
        events, numbers = self.expected(pixels, toml, model)
        own = place / board.core
        own.mkdir(exist_ok=True)
        for name, there in ("frames", place / "frames"), ("samples", self.folder / "samples"):
            if not (own / name).exists():
                (own / name).symlink_to(there)
        what = f"{pixels}, {toml!r}, {model}"
        stack = on_board(board, programs / "emulated", own, self.wstac, f"events of {what}", events)
        said = json.loads(boards.run(board, programs / "cost", own))
        same(board, f"features of {what}", features(own), numbers)
        size = boards.sizes(programs / "emulated")
        # The sample along the path is a part of the answer's cost.
        answer = said["answer" if over_time(model) else "texture"]
        whole = {"frame": said["stripes"], "event": answer, "flash": size.flash, "ram": size.ram + stack}
        laws = {"wave": said["wave"], "coherence": said["motion"], "edges": said["edges"], "published": said["speed"] + said["direction"]}
        return whole | {"trigger": said["trigger"], "laws": laws}

    def build(self, target, pixels, toml, model):
        """Returns the programs of a configuration, valid until the next one's."""
        config = self.folder / f"{target}.toml"
        config.write_text(toml)
        programs = ("--bin", "cost", "--bin", "emulated")
        # A build takes minutes.
        print(f"builds cost and emulated for {target}: {pixels}, {model.name if model else 'no model'}", file=sys.stderr, flush=True)
        named = {"features": "mps2"} if target == ROOMY.target and law_of(toml) == "wave" else {}
        return boards.build(target, *programs, model=model, config=config, pixels=pixels, debug=self.debug, **named)

    def setting(self, setting, every_board=False, cores=CORES):
        """Returns the cost of a setting on these cores. The Cortex-M7 runs the M4F's program, and is measured if all
        boards are.
        """
        pixels = setting.format.partition(" ")[0]
        what = (pixels, setting.toml(), setting.model)
        self.expected(*what)

        def of_target(target):
            programs = self.build(target, *what)
            on = [board for board in BOARDS if board.target == target and board.core in cores]
            counts = [self.count(board, programs, *what) for board in (on if every_board else on[:1])]
            return {board.core: counts[min(i, len(counts) - 1)] for i, board in enumerate(on)}

        with ThreadPoolExecutor() as pool:
            return {core: count for counts in pool.map(of_target, {board.target for board in BOARDS if board.core in cores}) for core, count in counts.items()}

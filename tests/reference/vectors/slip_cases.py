"""Streams of 25 taxels, and the slips that the reference finds in them."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from wstac_reference.constants import TAXELS
from wstac_reference.rng import SplitMix64, seed_of
from wstac_reference.slip import SlipDetector

from . import SEED

DARK, FADES = 300, 0.47
WHITE = 65535
RATES = {"long": 15, "grown": 15, "steep": 45, "again-15": 15}


class Stream:
    """Frames that glow with what a touch adds to them; None is a lost one."""

    def __init__(self, name: str, noise: int = 0) -> None:
        self.rng, self.noise = SplitMix64(seed_of(f"slip-{name}", SEED)), noise
        self.frames: list[list[int] | None] = []
        self.glow, self.ambient = [0.0] * TAXELS, DARK
        self.pattern = [self.below(80) + 20 for _ in range(TAXELS)]
        self.dark(24)

    def below(self, count: int) -> int:
        return int(self.rng.next() % count)

    def add(self, light: list[float], is_lost: bool = False) -> None:
        self.glow = [FADES * glow + one for glow, one in zip(self.glow, light)]
        noise = lambda: self.below(2 * self.noise + 1) - self.noise
        frame = [min(WHITE, max(0, self.ambient + noise() + round(glow))) for glow in self.glow]
        self.frames.append(None if is_lost else frame)

    def dark(self, frames: int, is_lost: bool = False) -> Stream:
        for _ in range(frames):
            self.add([0.0] * TAXELS, is_lost)
        return self

    def flash(self, size: float = 20.0, frames: int = 1, lost: int = -1) -> Stream:
        """A press or a release."""
        for number in range(frames):
            self.add([size * part for part in self.pattern], number == lost)
        return self

    def again(self, frames: int, size: float) -> Stream:
        """Steady light of another pattern."""
        for _ in range(frames):
            self.add([size * part for part in reversed(self.pattern)])
        return self

    def slip(self, frames: int, size: float) -> Stream:
        """Light with another pattern in every frame."""
        for _ in range(frames):
            self.add([size * (self.below(80) + 2) for _ in range(TAXELS)])
        return self

    def late(self, begins: float, frames: int) -> Stream:
        """A release of so many frames whose rows are read late, so that it begins and ends row by row."""
        open_ = lambda number, row: min(max(number + begins - 0.25 * row, 0.0), 1.0)
        for number in range(frames + 2):
            parts = [open_(number, row) - open_(number - frames, row) for row in range(5)]
            self.add([20.0 * parts[taxel // 5] * self.pattern[taxel] for taxel in range(TAXELS)])
        return self

    def side(self, frames: int) -> Stream:
        """A slide from the left, so many frames for a whisker."""
        for number in range(5 * frames):
            self.add([900.0 * (taxel % 5 == number // frames) for taxel in range(TAXELS)])
        return self


def rows(name: str, glow: float) -> Stream:
    """A slow slide: row by row with a rest between; the rows that are touched glow."""
    made = Stream(name, noise=1)
    for row in range(5):
        for number in range(14):
            light = lambda taxel: 500.0 * (number < 4 and taxel // 5 == row) + glow * made.below(2) * (taxel // 5 < row)
            made.add([light(taxel) for taxel in range(TAXELS)])
    return made.dark(14)


def any_stream(name: str, frames: int) -> Stream:
    """What comes by chance."""
    made = Stream(name, noise=1)
    while len(made.frames) < frames:
        size = 0.1 * 3.0 ** made.below(5)
        which = made.below(8)
        if which == 0:
            made.slip(1 + made.below(8), size)
        elif which < 4:
            made.flash(1.0 + 5.0 * size, 1 + made.below(5), made.below(6))
        elif which == 4:
            made.side(1 + made.below(2))
        elif which == 5:
            made.ambient = max(0, made.ambient + made.below(400) - 200)
        made.dark(made.below(14))
        made.dark(made.below(4), is_lost=True)
    return made


def streams() -> dict[str, tuple[Stream, tuple[int, int]]]:
    """Every case with its frame rate."""
    new = Stream
    drift = new("drift", noise=1).flash().dark(16)
    for step in range(24):
        drift.ambient += 700 if step == 8 else 3
        drift.dark(1)
    tremor = new("tremor", noise=1).flash().dark(16)
    for step in range(30):
        tremor.flash(0.05 * (step % 3))
    one = new("one-whisker")
    for _ in range(2):
        one.add([2000.0 * (taxel == 7) for taxel in range(TAXELS)])
        one.dark(16)
    extremes = new("extremes")
    for ambient in (WHITE, 0, WHITE, WHITE, 0, DARK):
        extremes.ambient = ambient
        extremes.dark(12).flash(2000.0).dark(3)
    noisy = new("noisy")
    noisy.noise = 40
    noisy.dark(12).flash(40.0, 2).dark(12)
    # Another touch for so long that its light may be noise.
    long = new("long").side(2)
    for step in range(340):
        long.add([4.0 * (taxel == step % 2) for taxel in range(TAXELS)])
    # Light of three taxels while ambient light falls: the sum is below 0.
    fallen = new("fallen")
    fallen.pattern = [400 * (taxel in (6, 7, 8, 11, 12)) for taxel in range(TAXELS)]
    fallen.flash().dark(16)
    fallen.ambient -= 19
    for _ in range(8):
        fallen.add([110.0 * (taxel in (6, 7, 8)) for taxel in range(TAXELS)])
        fallen.glow = [0.0] * TAXELS
    # Swings whose sums are 1, so that mean times are very steep.
    steep = new("steep")
    steep.ambient = 32768
    steep.dark(40)
    for step in range(44):
        left, next_one = (32000, -32000) if step < 22 else (-32000, 32000)
        left += {0: 300, 1: -300, 43: 1}.get(step, 0)
        next_one += step == 43
        frame = [32768 + (left if taxel % 5 == 0 else next_one * (taxel == 1)) for taxel in range(TAXELS)]
        steep.frames.append(frame)
    # Noise that has grown in a slip.
    grown = new("grown").flash(4.0).dark(16).slip(6, 0.3)
    grown.noise = 6
    grown.dark(480)
    rod = new("rod", noise=1)
    for count in (3, 2, 3):
        for _ in range(2):
            rod.add([900.0 * (taxel // 5 == 2) for taxel in range(TAXELS)])
        rod.dark(16)
        for _ in range(9):
            rod.add([200.0 * rod.below(2) * (taxel // 5 in (2, count)) for taxel in range(TAXELS)])
        rod.dark(14)
    off = lambda name: new(name).flash().dark(16).slip(9, 3.0).dark(14)
    cases = {
        "slip": new("slip").flash().dark(20).slip(12, 3.0).dark(20).slip(9, 3.0).dark(14).flash().dark(20),
        "slip-weak": new("slip-weak", noise=2).flash().dark(16).slip(10, 0.2).dark(8),
        "slip-strong": new("slip-strong").flash(frames=3).dark(16).slip(8, 40.0).dark(14),
        "release": new("release").flash(frames=2).dark(16).flash(frames=3).dark(16).flash(frames=4).dark(14),
        "slow": new("slow").flash(4.0, 6).dark(16).slip(6, 2.0).dark(14),
        # Releases whose first frame has little light, and slips that begin so, and that are as bright as the press or brighter.
        "late": new("late").flash(frames=4).dark(16).late(0.04, 4).dark(16).flash(frames=2).dark(16).late(0.3, 2).dark(14),
        "late-slip": new("late-slip").flash(frames=3).dark(16).again(1, 0.3).again(6, 4.0).dark(14).flash(frames=3).dark(16)
        .again(1, 0.3).again(6, 7.0).dark(14).flash(frames=3).dark(16).again(1, 1.5).again(6, 6.5).dark(14)
        .flash(frames=3).dark(16).again(6, 17.0).dark(14).flash(frames=3).dark(16).again(6, 27.0).dark(14)
        .flash(frames=3).dark(16).again(6, 8.4).dark(14),
        "late-short": new("late-short").flash(frames=2).dark(16).again(1, 0.3).again(6, 6.0).dark(14).flash(frames=2).dark(16)
        .again(6, 12.0).dark(14),
        "side": new("side").side(2).dark(14).side(1).dark(14).flash().dark(14).side(3).dark(14),
        "drift": drift.slip(6, 1.0),
        "tremor": tremor.slip(6, 2.0),
        "off-side": off("off-side").side(2).dark(14).side(1).dark(14).slip(9, 3.0).dark(14).side(3).dark(14),
        "off-press": off("off-press").flash(4.0, 6).dark(14).flash(4.0, 6).dark(14).slip(9, 3.0).dark(14),
        "second-grasp": off("second-grasp").flash(frames=2).dark(16).slip(9, 3.0).dark(14).flash().dark(12).slip(6, 3.0),
        "second-side": off("second-side").flash(frames=2).dark(16).side(1).dark(16).side(2).dark(9),
        "again": off("again").again(9, 20.0).dark(14).again(12, 0.4).dark(14).again(12, 3.0).dark(40),
        "again-15": off("again-15").again(9, 20.0).dark(14).again(12, 0.4).dark(14),
        "fallen": fallen,
        # Two slow slides from below, one with a texture, and a rod that slips along itself and then across.
        "row-by-row": rows("row-by-row", 0.0),
        "textured-row-by-row": rows("textured-row-by-row", 60.0),
        "rod": rod,
        "steep": steep.dark(9),
        "grown": grown,
        "one-whisker": one.flash().dark(14).slip(6, 2.0),
        "extremes": extremes,
        "noisy": noisy,
        "long": long.flash(4.0).dark(12).slip(6, 1.0),
        "lost": new("lost").flash(frames=3, lost=1).dark(12).dark(7, True).dark(6).flash(frames=3, lost=0).dark(16).flash()
        .dark(12).dark(8, True).dark(24).flash().dark(12).slip(2, 3.0).dark(1, True).slip(6, 3.0),
    }
    made = {name: (stream, (RATES.get(name, 30), 1)) for name, stream in cases.items()}
    for fps in ((15, 1), (45, 1), (60, 1), (30000, 1001)):
        name = f"slip-{fps[0]}"
        made[name] = (new(name).flash(frames=2).dark(20).slip(9, 3.0).dark(20).flash(frames=2).dark(9), fps)
    return made | {f"any-{seed}": (any_stream(f"any-{seed}", 260), (30, 1)) for seed in range(8)}


def case(name: str, stream: Stream, fps: tuple[int, int]) -> dict[str, Any]:
    """A stream, its slips, and when something is held."""
    added = max(1, (2 * fps[0] + 30 * fps[1]) // (60 * fps[1])) if fps[0] > 45 * fps[1] else 1
    detector = SlipDetector(Fraction(fps[0], fps[1] * added))
    slips, holds = [], [(0, None)]
    for number, frame in enumerate(stream.frames):
        if frame is None:
            continue
        slip = detector.take(number, frame)
        if slip is not None:
            slips.append((slip.frame, slip.onset_frame, slip.held_since_frame, float(f"{float(slip.strength):.6g}")))
        held = detector.held_since if detector.holds() else None
        if held != holds[-1][1]:
            holds.append((number, held))
    frames: list[Any] = []
    for frame in stream.frames:
        if frame != [DARK] * TAXELS:
            frames.append(frame)
        elif frames and isinstance(frames[-1], int):
            frames[-1] += 1
        else:
            frames.append(1)
    return {"name": name, "fps": fps, "frames": frames, "slips": slips, "holds": holds}


def slip_cases() -> list[dict[str, Any]]:
    return [case(name, stream, fps) for name, (stream, fps) in streams().items()]

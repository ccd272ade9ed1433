"""The slip of what is pressed on and held (SPEC section 9, "Slip")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from .constants import COLUMNS, TAXELS

LEAST_NOISE = 1600
LONGEST_GAP = 7
LIT = 32
STEEPEST = 2**31 - 1
WIDEST = 2**63
MOST_LIGHT = 2**20


def bounded(value: int) -> int:
    """A number that fits 64 bits with a sign."""
    assert -WIDEST <= value < WIDEST, "an integer is too wide"
    return value


def energy_beside(light: Sequence[int], pattern: Sequence[int]) -> int:
    """The energy of light that is not of a pattern."""
    size = bounded(sum(part * part for part in pattern))
    along = bounded(sum(part * one for part, one in zip(pattern, light)))
    scale = bounded(256 * along) // size if size else 0
    return bounded(sum((one - bounded(scale * part) // 256) ** 2 for one, part in zip(light, pattern)))


def without_mean(light: Sequence[int]) -> list[int]:
    """Light less its mean."""
    return [one - sum(light) // TAXELS for one in light]


def energy(light: Sequence[int]) -> int:
    """The sum of squares."""
    return bounded(sum(one * one for one in light))


def slope(places: Sequence[int], times: Sequence[int]) -> int:
    """The slope of times over places, by least squares."""
    spread = len(places) * sum(place * place for place in places) - sum(places) ** 2
    product = len(places) * sum(place * time for place, time in zip(places, times)) - sum(places) * sum(times)
    return bounded(product) // spread if spread else 0


@dataclass(frozen=True)
class Slip:
    """The record of a slip; the strength is exact."""

    frame: int
    onset_frame: int
    held_since_frame: int
    strength: Fraction


@dataclass
class Flash:
    """The light of a press or of a rise, frame by frame: its number, light, energy and uneven energy."""

    first: int
    lights: list[list[int]] = field(default_factory=list)
    seen: list[tuple[int, int, int, int]] = field(default_factory=list)

    def add(self, frame: int, light: list[int]) -> None:
        self.lights.append([min(frame - self.first, 31), *(one // 16 for one in light)])
        self.seen.append((frame, sum(light), energy(light), energy(without_mean(light))))

    def light(self) -> list[int]:
        """The sums of each taxel."""
        return [sum(row[1 + taxel] for row in self.lights) for taxel in range(TAXELS)]

    def most(self, which: int) -> int:
        """The greatest light (1), energy (2) or uneven energy (3) of a frame, at least 0."""
        return max(0, *(seen[which] for seen in self.seen), 0)

    def brightest(self) -> int:
        """The first frame of the greatest energy."""
        return next((seen[0] for seen in self.seen if seen[2] == self.most(2) > 0), self.first)

    def total(self) -> int:
        return sum(seen[1] for seen in self.seen)

    def comes_from_side(self, most: int) -> bool:
        """Whether times rise along the sensor by more than `most`."""
        sums = self.light()
        lit = [taxel for taxel in range(TAXELS) if sums[taxel] > 0 and sums[taxel] >= max(sums) // 8]
        late = lambda taxel: sum(row[0] * row[1 + taxel] for row in self.lights)
        times = [bounded(256 * late(taxel)) // sums[taxel] for taxel in lit]
        along = (slope([taxel % COLUMNS for taxel in lit], times), slope([taxel // COLUMNS for taxel in lit], times))
        return energy([min(max(one, -STEEPEST), STEEPEST) for one in along]) > most * most


class SlipDetector:
    """Follows a stream of 25 taxels at a rate of feature frames per second."""

    def __init__(self, per_second: Fraction) -> None:
        at_30 = lambda frames: (2 * frames * per_second / 30).__floor__() + 1 >> 1
        self.new, self.rises, self.longest_press, self.rest = (at_30(frames) for frames in (16, 12, 32, 3))
        self.longest, self.least_age, self.noisy = (at_30(frames) for frames in (16, 2, 512))
        self.moved_age, self.weak_age = at_30(5), at_30(7)
        self.slope, self.second_slope = ((part * per_second / 30).__floor__() for part in (77, 51))
        self.state = "new"
        self.next, self.count = 0, 0
        self.floor = [0] * TAXELS
        self.noise = LEAST_NOISE
        self.flash = Flash(0)
        self.last_energy = 0
        """The greatest energy of a touch that has not come to rest."""
        self.pattern = [0] * TAXELS
        self.press = (0, 0, 0)
        """The greatest light and energy of the press, and all its light."""
        self.level, self.held_since, self.has_moved, self.may_be_gone = 0, 0, False, False
        self.wait, self.is_short = 0, True
        """Frames to wait for what may be a release: it takes as long as the press. Whether that was short."""

    def holds(self) -> bool:
        return self.state in ("held", "rise", "slip")

    def take(self, frame: int, taxels: Sequence[int]) -> Slip | None:
        """Takes the frame of a number, and returns the slip that it shows."""
        if frame < self.next:
            return None
        if frame - self.next > LONGEST_GAP:
            self.turn("new")
        self.next = frame + 1
        light = [16 * taxel - floor for taxel, floor in zip(taxels, self.floor)]
        assert all(abs(one) <= MOST_LIGHT for one in light), "light is too wide"
        return getattr(self, f"in_{self.state}")(frame, light)

    def turn(self, state: str) -> None:
        self.state, self.count = state, 0

    def move(self, light: list[int], below: int, above: int) -> None:
        self.floor = [floor + one // (below if one < 0 else above) for floor, one in zip(self.floor, light)]

    def is_touch(self, light: list[int]) -> bool:
        return energy(without_mean(light)) > 64 * self.noise

    def limit(self) -> int:
        return 4 * max(self.noise, self.level)

    def uneven_beside(self, light: list[int]) -> int:
        return energy_beside(without_mean(light), [TAXELS * part - sum(self.pattern) for part in self.pattern])

    def in_new(self, _: int, light: list[int]) -> None:
        step = energy(without_mean(light)) - self.noise
        self.noise = LEAST_NOISE if self.count < 2 else max(LEAST_NOISE, self.noise + step // 4)
        self.move(light, 2 if self.count else 1, 2 if self.count else 1)
        self.count += 1
        if self.count >= self.new:
            self.turn("dark")

    def in_dark(self, frame: int, light: list[int]) -> None:
        if rises(light) and self.is_touch(light):
            self.begin("press", frame, light)
            return
        uneven = min(energy(without_mean(light)), 4 * self.noise)
        self.noise = max(LEAST_NOISE, self.noise + (uneven - self.noise) // 32)
        self.move(light, 8, 8)

    def begin(self, state: str, frame: int, light: list[int]) -> None:
        self.turn(state)
        self.flash = Flash(frame)
        self.flash.add(frame, light)

    def in_press(self, frame: int, light: list[int]) -> None:
        flash, uneven = self.flash, energy(without_mean(light))
        self.last_energy = flash.most(2)
        if 256 * energy(light) <= flash.most(2) or 256 * uneven <= flash.most(3):
            self.may_be_gone = False
            self.end_press(light)
        elif self.has_risen(light) or frame - flash.first > self.longest_press:
            self.turn("other")
        else:
            flash.add(frame, light)

    def comes_from_side(self) -> bool:
        return self.flash.comes_from_side(self.second_slope if self.state == "rise" else self.slope)

    def has_risen(self, light: list[int]) -> bool:
        """Whether light that had begun to fade does not fade on: a press is brightest at its end."""
        _, _, last, last_uneven = self.flash.seen[-1]
        stays = 16 * energy(light) > 9 * last and 16 * energy(without_mean(light)) > 9 * last_uneven
        return 8 * last < 7 * self.flash.most(2) and stays

    def end_press(self, light: list[int]) -> None:
        """A hold, if the light that has faded was a press."""
        flash, sums = self.flash, self.flash.light()
        self.pattern = [255 * max(one, 0) // max(1, *sums) for one in sums]
        is_short = flash.brightest() - flash.first <= self.rises
        is_wide = sum(part >= LIT for part in self.pattern) >= 5
        self.turn("held" if is_short and is_wide and not self.comes_from_side() else "other")
        self.press = (flash.most(1), flash.most(2), flash.total())
        lasts = flash.brightest() - flash.first
        self.wait, self.is_short = max(self.least_age, lasts), 2 * lasts <= self.least_age
        self.level, self.held_since, self.has_moved = self.noise, flash.first, False
        self.move(light, 1, 1)

    def in_second_rise(self, frame: int, light: list[int]) -> Slip | None:
        """Light behind a slip: another one, or another touch if the part has left."""
        flash, first_light = self.flash, self.press[2]
        self.last_energy = flash.most(2)
        if 8 * energy(light) <= flash.most(2) or 8 * energy(without_mean(light)) <= flash.most(3):
            if 6 * flash.total() <= first_light and not self.comes_from_side():
                self.turn("held")
                self.move(light, 1, 1)
            else:
                self.may_be_gone = True
                self.end_press(light)
            return None
        age = frame - flash.first
        if age > self.longest_press:
            self.turn("other")
            return None
        flash.add(frame, light)
        if not (rises(light) and self.is_touch(light) and self.is_mostly_lit(age)):
            return None
        if age >= self.least_age and self.comes_from_side():
            self.turn("other")
            return None
        is_motion = age >= self.moved_age and flash.total() > 2 * first_light
        is_weak = age >= self.weak_age and 2 * flash.total() < first_light
        return self.slip(frame) if (is_motion or is_weak) and 4 * energy(light) > flash.most(2) else None

    def slip(self, frame: int) -> Slip:
        self.turn("slip")
        self.last_energy = self.flash.most(2)
        strength = Fraction(max(1, self.flash.most(1)), max(1, self.press[0]))
        return Slip(frame, self.flash.first, self.held_since, strength)

    def in_held(self, frame: int, light: list[int]) -> None:
        beside = self.uneven_beside(light)
        is_bright = self.is_touch(light) and 64 * energy(light) > self.press[1]
        if rises(light) and (beside > self.limit() or is_bright):
            self.begin("rise", frame, light)
            return
        self.level += (beside - self.level) // 64
        self.move(light, 2, 8)

    def in_rise(self, frame: int, light: list[int]) -> Slip | None:
        if self.has_moved:
            return self.in_second_rise(frame, light)
        flash, last = self.flash, self.flash.seen[-1][2]
        flash.add(frame, light)
        age = frame - flash.first
        is_other = self.may_be_gone and self.comes_from_side()
        if self.is_slip(age, light, last) and not is_other:
            if self.arrives():
                self.last_energy = flash.most(2)
                self.turn("other")
                return None
            return self.slip(frame)
        if 16 * energy(light) < flash.most(2) or age >= self.longest:
            self.last_energy = flash.most(2)
            self.turn("other" if 6 * flash.total() > self.press[2] or is_other else "held")
            self.move(light, 1, 1)
        return None

    def is_mostly_lit(self, age: int) -> bool:
        sums = self.flash.light()
        lit = [taxel for taxel in range(TAXELS) if self.pattern[taxel] >= LIT]
        bright = [taxel for taxel in lit if sums[taxel] > 0 and 100 * sums[taxel] ** 2 > self.noise * (age + 1)]
        return 2 * len(bright) >= len(lit)

    def arrives(self) -> bool:
        """Whether one row or column was pressed, and others have most of the light."""
        lit = [taxel for taxel in range(TAXELS) if self.pattern[taxel] >= LIT]
        bright = [max(0, one) for one in self.flash.light()]
        in_line = min(len({taxel // COLUMNS for taxel in lit}), len({taxel % COLUMNS for taxel in lit})) == 1
        return in_line and sum(bright) > 2 * sum(bright[taxel] for taxel in lit)

    def is_slip(self, age: int, light: list[int], last: int) -> bool:
        sums, flash = self.flash.light(), self.flash
        if not rises(light) or not self.is_mostly_lit(age):
            return False
        if self.uneven_beside(light) <= self.limit() or 3 * energy(light) < last:
            return False
        beside = energy_beside(sums, [TAXELS * part for part in self.pattern])
        brightest, of_press = flash.most(1), self.press[0]
        jumps = energy(light) > 32 * last and not self.is_short
        parts = 2 if age > 1 else 6 if jumps else 3
        is_over = age > self.wait or 8 * brightest > 9 * of_press or (self.is_short and 12 * beside > energy(sums))
        return (
            4 * flash.total() > 5 * self.press[2]
            or (parts * brightest < of_press and 50 * beside > energy(sums))
            or (age >= self.wait and is_over and 28 * beside > energy(sums))
        )

    def in_slip(self, frame: int, light: list[int]) -> None:
        self.last_energy = max(self.last_energy, energy(light))
        is_rest = 256 * energy(light) <= self.last_energy or 4 * energy(without_mean(light)) < 64 * self.noise
        self.count = self.count + 1 if is_rest else 0
        if self.count < self.rest:
            if frame - self.flash.first > self.noisy:
                self.noise = max(self.noise, min(self.noise + self.noise // 256, energy(without_mean(light))))
            self.move(light, 1, 64)
            return
        if self.state == "slip":
            self.held_since, self.has_moved = frame, True
        self.turn("held" if self.state == "slip" else "dark")
        self.move(light, 1, 1)

    in_other = in_slip


def rises(light: Sequence[int]) -> bool:
    """Whether a fifth of the energy at most is below the floor."""
    return energy(light) > 5 * sum(one * one for one in light if one < 0)

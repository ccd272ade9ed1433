"""Answers before a sample is complete (SPEC section 9, "At once")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from .constants import NOMINAL_FPS, SAMPLE_FRAMES, SLOW_DARK_FRAMES, UNIT
from .trigger import ContactEnd, Sample, Trigger
from .wave import WaveAnswer, light_of, measure_wave, span_of

OF_CUT = (1.4, 1.7)
STEP = 2
"""Frames from one try to the next."""
AGREE, ALIKE = (2.0, 0.02, 1.2), (3.0, 0.03, 3.0)
"""Standard deviations, a fraction of the speed, and degrees: of two tries, and of a block's two ends."""
LONGEST_MM, OF_END_MM = 120.0, 40.0
"""The longest block whose two ends are one touch, and the most path on which one end gives light."""
GLOWS = 10 * 0.2 * UNIT
"""How far ten features together are above those before its light if a flat block's middle glows."""


@dataclass(frozen=True)
class Answered:
    """An answer, the frame in which it comes, and the sample's first frame and how many of its frames have arrived."""

    frame: int
    event_frame: int
    frames: int
    wave: WaveAnswer


@dataclass(frozen=True)
class Limits:
    """How far two velocities may differ, and a factor of every deviation: other values show how near a decision is."""

    agree: tuple[float, float, float] = AGREE
    alike: tuple[float, float, float] = ALIKE
    sd: float = 1.0


def agrees(one: WaveAnswer, other: WaveAnswer, limits: tuple[float, float, float]) -> bool:
    """Whether two velocities may be one."""
    sds, part, degrees = limits
    turned = abs((one.deg - other.deg + 180) % 360 - 180)
    is_as_fast = abs(one.mm_s - other.mm_s) <= max(sds * one.mm_s_sd, part * one.mm_s)
    return is_as_fast and turned <= max(sds * one.deg_sd, degrees)


def glows(first: Sample, features: Sequence[int] | None) -> bool:
    """Whether something glows that was dark before a touch."""
    return features is not None and sum(features) - sum(first.features[0]) > GLOWS


class AtOnce:
    """Follows one stream of feature frames whose trigger gives one event per touch."""

    def __init__(self, trigger: Trigger, fps: float = NOMINAL_FPS, readout_ms: float | None = 0.0) -> None:
        self.trigger, self.fps, self.readout_ms = trigger, fps, readout_ms
        self.limits = Limits()
        self.sums: list[list[int] | None] = []
        self.features: list[Sequence[int] | None] = []
        self.frame: int | None = None
        self.tried = 0
        """The frames of this sample at the last try."""
        self.is_over = False
        """Whether the touch had ended at that try: its light stays as it is."""
        self.found: WaveAnswer | None = None
        self.before: tuple[Sample, WaveAnswer] | None = None
        self.answered: tuple[Sample, WaveAnswer] | None = None
        """The touches of the sample before and of this one, if they were answered by a velocity."""
        self.same: dict[int, int] = {}
        """The samples of other ends, each with that of the touch that was answered."""
        self.slow: int | None = None
        """The first frame of the last event's sample, if its answer was not reliable."""

    def lose(self, count: int) -> list[Answered]:
        """Takes note of lost frames in front of the next one."""
        self.sums += [None] * count
        self.features += [None] * count
        return [answer for sample in self.trigger.gap(count) if (answer := self.try_(sample)) is not None]

    def take(self, features: Sequence[int], sums: list[int]) -> Answered | None:
        """Takes the next frame, and returns the answer that it brings."""
        self.sums.append(sums)
        self.features.append(features)
        sample = self.trigger.frame(features) or self.trigger.under_way()
        return None if sample is None else self.try_(sample)

    def ends(self) -> list[ContactEnd]:
        """Returns the ends of touches so far, each that of its last light."""
        of = lambda end: self.same.get(end.event_frame, end.event_frame)
        return list({of(end): replace(end, event_frame=of(end)) for end in self.trigger.contact_ends}.values())

    def try_(self, sample: Sample) -> Answered | None:
        """Tries to answer a touch of which so many frames have arrived."""
        frames = len(sample.features)
        is_whole = frames == SAMPLE_FRAMES
        if sample.frame in self.same or not (sample.reliable or is_whole):
            return None
        if sample.frame != self.frame:
            self.frame, self.tried, self.found = sample.frame, 0, None
            self.before, self.answered = self.one_end(), None
        is_early = frames < self.tried + STEP or (self.is_over and sample.end_frame is not None)
        if self.tried and is_early and not is_whole:
            return None
        self.tried, self.is_over = frames, sample.end_frame is not None
        wave = self.measure(self.sums[sample.frame : sample.frame + frames], is_whole)
        has_velocity = wave.why is None
        before = self.found
        if has_velocity:
            self.found = wave
        is_certain = sample.end_frame is not None
        if has_velocity and before is not None:
            is_certain = is_certain or agrees(before, wave, self.limits.agree)
        if not is_whole and not (has_velocity and is_certain):
            return None
        if self.before is not None and self.is_other_end(*self.before, sample, wave):
            first = self.before[0]
            self.same[sample.frame] = first.frame
            # The other end may follow the middle.
            self.answered = None if has_velocity else self.before
            return None
        if not has_velocity and self.is_slow_light(sample):
            self.same[sample.frame], self.answered = self.slow, None
            return None
        self.slow = None if has_velocity or wave.why in ("press", "poke") else sample.frame
        self.answered = (sample, wave) if has_velocity and wave.basis == "edge" else None
        if not is_whole:
            self.trigger.answer()
        return Answered(sample.frame + frames - 1, sample.frame, frames, wave)

    def one_end(self) -> tuple[Sample, WaveAnswer] | None:
        """The last touch, if it was an edge of which only one end has passed, or something glows."""
        if self.answered is None:
            return None
        sample, wave = self.answered
        ends = [end.frame for end in self.trigger.contact_ends if end.event_frame == sample.frame]
        passed = [end for end in ends if (end - sample.touch_frame) / self.fps * wave.mm_s > OF_END_MM]
        # Its end is known in the last frame of its sample, or in the fifth dark one.
        known = [max(end + 4, sample.frame + SAMPLE_FRAMES - 1) for end in passed]
        return self.answered if all(glows(sample, self.features[frame]) for frame in known) else None

    def is_other_end(self, first: Sample, of_first: WaveAnswer, sample: Sample, wave: WaveAnswer) -> bool:
        """Whether this is the light of the other end of what slid before, or of its middle."""
        if (sample.touch_frame - first.touch_frame) / self.fps * of_first.mm_s > LONGEST_MM:
            return False
        if wave.why in (None, "press", "poke"):
            return wave.why is None and agrees(of_first, wave, self.limits.alike)
        return glows(first, sample.features[0])

    def is_slow_light(self, sample: Sample) -> bool:
        """Whether this light follows that of an event without a reliable answer too soon for another touch."""
        ends = [end.frame for end in self.ends() if end.event_frame == self.slow]
        return bool(ends) and sample.touch_frame - ends[-1] < SLOW_DARK_FRAMES

    def measure(self, samples: list[list[int] | None], is_whole: bool) -> WaveAnswer:
        """The wave of the frames from the first that arrived, with wider deviations if light is to come."""
        while samples and samples[0] is None:
            samples = samples[1:]
        wave = measure_wave(samples, self.fps, self.readout_ms)
        if wave.why is not None:
            return wave
        is_cut = span_of(*light_of(samples))[2]
        speed, angle = (self.limits.sd * part for part in (OF_CUT if is_cut and not is_whole else (1.0, 1.0)))
        return replace(wave, mm_s_sd=speed * wave.mm_s_sd, deg_sd=angle * wave.deg_sd)

"""Decides when an event happens: baseline, windows, and the capture of a sample."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from .constants import BASELINE_WINDOWS, DARK_FRAMES, FEATURES, SAMPLE_FRAMES, SHORT_GAP, UNIT
from .rational import fixed16


@dataclass(frozen=True)
class TriggerConfig:
    """m (window), b (multiplier), c (backtrack), the rule, its margin, N (follow), which is 0 for a fixed baseline, and
    whether there is one event per touch."""

    window: int = 5
    multiplier: float = 1.2
    backtrack: int = 10
    rule: str = "signed"
    margin: float = 0.2
    follow: int = 0
    per_touch: bool = False

    def __post_init__(self) -> None:
        m, c = self.window, self.backtrack
        if not 1 <= m <= SAMPLE_FRAMES:
            raise ValueError(f"window {m} is not in 1..={SAMPLE_FRAMES}")
        if not 0 <= c <= BASELINE_WINDOWS * m:
            raise ValueError(f"backtrack {c} is not in 0..={BASELINE_WINDOWS * m}")
        if c + m > SAMPLE_FRAMES:
            raise ValueError(f"backtrack {c} + window {m} is above {SAMPLE_FRAMES}")
        if self.rule not in ("signed", "literal"):
            raise ValueError(f"rule {self.rule!r}")
        if self.rule == "signed" and self.multiplier < 1:
            raise ValueError(f"multiplier {self.multiplier} is below 1")
        if self.multiplier < 0 or self.margin < 0:
            raise ValueError("multiplier and margin are not negative")
        if self.follow not in (0, *(1 << k for k in range(4, 16))):
            raise ValueError(f"follow {self.follow} is neither 0 nor a power of two in 16..=32768")


@dataclass(frozen=True)
class Baseline:
    """The baseline of the first 5 m frames.

    `totals` are the sums T_k over all of them, so eta_k = T_k / 5 exactly. `thresholds` are exact too. `quiet` is false
    if, for any k, the five window sums differ (largest less smallest) by more than the trigger's own margin. `long_gap`
    is true if a gap longer than 7 frames lies in it.
    """

    window: int
    totals: tuple[int, ...]
    thresholds: tuple[Fraction, ...]
    quiet: bool
    long_gap: bool

    @property
    def etas(self) -> tuple[Fraction, ...]:
        """Returns the mean window sums, in feature units."""
        return tuple(Fraction(total, BASELINE_WINDOWS) for total in self.totals)

    def mean_above(self, k: int, bound: float) -> bool:
        """Returns whether eta_k / m is above a bound in feature units."""
        return self.totals[k] / (BASELINE_WINDOWS * self.window) > bound

    def mean_light(self, k: int) -> float:
        """Returns exp(eta_k / m): the baseline brightness of a row or column."""
        return math.exp(self.totals[k] / (BASELINE_WINDOWS * self.window) / UNIT)


def measure_baseline(config: TriggerConfig, frames: Sequence[Sequence[int]], long_gap: bool) -> Baseline:
    """Computes baseline and thresholds of exactly 5 m frames, in integers and fractions.

    signed: eta + max((b - 1)|eta|, m margin 2048), quiet against the same maximum.
    literal: b eta, quiet against |b - 1| |eta| (*decided*).
    """
    m = config.window
    totals, thresholds, quiet = [], [], True
    for k in range(FEATURES):
        windows = [sum(f[k] for f in frames[w * m : (w + 1) * m]) for w in range(BASELINE_WINDOWS)]
        threshold, own_margin = threshold_and_margin(config, sum(windows))
        totals.append(sum(windows))
        thresholds.append(threshold)
        quiet = quiet and max(windows) - min(windows) <= own_margin
    return Baseline(m, tuple(totals), tuple(thresholds), quiet, long_gap)


def threshold_and_margin(config: TriggerConfig, total: int) -> tuple[Fraction, Fraction]:
    """Returns the threshold of a window sum and its margin, from a total T = 5 eta."""
    b, margin = fixed16(config.multiplier), fixed16(config.margin)
    eta = Fraction(total, BASELINE_WINDOWS)
    if config.rule == "signed":
        own_margin = max((b - 1) * abs(eta), config.window * margin * UNIT)
        return eta + own_margin, own_margin
    return b * eta, abs(b - 1) * abs(eta)


class Drift:
    """A baseline that follows slow drift: a low pass over quiet windows with a time constant of N windows (*decided*).

    Its state is numbers F_k = N T_k + what T_k leaves out, so T_k = floor(F_k / N). A quiet window with sums W_k adds 5
    W_k - T_k to F_k, limited to +-floor(5 margin_k), the margin at T_k.
    """

    def __init__(self, config: TriggerConfig, baseline: Baseline) -> None:
        self._config = config
        self._fine = [config.follow * total for total in baseline.totals]

    def after(self, baseline: Baseline, sums: Sequence[int]) -> Baseline:
        """Returns the baseline after a quiet window."""
        for k, (total, window) in enumerate(zip(baseline.totals, sums, strict=True)):
            most = math.floor(BASELINE_WINDOWS * threshold_and_margin(self._config, total)[1])
            self._fine[k] += min(max(BASELINE_WINDOWS * window - total, -most), most)
        totals = tuple(fine // self._config.follow for fine in self._fine)
        thresholds = tuple(threshold_and_margin(self._config, total)[0] for total in totals)
        return replace(baseline, totals=totals, thresholds=thresholds)


@dataclass(frozen=True)
class Sample:
    """X: 70 consecutive feature frames, from `frame` on. `features[t]` has 10 numbers."""

    frame: int
    features: tuple[tuple[int, ...], ...]
    frames_filled: int
    reliable: bool
    touch_frame: int | None = None
    end_frame: int | None = None


@dataclass(frozen=True)
class ContactEnd:
    """The first dark frame behind the touch of an event, and the first frame of the event's sample."""

    frame: int
    event_frame: int


@dataclass(frozen=True)
class Incomplete:
    """A sample that was never finished, and the number of its frames."""

    frame: int
    frames: int


class Trigger:
    """Takes frames, and returns samples.

    Lost frames are known only as a total, before the next real frame or at the end. *Decided*: up to 7 are filled with
    the last features and processed like any frame (they may fire a window, complete the baseline or a sample). A longer
    gap ends an open sample, which is reported incomplete with the frames it had before the gap. An open window is
    forgotten, and time advances by the gap. Windows start anew at the first real frame after it, but never inside an
    emitted sample's own 70 frames (not before t + l, so that samples share no frame). Frames of the gap repeat the last
    features and may be in a later event's backtrack. In the baseline, any gap's frames count as baseline frames. If the
    baseline ends inside a long gap, the rest of the gap is skipped.

    With `follow`, the baseline drifts after every window that does not fire, except the first ceil(35 / m) after one
    that did (*decided*).

    With `per_touch`, no window is watched from a sample's end until five dark frames in a row have followed the last
    lit one (*decided*). Frames of a long gap are neither. A touch that is answered at once has no sample, only an end.
    """

    def __init__(self, config: TriggerConfig) -> None:
        self.config = config
        self.baseline: Baseline | None = None
        self.interrupted: list[Incomplete] = []
        self._features: list[tuple[int, ...]] = []
        self._filled: list[bool] = []
        self._baseline_frames = BASELINE_WINDOWS * config.window
        self._window_start = self._baseline_frames
        self._sample_start: int | None = None
        self._baseline_gap = False
        self._drift: Drift | None = None
        self._left_out = 0
        self.contact_ends: list[ContactEnd] = []
        self._lit: list[tuple[int, bool]] = []
        self._fired_at = 0
        self._held: int | None = None
        self._is_answered = False

    @property
    def frames(self) -> int:
        """Returns the length of the time line so far, filled frames included."""
        return len(self._features)

    @property
    def open_sample(self) -> Incomplete | None:
        """Returns the sample being captured now, if any."""
        if self._sample_start is None:
            return None
        return Incomplete(self._sample_start, self.frames - self._sample_start)

    def under_way(self) -> Sample | None:
        """Returns the frames so far of the touch that is being captured, unless it is answered."""
        return None if self._sample_start is None or self._is_answered else self._sample(self._sample_start)

    def answer(self) -> None:
        """Takes note that the touch that is being captured is answered."""
        self._is_answered = True

    def frame(self, features: Sequence[int], filled: bool = False) -> Sample | None:
        """Takes one feature frame. `filled` marks one that is not wholly measured."""
        self._append(tuple(features), filled)
        if self.baseline is None:
            self._try_baseline()
            return None
        if self.config.per_touch:
            bounds = zip(features, self.baseline.thresholds, strict=True)
            self._lit.append((self.frames - 1, any(self.config.window * f > bound for f, bound in bounds)))
            self._release()
        if self._sample_start is None and self._held is None:
            self._try_window()
        if self._sample_start is not None and self.frames == self._sample_start + SAMPLE_FRAMES:
            return self._emit(self._sample_start)
        return None

    def gap(self, count: int) -> list[Sample]:
        """Counts `count` feature frames that were lost since the last one. Before the first frame it does nothing."""
        if count == 0 or not self._features:
            return []
        last = self._features[-1]
        if count <= SHORT_GAP:
            samples = [self.frame(last, filled=True) for _ in range(count)]
            return [sample for sample in samples if sample is not None]
        if self.open_sample is not None:
            if self._is_answered:
                self._hold(self.open_sample.frame)
            else:
                self.interrupted.append(self.open_sample)
            self._sample_start = None
            self._window_start = 0
        self._baseline_gap = self._baseline_gap or self.baseline is None
        for _ in range(count):
            self._append(last, True)
            if self.baseline is None:
                self._try_baseline()
        self._window_start = max(self._window_start, self.frames)
        return []

    def _append(self, features: tuple[int, ...], filled: bool) -> None:
        self._features.append(features)
        self._filled.append(filled)

    def _try_baseline(self) -> None:
        if self.frames == self._baseline_frames:
            self.baseline = measure_baseline(self.config, self._features, self._baseline_gap)
            self._drift = Drift(self.config, self.baseline) if self.config.follow else None

    def _try_window(self) -> None:
        start, m = self._window_start, self.config.window
        if self.frames != start + m:
            return
        assert self.baseline is not None
        window = self._features[start:]
        sums = [sum(f[k] for f in window) for k in range(FEATURES)]
        if any(sums[k] > self.baseline.thresholds[k] for k in range(FEATURES)):
            self._left_out = math.ceil(Fraction(SAMPLE_FRAMES, 2 * m))
            self._fired_at = self.frames - 1
            self._sample_start = start - self.config.backtrack
            self._window_start = start + SAMPLE_FRAMES
            return
        self._window_start = start + m
        if self._left_out:
            self._left_out -= 1
        elif self._drift is not None:
            self.baseline = self._drift.after(self.baseline, sums)

    def _emit(self, start: int) -> Sample | None:
        sample = self.under_way()
        self._sample_start = None
        if self.config.per_touch:
            self._hold(start)
        return sample

    def _hold(self, start: int) -> None:
        """Waits for the end of a touch that has its answer."""
        self._held, self._is_answered = start, False
        self._release()

    def _sample(self, start: int) -> Sample:
        assert self.baseline is not None
        filled = sum(self._filled[start:])
        trusted = self.baseline.quiet and not self.baseline.long_gap and filled <= SHORT_GAP
        features = tuple(self._features[start:])
        if not self.config.per_touch:
            return Sample(start, features, filled, trusted)
        return Sample(start, features, filled, trusted, self._touch_frame(), self._dark_since())

    def _touch_frame(self) -> int:
        """Returns the first lit frame of the touch that fired: before it come five dark frames, or no frame."""
        first, dark = 0, 0
        for frame, lit in reversed([(frame, lit) for frame, lit in self._lit if frame <= self._fired_at]):
            if lit:
                first, dark = frame, 0
            elif first and (dark := dark + 1) == DARK_FRAMES:
                break
        return first

    def _dark_since(self) -> int | None:
        """Returns the frame behind the last lit one if the last five frames are dark."""
        if any(lit for _, lit in self._lit[-DARK_FRAMES:]):
            return None
        return max((frame + 1 for frame, lit in self._lit if lit), default=0)

    def _release(self) -> None:
        """Ends the touch of the last event if its light has left. Windows start anew behind that."""
        end = self._dark_since()
        if self._held is not None and end is not None:
            self.contact_ends.append(ContactEnd(end, self._held))
            self._held = None
            self._window_start = max(self._window_start, self.frames)

#!/usr/bin/env python3
"""Tests the reference itself, against numbers computed by hand."""

from __future__ import annotations

import math
import unittest
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from wstac_reference.binning import Binner, Group, frames_added
from wstac_reference.direction import measure_direction, slope
from wstac_reference.features import Features, floor_feature, row_and_column_sums
from wstac_reference.formats import FORMATS, by_fourcc
from wstac_reference.green import GreenSums, YCbCr
from wstac_reference.layout import Layout, paper_layout
from wstac_reference.path_sample import BY_TAXELS, RINGS, along, by_lines, edge, sums_along, taxels_along
from wstac_reference.speed import SpeedConfig, measure_speed
from wstac_reference.trigger import Baseline, Incomplete, Sample, Trigger, TriggerConfig, measure_baseline

DARK, LIT = -8000, -2000
"""Features below and above ln 0.0475 * 2048 = -6240.9."""


def flat(value: int) -> list[int]:
    return [value] * 10


def layout_of(w: int, h: int, x: int = 0, y: int = 0) -> Layout:
    return Layout(w, h, ((x, y),) * 25)


def first_sum(name: str, width: int, height: int, data: list[int], w: int, h: int, x=0, y=0, bpl=None, **more) -> int:
    fmt = FORMATS[name]
    line = bpl or fmt.min_bytes_per_line(width)
    return GreenSums(fmt, width, height, line, layout_of(w, h, x, y), **more).sums(bytes(data))[0]


class LayoutTest(unittest.TestCase):
    def test_paper_at_1280x720(self) -> None:
        layout = paper_layout(1280, 720)
        self.assertEqual((layout.width, layout.height), (90, 90))
        self.assertEqual(layout.corners[0], (307, 27))
        self.assertEqual(layout.corners[1], (451, 27))
        self.assertEqual(layout.corners[5], (307, 171))
        self.assertEqual(layout.corners[24], (883, 603))

    def test_paper_at_400_and_640x480(self) -> None:
        self.assertEqual(paper_layout(400, 400).corners[6], (95, 95))
        layout = paper_layout(640, 480)  # 1.2 times: side 60, pitch 96, first 80 + 18
        self.assertEqual((layout.width, layout.corners[0], layout.corners[24]), (60, (98, 18), (482, 402)))

    def test_one_rounding(self) -> None:
        # 41 x 20: offset 10.5; column 0 at 10.5 + 0.75 = 11.25, column 1 at 15.25
        self.assertEqual([x for x, _ in paper_layout(41, 20).corners[:2]], [11, 15])
        # side of 4: 0.5 rounds up to 1; of 3: 0.375 is none
        self.assertEqual(paper_layout(4, 4).width, 1)
        self.assertRaises(ValueError, paper_layout, 3, 3)

    def test_outside(self) -> None:
        layout_of(4, 4, 2, 2).check(6, 6)
        self.assertRaises(ValueError, layout_of(4, 4, 3, 2).check, 6, 6)
        self.assertRaises(ValueError, layout_of(0, 4).check, 6, 6)

    def test_snapped(self) -> None:
        layout = layout_of(7, 5, 3, 4).snapped_to_cells()
        self.assertEqual((layout.width, layout.height, layout.corners[0]), (6, 4, (2, 4)))
        self.assertRaises(ValueError, layout_of(1, 5).snapped_to_cells)


class GreenTest(unittest.TestCase):
    def test_grey_stride_and_padding(self) -> None:
        data = [1, 2, 3, 99, 4, 5, 6, 99, 7, 8, 9, 99]
        self.assertEqual(first_sum("GREY", 3, 3, data, 3, 3, bpl=4), 45)
        self.assertEqual(first_sum("GREY", 3, 3, data, 3, 3, bpl=4, stride=2), 1 + 3 + 7 + 9)
        self.assertEqual(first_sum("GREY", 3, 3, data, 2, 2, 1, 1, bpl=4), 5 + 6 + 8 + 9)

    def test_words_saturate(self) -> None:
        self.assertEqual(first_sum("Y10", 2, 1, [1, 2, 0, 4], 2, 1), 513 + 1023)
        self.assertEqual(first_sum("Y12", 2, 1, [255, 255, 1, 0], 2, 1), 4096)
        self.assertEqual(first_sum("Y16", 2, 1, [255, 255, 1, 0], 2, 1), 65536)

    def test_rgb(self) -> None:
        self.assertEqual(first_sum("RGB24", 1, 1, [1, 2, 3], 1, 1), 2)
        for name, want in (("RGBX32", 2), ("BGRX32", 2), ("XRGB32", 3), ("XBGR32", 3)):
            self.assertEqual(first_sum(name, 1, 1, [1, 2, 3, 4], 1, 1), want)
        # green 0b100001 is bits 5..10: 33 << 5 = 0x0420, widened to 0b10000110
        self.assertEqual(first_sum("RGB565", 1, 1, [0x20, 0x04], 1, 1), 0b10000110)

    def test_bayer(self) -> None:
        data = list(range(16))  # 4 x 4
        self.assertEqual(first_sum("RGGB8", 4, 4, data, 2, 2), 1 + 4)
        self.assertEqual(first_sum("GBRG8", 4, 4, data, 2, 2), 0 + 5)
        self.assertEqual(first_sum("BGGR8", 4, 4, data, 3, 3, 1, 1), 1 + 4)  # snapped
        self.assertEqual(first_sum("GRBG8", 4, 4, data, 4, 4, stride=2), 0 + 5)
        green = GreenSums(FORMATS["RGGB8"], 12, 8, 12, layout_of(11, 7), stride=2)
        self.assertEqual(green.pixels, 2 * 3 * 2)

    def test_ycbcr_by_hand(self) -> None:
        gray = YCbCr("bt601", "limited")

        def cell(y: int, cb: int, cr: int, how: YCbCr) -> int:
            return int(how.per_pixel(np.array([y]), np.array([cb]), np.array([cr]))[0])

        self.assertEqual(cell(235, 128, 128, gray), 255)
        self.assertEqual(cell(16, 128, 128, gray), 0)
        # 1.164384 * (81 - 16) - 0.391762 * (90 - 128) - 0.812968 * (240 - 128) = -0.48: red
        self.assertEqual(cell(81, 90, 240, gray), 0)
        # 1.164384 * 129 + 0.391762 * 74 + 0.812968 * 94 = 255.6: green
        self.assertEqual(cell(145, 54, 34, gray), 255)
        # full range BT.709: 100 - 0.187324 * 20 + 0.468124 * 30 = 110.297
        self.assertEqual(cell(100, 148, 98, YCbCr("bt709", "full")), 110)

    def test_exact_and_linear(self) -> None:
        # Y 17 limited is 1.164: exact gives 1 per pixel, linear rounds 4.657 once
        for mode, want in (("exact", 4), ("linear", 5)):
            self.assertEqual(first_sum("YUYV", 4, 1, [17, 128] * 4, 4, 1, ycbcr=YCbCr(mode=mode)), want)
        # below black: exact clamps each pixel, linear only the taxel
        for mode, want in (("exact", 2), ("linear", 0)):
            data = [10, 128, 18, 128]
            self.assertEqual(first_sum("YUYV", 2, 1, data, 2, 1, ycbcr=YCbCr(mode=mode)), want)

    def test_ties_go_up(self) -> None:
        # full-range BT.601, Cb 178, Cr 78: Y + 18.5; Cb 78, Cr 178: Y - 18.5
        for mode in ("exact", "linear"):
            how = YCbCr("bt601", "full", mode)
            self.assertEqual(first_sum("YUV444P", 1, 1, [100, 178, 78], 1, 1, ycbcr=how), 119)
            self.assertEqual(first_sum("YUV444P", 1, 1, [100, 78, 178], 1, 1, ycbcr=how), 82)

    def test_chroma_sites(self) -> None:
        full = YCbCr("bt601", "full")
        # green = Y - 0.344136 (Cb - 128) - 0.714136 (Cr - 128)
        # so Y = 100 and Cr = 228 give 28.59, that is 29
        # width 3: the third pixel's chroma is in the second cell
        uyvy = [128, 100, 128, 100, 128, 100, 228, 0]
        self.assertEqual(first_sum("UYVY", 3, 1, uyvy, 3, 1, ycbcr=full), 229)
        # 3 x 3 NV12 with 4 bytes per line: chroma rows follow at 12
        nv12 = [100, 100, 100, 0] * 3 + [128, 128, 128, 228] + [128, 128, 128, 128]
        self.assertEqual(first_sum("NV12", 3, 3, nv12, 3, 3, bpl=4, ycbcr=full), 7 * 100 + 2 * 29)
        # 3 x 3 YU12 with 3 bytes per line: chroma lines of 2
        yu12 = [100] * 9 + [128] * 4 + [128, 128, 228, 128]
        self.assertEqual(first_sum("YU12", 3, 3, yu12, 3, 3, ycbcr=full), 7 * 100 + 2 * 29)
        self.assertEqual(first_sum("YUV422P", 3, 1, [100] * 3 + [128] * 2 + [128, 228], 3, 1, ycbcr=full), 229)
        self.assertEqual(first_sum("YUV444P", 2, 1, [100] * 2 + [128] * 2 + [228, 128], 2, 1, ycbcr=full), 129)

    def test_limits(self) -> None:
        self.assertRaises(ValueError, GreenSums, FORMATS["Y16"], 200, 200, 400, layout_of(115, 115))
        self.assertRaises(ValueError, GreenSums, FORMATS["GREY"], 9, 9, 8, layout_of(2, 2))
        self.assertRaises(ValueError, GreenSums, FORMATS["GREY"], 9, 9, 9, layout_of(2, 2), 4)
        self.assertEqual(FORMATS["NV12"].min_bytes_per_line(5), 6)
        self.assertEqual(FORMATS["YU12"].frame_bytes(3, 5), 15 + 2 * 3 * 2)

    def test_fourcc(self) -> None:
        self.assertEqual(by_fourcc("Y10").name, "Y10")
        self.assertEqual(by_fourcc("XR24").name, "BGRX32")
        self.assertEqual(by_fourcc("BA10").name, "GRBG10")


class FeatureTest(unittest.TestCase):
    def test_rows_and_columns(self) -> None:
        self.assertEqual(row_and_column_sums(range(25)), [10, 35, 60, 85, 110, 50, 55, 60, 65, 70])

    def test_values(self) -> None:
        features = Features(255, 4)
        # ln(510 / 1020) * 2048 = -1419.57; full scale in all five taxels: ln 5 = 3296.13
        self.assertEqual(features.of([1020, 510, 5100]), [0, -1420, 3296])
        # floor ln(2.5 / 255) * 2048 = -9472.2; R = 10 is the floor, R = 11 above it
        self.assertEqual(features.of([0, 1, 10, 11]), [-9472, -9472, -9472, -9277])

    def test_floors(self) -> None:
        self.assertEqual(floor_feature(255, 1020, 0), round(-2048 * math.log(1020)))
        self.assertEqual(Features(255, 4, 0.0).of([0, 1]), [-14188, -14188])
        self.assertEqual(Features(65535, 169, 0.0).of([0]), [-32768])


class BinningTest(unittest.TestCase):
    def test_counts(self) -> None:
        rates = {"30": 1, "45": 1, "45.001": 2, "59.94": 2, "74.9": 2, "75": 3, "120": 4, "1000": 33, "5": 1}
        for fps, n in rates.items():
            self.assertEqual(frames_added(Fraction(fps)), n, fps)

    def test_groups(self) -> None:
        binner = Binner(3)
        self.assertEqual(binner.lose(5), [])  # before the first frame
        self.assertEqual(binner.frame([1]), [])
        self.assertEqual(binner.frame([2]), [])
        self.assertEqual(binner.frame([4]), [Group((7,), 0)])
        # one of three present: 5 * 3; two present: 7 * 3 / 2 = 10.5, up
        self.assertEqual(binner.lose(2) + binner.frame([5]), [Group((15,), 2)])
        self.assertEqual(binner.frame([3]) + binner.frame([4]) + binner.lose(1), [Group((11,), 1)])
        self.assertEqual(binner.lose(7), [Group(None, 3)] * 2)
        self.assertEqual(binner.frame([1]) + binner.frame([1]), [Group((3,), 1)])


def watch(config: TriggerConfig, steps: list[tuple[int, int]]) -> tuple[Trigger, list[Sample]]:
    """Feeds (feature, count) runs. Feature 0 stands for lost frames."""
    trigger, samples = Trigger(config), []
    for value, count in steps:
        if value == 0:
            samples += trigger.gap(count)
        else:
            samples += [s for s in (trigger.frame(flat(value)) for _ in range(count)) if s]
    return trigger, samples


class TriggerTest(unittest.TestCase):
    config = TriggerConfig()  # m 5, c 10: baseline 0..24, windows from 25

    def test_thresholds(self) -> None:
        frames = [flat(-1000)] * 25
        # eta = -5000; b = 78643 / 65536, margin 13107 / 65536: 1000 less than 5 * 409.6
        base = measure_baseline(self.config, frames, False)
        self.assertEqual(base.etas[0], -5000)
        self.assertEqual(base.thresholds[0], -5000 + 5 * 2048 * Fraction(13107, 65536))
        steep = measure_baseline(TriggerConfig(multiplier=2.0), frames, False)
        self.assertEqual(steep.thresholds[0], 0)
        literal = measure_baseline(TriggerConfig(rule="literal", multiplier=0.5), frames, False)
        self.assertEqual(literal.thresholds[0], -2500)

    def test_threshold_is_not_reached_by_equality(self) -> None:
        config = TriggerConfig(multiplier=2.0)  # eta = -5000, threshold 0
        equal, _ = watch(config, [(-1000, 25), (-4, 1), (1, 4), (-1000, 10)])
        self.assertIsNone(equal.open_sample)
        above, _ = watch(config, [(-1000, 25), (-3, 1), (1, 4), (-1000, 10)])
        self.assertEqual(above.open_sample and above.open_sample.frame, 15)

    def test_quiet(self) -> None:
        def base(config: TriggerConfig, last: int) -> Baseline:
            return measure_baseline(config, [flat(-1000)] * 24 + [flat(last)], False)

        own = TriggerConfig(multiplier=1.0, margin=0.5)  # margin 5 * 1024 = 5120
        self.assertTrue(base(own, -1000 + 5120).quiet)
        self.assertFalse(base(own, -1000 + 5121).quiet)

    def test_sample_and_next_window(self) -> None:
        trigger, samples = watch(self.config, [(DARK, 37), (LIT, 20), (DARK, 120)])
        # the window 35..39 holds three lit frames: X = 25..94, next window at 105
        self.assertEqual([(s.frame, s.frames_filled, s.reliable) for s in samples], [(25, 0, True)])
        self.assertEqual([f[0] for f in samples[0].features].index(LIT), 12)
        self.assertIsNone(trigger.open_sample)

    def test_no_window_before_t_plus_l(self) -> None:
        lit_until = {105: 1, 108: 2}  # windows at 105: needs light in 105..109
        for until, events in lit_until.items():
            _, samples = watch(self.config, [(DARK, 37), (LIT, until - 37), (DARK, 120)])
            self.assertEqual(len(samples), events, until)

    def test_short_gap_is_ordinary(self) -> None:
        _, samples = watch(self.config, [(DARK, 37), (LIT, 20), (0, 7), (DARK, 60)])
        self.assertEqual([(s.frame, s.frames_filled, s.reliable) for s in samples], [(25, 7, True)])
        self.assertEqual([f[0] for f in samples[0].features].count(LIT), 27)

    def test_long_gap_ends_a_sample(self) -> None:
        trigger, samples = watch(self.config, [(DARK, 37), (LIT, 20), (0, 8), (DARK, 60)])
        self.assertEqual(samples, [])
        self.assertEqual([(x.frame, x.frames) for x in trigger.interrupted], [(25, 32)])
        self.assertEqual(trigger.frames, 125)

    def test_windows_start_afresh(self) -> None:
        # gap 27..36; windows 37.., 42..; light from 44 (3 of 5): X from 32, 5 filled
        _, samples = watch(self.config, [(DARK, 27), (0, 10), (DARK, 7), (LIT, 10), (DARK, 80)])
        self.assertEqual([(s.frame, s.frames_filled, s.reliable) for s in samples], [(32, 5, True)])

    def test_gap_in_baseline(self) -> None:
        trigger, samples = watch(self.config, [(DARK, 20), (0, 7), (DARK, 10), (LIT, 3), (DARK, 80)])
        self.assertEqual([(s.frame, s.frames_filled, s.reliable) for s in samples], [(25, 2, True)])
        # long: 20..29, of which 20..24 are baseline; windows from 30
        trigger, samples = watch(self.config, [(DARK, 20), (0, 10), (DARK, 7), (LIT, 3), (DARK, 80)])
        self.assertEqual([(s.frame, s.frames_filled, s.reliable) for s in samples], [(25, 5, False)])
        self.assertTrue(trigger.baseline and trigger.baseline.long_gap and trigger.baseline.quiet)

    def test_ends(self) -> None:
        trigger, samples = watch(self.config, [(DARK, 37), (LIT, 3), (DARK, 48), (0, 7)])
        self.assertEqual([(s.frame, s.frames_filled) for s in samples], [(25, 7)])
        trigger, samples = watch(self.config, [(DARK, 37), (LIT, 3), (DARK, 40)])
        self.assertEqual(trigger.open_sample, Incomplete(25, 55))
        trigger, _ = watch(self.config, [(DARK, 24)])
        self.assertIsNone(trigger.baseline)

    def test_gap_while_resting(self) -> None:
        # c 25: X = 10..79, t + l = 105; a long gap 85..94 does not bring windows forward
        config = TriggerConfig(backtrack=25)
        _, samples = watch(config, [(DARK, 37), (LIT, 3), (DARK, 45), (0, 10), (LIT, 8), (DARK, 100)])
        self.assertEqual([s.frame for s in samples], [10])

    def test_window_is_sample(self) -> None:
        config = TriggerConfig(window=70, backtrack=0)
        trigger, samples = watch(config, [(DARK, 350), (LIT, 69)])
        self.assertEqual(samples, [])
        sample = trigger.frame(flat(LIT))
        self.assertEqual(sample and sample.frame, 350)

    def test_parameters(self) -> None:
        for bad in ({"window": 0}, {"window": 71}, {"backtrack": 26}, {"window": 61}, {"multiplier": 0.9}):
            self.assertRaises(ValueError, TriggerConfig, **bad)
        TriggerConfig(multiplier=0.9, rule="literal")


BASE = measure_baseline(TriggerConfig(), [flat(DARK)] * 25, False)


def sample_of(lit: dict[int, list[int]]) -> Sample:
    """Returns a dark sample in which feature k is lit in the given frames."""
    frames = [tuple(LIT if t in lit.get(k, []) else DARK for k in range(10)) for t in range(70)]
    return Sample(0, tuple(frames), 0, True)


class DriftTest(unittest.TestCase):
    @staticmethod
    def steady(trigger: Trigger, level: int, frames: int) -> list[Sample]:
        return [sample for _ in range(frames) if (sample := trigger.frame([level] * 10)) is not None]

    def test_worked_out_by_hand(self) -> None:
        # m 5, b 1, margin 0.125: 256 units per frame, 6400 of a total.
        trigger = Trigger(TriggerConfig(multiplier=1.0, margin=0.125, follow=16))
        self.steady(trigger, -1000, 25)
        self.steady(trigger, -900, 5)
        # 5 (-4500) + 25000 = 2500, a sixteenth of it is 156 and 4 are left: -25000 + 156
        self.assertEqual(trigger.baseline.totals, (-24844,) * 10)
        self.assertEqual(trigger.baseline.thresholds, (Fraction(-24844 + 6400, 5),) * 10)
        self.steady(trigger, -900, 5)
        # 2344 + 4 = 146 * 16 + 12
        self.assertEqual(trigger.baseline.totals, (-24698,) * 10)
        # Far below: held to 6400, and -6400 + 12 = -400 * 16 + 12
        self.steady(trigger, -9000, 5)
        self.assertEqual(trigger.baseline.totals, (-25098,) * 10)

    def test_after_an_event(self) -> None:
        trigger = Trigger(TriggerConfig(multiplier=1.0, margin=0.125, follow=16))
        self.steady(trigger, -1000, 25)
        self.assertEqual(len(self.steady(trigger, 0, 5) + self.steady(trigger, -1000, 65)), 1)
        before = trigger.baseline
        self.steady(trigger, -900, 35)
        self.assertEqual(trigger.baseline, before)
        self.steady(trigger, -900, 5)
        self.assertEqual(trigger.baseline.totals, (-24844,) * 10)

    def test_constants(self) -> None:
        for follow in (1, 8, 17, 65536, -16):
            self.assertRaises(ValueError, TriggerConfig, follow=follow)


class SpeedTest(unittest.TestCase):
    def ask(self, frames: list[int], fps: int = 30, base: Baseline = BASE, **config):
        return measure_speed(SpeedConfig(**config), base, sample_of({3: frames}), Fraction(fps))

    def test_paper(self) -> None:
        answer = self.ask([10, 30, 48])
        self.assertEqual((answer.first_valid, answer.last_valid, answer.duration), (10, 48, 38))
        self.assertAlmostEqual(answer.mm_s, 101.983, 3)  # 10 ** (113.06 / 56.29)
        self.assertFalse(answer.extrapolated)
        self.assertAlmostEqual(self.ask([10, 29], fps=15).mm_s, answer.mm_s)  # 19 at 15 is 38 at 30
        self.assertTrue(self.ask([10, 49]).extrapolated)  # 97.9
        self.assertTrue(self.ask([10, 30]).extrapolated)  # 212.9

    def test_none(self) -> None:
        self.assertEqual((self.ask([]).why, self.ask([]).duration), ("no_light", None))
        for frames in ([0, 38], [31, 69]):
            answer = self.ask(frames)
            self.assertEqual((answer.why, answer.mm_s), ("cut_off", None))
            self.assertAlmostEqual(answer.bound_mm_s, 101.983, 3)
        bright = measure_baseline(TriggerConfig(), [flat(-6240)] * 25, False)
        dim = measure_baseline(TriggerConfig(), [flat(-6241)] * 25, False)
        self.assertEqual(self.ask([10, 48], base=bright).why, "baseline")
        self.assertIsNone(self.ask([10, 48], base=dim).why)

    def test_above_baseline(self) -> None:
        # exp(-2000/2048) = 0.3766, baseline exp(-2700/2048) = 0.2676: 0.109 above it
        base = measure_baseline(TriggerConfig(), [flat(-2700)] * 25, False)
        more: dict[str, Any] = {"base": base, "threshold_on": "above_baseline"}
        self.assertEqual(self.ask([10, 48], **more).duration, 38)
        self.assertEqual(self.ask([10, 48], threshold=0.108, **more).duration, 38)
        self.assertEqual(self.ask([10, 48], threshold=0.110, **more).why, "no_light")


class DirectionTest(unittest.TestCase):
    def ask(self, rows: Sequence[int | None], columns: Sequence[int | None]):
        times = [*rows, *columns]
        return measure_direction(BASE, sample_of({k: [t] for k, t in enumerate(times) if t is not None}))

    def test_slope(self) -> None:
        self.assertEqual(slope([1, 3, 5, 7, 9]), 2)
        self.assertEqual(slope([None, 3, None, None, 9]), 2)
        self.assertEqual(slope([None, 3, None, None, None]), 0)

    def test_four_ways(self) -> None:
        up, down, still = [10, 18, 26, 34, 42], [42, 34, 26, 18, 10], [26] * 5
        for rows, columns, deg in ((still, up, 0), (still, down, 180), (down, still, 90), (up, still, 270)):
            answer = self.ask(rows, columns)
            self.assertEqual((answer.deg, answer.confidence), (deg, 1.0))

    def test_confidence(self) -> None:
        answer = self.ask([10, 12, 14, 16, 18], [10, 16, 22, 28, 34])  # slopes 2 and 6
        self.assertEqual((answer.deg, answer.row_slope, answer.column_slope), (0, 2.0, 6.0))
        self.assertAlmostEqual(answer.confidence, 0.5)
        self.assertIsNone(self.ask([10, 14, 18, 22, 26], [10, 15, 20, 25, 30]).deg)  # 1 / 9

    def test_unclear(self) -> None:
        self.assertEqual((self.ask([20] * 5, [20] * 5).deg, self.ask([20] * 5, [20] * 5).confidence), (None, 0.0))
        spot = self.ask([None, 20, 28, None, None], [None, 20, 22, None, None])  # 8 and 2
        self.assertEqual((spot.deg, round(spot.confidence, 9)), (None, 0.6))
        self.assertEqual(self.ask([None, None, 20, None, None], [10, 18, 26, 34, 42]).deg, 0)


class PathTest(unittest.TestCase):
    def step_light(self, gains: Sequence[float], first: int = 20) -> np.ndarray:
        # All taxels light up between two frames; at 1e6 mm/s nothing is delayed, and a mm is no time.
        sums = np.zeros((25, 70))
        sums[:, first:] = 1000 * np.array(gains)[:, None]
        return sums

    def test_places(self) -> None:
        self.assertEqual([len(ring) for ring in RINGS], [9, 12, 4])
        self.assertEqual((RINGS[0][0], RINGS[1][:3], RINGS[2]), (6, [1, 2, 3], [0, 4, 20, 24]))
        self.assertEqual(by_lines(5, 0).groups, [[7], [6, 8], [5, 9], [2], [1, 3], [0, 4]])
        self.assertEqual(len(BY_TAXELS.groups) * BY_TAXELS.window, 96)

    def test_edge_and_interpolation(self) -> None:
        self.assertEqual(edge(np.array([0, 0, 8.0, 4])), 1.125)  # a level of 1 between 0 and 8
        self.assertEqual(edge(np.array([1.0, 8])), 0.0)  # 1 is no more than an eighth of 8, but 8 is
        light = np.arange(70.0) * 2
        self.assertEqual(along(light, np.array([-0.5, 2.25, 80.0])).tolist(), [0.0, 4.5, 138.0])

    def test_facts(self) -> None:
        numbers = taxels_along(self.step_light([1.0] * 25), 120 * math.exp(0.5), 22.5)
        assert numbers is not None
        for found, expected in zip(numbers[:4], (0.5, 0.0, 0.25, 0.0), strict=True):
            self.assertAlmostEqual(found, expected)
        fast = taxels_along(self.step_light([1.0] * 25), 1e6, 180)
        assert fast is not None
        self.assertEqual(np.round(fast[:4], 9).tolist(), [1, 1, 1, 1])

    def test_groups_and_spread(self) -> None:
        # The level is crossed at 19.125, where the light is an eighth of what follows, and it stays there: no time passes.
        gains = [2.0 if k in RINGS[2] else 1.0 for k in range(25)]
        numbers = taxels_along(self.step_light(gains), 1e9, 0)
        assert numbers is not None
        mean = (1 + 1 + 2) / 3
        expected = [math.log(light / mean + 1 / 64) for light in (1, 1, 2)] + [math.log(1 / 64)]
        self.assertEqual(np.round(numbers[4:8] - expected, 5).tolist(), [0, 0, 0, 0])  # gains are no spread
        self.assertEqual(np.round(numbers[8:12] - expected, 5).tolist(), [0, 0, 0, 0])  # times a speed of 1

    def test_dark(self) -> None:
        self.assertIsNone(taxels_along(np.full((25, 70), 800), 100, 0))
        self.assertIsNone(sums_along(np.full((10, 70), -9000), np.full(10, -9000 * 25), 25, 100, 0))


if __name__ == "__main__":
    unittest.main()

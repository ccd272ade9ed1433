#!/usr/bin/env python3
"""Tests the line fit, the plots' text, the report's verdicts, and the scenes' text."""

from __future__ import annotations

import math
import tomllib
import unittest

import plots
import report
import speed_law
import svg
from scenes import DIRECTIONS, SPECIMENS, Changes, Event, Slide, event_of, scene_text


class LineTest(unittest.TestCase):
    def test_the_papers_own_durations_give_the_papers_law(self) -> None:
        speeds = speed_law.SPEEDS_MM_S
        line = speed_law.fit_line(speeds, [speed_law.paper_duration(speed) for speed in speeds])
        self.assertAlmostEqual(line.slope, -56.29, 9)
        self.assertAlmostEqual(line.intercept, 151.06, 9)
        self.assertAlmostEqual(line.r2, 1.0, 12)

    def test_by_hand(self) -> None:
        # log10 is 0, 1, 2: slope (3 - 0) / 2, mean 4/3; residuals 1/6, -1/3, 1/6 of a variance sum of 14/3
        line = speed_law.fit_line([1, 10, 100], [0, 1, 3])
        self.assertAlmostEqual(line.slope, 1.5)
        self.assertAlmostEqual(line.intercept, -1 / 6)
        self.assertAlmostEqual(line.r2, 1 - (1 / 6) / (14 / 3))

    def test_no_line(self) -> None:
        self.assertRaises(ValueError, speed_law.fit_line, [100, 100], [1, 2])
        self.assertRaises(ValueError, speed_law.fit_line, [100, 200], [2, 2])

    def test_the_protocol(self) -> None:
        slides = speed_law.protocol_slides("Saw3")
        self.assertEqual(len(slides), 55)
        self.assertEqual([slide.speed_mm_s for slide in slides[:6]], [100] * 5 + [110])
        self.assertEqual([slide.direction_deg for slide in slides[:5]], [0, 90, 180, 270, 0])
        self.assertEqual(slides[-1].speed_mm_s, 200)


class SceneTest(unittest.TestCase):
    def test_text(self) -> None:
        slides = [Slide("Fla0", 100, 0), Slide("Tri4", 150.5, 270)]
        plain = tomllib.loads(scene_text(slides, 7))
        self.assertEqual((plain["seed"], plain["fidelity"]), (7, "taxel"))
        self.assertEqual(set(plain), {"seed", "fidelity", "slide"})
        self.assertEqual(plain["slide"][1], {"specimen": "Tri4", "speed": 150.5, "direction": 270})
        changed = tomllib.loads(scene_text(slides, 7, Changes(104.5, 44.5, 1.7)))
        self.assertEqual((changed["noise"], changed["light"]["afterglow_ms"]), (1.7, 44.5))
        self.assertEqual([slide["length"] for slide in changed["slide"]], [104.5, 104.5])

    def test_event(self) -> None:
        line = {"duration_frames": None, "speed": None, "direction": {"deg": None, "confidence": 0.1}}
        self.assertEqual(event_of(line), Event(None, None, None, None))
        line = {"duration_frames": 28, "speed": {"mm_s": 151.2}, "direction": {"deg": 90}, "sample": [[0.5]]}
        self.assertEqual(event_of(line), Event(28, 151.2, 90, [[0.5]]))

    def test_there_are_ten_specimens_and_four_directions(self) -> None:
        self.assertEqual((len(set(SPECIMENS)), len(set(DIRECTIONS))), (10, 4))


class SvgTest(unittest.TestCase):
    def test_what_is_special_is_escaped(self) -> None:
        self.assertEqual(svg.escaped("a < b & \"c\" 'd'"), "a &lt; b &amp; &quot;c&quot; &#x27;d&#x27;")
        drawing = svg.Drawing(10, 10, "<script>")
        drawing.text(1, 2, "v < 100 & more")
        self.assertIn("<title>&lt;script&gt;</title>", str(drawing))
        self.assertIn(">v &lt; 100 &amp; more</text>", str(drawing))

    def test_numbers(self) -> None:
        found = [svg.number(value) for value in (1, 1.04, -0.04, 2.55, -3.21, 100)]
        self.assertEqual(found, ["1", "1", "0", "2.5", "-3.2", "100"])

    def test_axes(self) -> None:
        axes = svg.Axes(svg.Drawing(100, 100, ""), 10, 20, 50, 40, (100, 200), (0, 1))
        self.assertEqual([axes.at(100, 0), axes.at(200, 1), axes.at(150, 0.5)], [(10, 60), (60, 20), (35, 40)])

    def test_centroid(self) -> None:
        # Dark is half of full scale; frames 5 and 7 are twice as bright as that.
        feature = [math.log(0.5)] * 5 + [0, math.log(0.5), 0, math.log(0.4)]
        light = plots.above_dark(feature)
        self.assertAlmostEqual(max(light), 0.5)
        self.assertEqual(light[8], 0)
        self.assertAlmostEqual(plots.centroid(light), 6)


class ReportTest(unittest.TestCase):
    def test_within(self) -> None:
        self.assertEqual(report.within(-56.9, -56.29, 0.03), "met")
        self.assertEqual(report.within(97.0, 100.0, 0.03), "met")
        self.assertEqual(report.within(-59.1, -56.29, 0.03), "**missed**: off by +4.99 %, goal 3 %")
        self.assertEqual(report.within(-50.0, -56.29, 0.03), "**missed**: off by −11.17 %, goal 3 %")

    def test_at_least(self) -> None:
        self.assertEqual(report.at_least(0.975, 0.975, 3), "met")
        self.assertEqual(report.at_least(0.96, 0.975, 3), "**missed**: 0.9600, goal 0.975")

    def test_all_of(self) -> None:
        self.assertEqual(report.all_of(440, 440), "met")
        self.assertEqual(report.all_of(438, 440), "**missed**: 2 of 440 are not")

    def test_summary(self) -> None:
        self.assertEqual(report.summary([("a", "met"), ("b", "met")]), "2 of 2 numbers that have a goal meet it.")
        mixed = report.summary([("a", "met"), ("b", "**missed**: 1"), ("c", "**missed**: 2")])
        self.assertEqual(mixed, "1 of 3 numbers that have a goal meet it. Missed: b; c.")

    def test_interval(self) -> None:
        # 20 numbers, half 0 and half 2: deviation sqrt(20 / 19)
        interval = report.interval_of([0.0, 2.0] * 10)
        half = 2.093 * math.sqrt(20 / 19) / math.sqrt(20)
        self.assertAlmostEqual(interval.mean, 1)
        self.assertAlmostEqual(interval.high - interval.mean, half)
        self.assertAlmostEqual(interval.mean - interval.low, half)

    def test_numbers(self) -> None:
        self.assertEqual(report.fixed(-1.234, 2), "−1.23")
        self.assertEqual(report.fixed(-0.001, 2, sign=True), "0.00")
        self.assertEqual(report.percent(0.0123, 1, sign=True), "+1.2 %")

    def test_table(self) -> None:
        text = report.table(["a", "b"], [["x|y", "1"]], [1])
        self.assertEqual(text, "| a | b |\n| --- | ---: |\n| x\\|y | 1 |")


if __name__ == "__main__":
    unittest.main()

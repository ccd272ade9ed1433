#!/usr/bin/env python3
"""Tests the fits and intervals that pages publish."""

from __future__ import annotations

import math
import unittest

import report
import speed_law


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


class ReportTest(unittest.TestCase):
    def test_interval(self) -> None:
        # 20 numbers, half 0 and half 2: deviation sqrt(20 / 19)
        interval = report.interval_of([0.0, 2.0] * 10)
        half = 2.093 * math.sqrt(20 / 19) / math.sqrt(20)
        self.assertAlmostEqual(interval.mean, 1)
        self.assertAlmostEqual(interval.high - interval.mean, half)
        self.assertAlmostEqual(interval.mean - interval.low, half)


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/env python3
"""Tests the intervals that pages publish."""

from __future__ import annotations

import math
import unittest

import report


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

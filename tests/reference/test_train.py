#!/usr/bin/env python3
"""Tests that what tests a model is never what trained it. Needs only NumPy."""

from __future__ import annotations

import unittest

import numpy as np

import shipped_slides
import splits
from scenes import SPECIMENS


class DeployedTest(unittest.TestCase):
    def setUp(self) -> None:
        grid = [(speed, run, name) for speed in range(100, 201, 10) for run in range(10) for name in SPECIMENS * 2]
        speed, run, specimen = zip(*grid, strict=True)
        self.speed, self.run_of, self.specimen = np.array(speed), np.array(run), np.array(specimen)

    def masks(self, seed: int) -> splits.Deployed:
        return splits.deployed(self.speed, self.run_of, self.specimen, 2, seed)

    def test_every_slide_is_of_one_kind(self) -> None:
        for seed in range(20):
            found = self.masks(seed)
            each = np.array([found.train, found.seen, found.speeds, found.runs, found.both])
            np.testing.assert_array_equal(each.sum(axis=0), 1)

    def test_what_is_new_is_not_trained(self) -> None:
        for seed in range(20):
            found = self.masks(seed)
            speeds, seen_runs = set(self.speed[found.train]), set(self.run_of[found.train])
            self.assertEqual((len(speeds), len(seen_runs)), (9, 8))
            self.assertEqual(set(self.speed[found.seen]), speeds)
            self.assertEqual(set(self.run_of[found.seen]), seen_runs)
            self.assertEqual(set(self.run_of[found.speeds]), seen_runs)
            self.assertEqual(set(self.speed[found.runs]), speeds)
            for mask in (found.speeds, found.both):
                self.assertTrue(speeds.isdisjoint(self.speed[mask]))
                self.assertEqual(len(set(self.speed[mask])), 2)
            for mask in (found.runs, found.both):
                self.assertTrue(seen_runs.isdisjoint(self.run_of[mask]))
                self.assertEqual(len(set(self.run_of[mask])), 2)


class ShippedTest(unittest.TestCase):
    def setUp(self) -> None:
        self.train = shipped_slides.training_sweeps()
        self.check, self.test = shipped_slides.check_sweeps(), shipped_slides.test_sweeps()

    def test_no_slide_and_no_sensor_is_of_two_kinds(self) -> None:
        each = self.train + self.check + self.test
        seeds = [seed for sweep in each for seed in range(sweep.seed, sweep.seed + 10 * sweep.slides)]
        self.assertEqual(len(set(seeds)), len(seeds))
        self.assertEqual(len({sweep.unit for sweep in each}), len(each))


if __name__ == "__main__":
    unittest.main()

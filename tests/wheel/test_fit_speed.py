"""The fit of the speed law: as NumPy fits a line, as the command reads it, and what is wrong is named."""

from __future__ import annotations

import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import wstac
from conftest import WSTAC, command

SWEEP = {
    "specimens": ["Saw3", "Fla0"],
    "speeds": [100, 110, 120, 130, 140, 150, 160, 170, 180, 190, 200],
    "slides": 55,
}
SPEEDS = np.array([100.0, 100, 110, 110])


@pytest.fixture(scope="module")
def data() -> dict[str, Any]:
    return wstac.dataset(SWEEP)


def alike(found: float, expected: float) -> None:
    assert math.isclose(found, expected, rel_tol=1e-9), f"{found} for {expected}"


def test_as_numpy_fits_a_line(data: dict[str, Any]) -> None:
    kept = (data["duration"] >= 0) & data["reliable"]
    x, duration = np.log10(data["speed"][kept]), data["duration"][kept].astype(float)
    (slope, intercept), covariance = np.polyfit(x, duration, 1, cov=True)
    errors, fit = np.sqrt(np.diag(covariance)), wstac.fit_speed(data)
    alike(fit.slope, -slope)
    alike(fit.intercept, intercept)
    alike(fit.slope_error, errors[0])
    alike(fit.intercept_error, errors[1])
    alike(fit.r2, np.corrcoef(x, duration)[0, 1] ** 2)
    residuals = duration - np.polyval([slope, intercept], x)
    alike(fit.deviation_frames, math.sqrt(residuals @ residuals / (len(x) - 2)))
    read = 10 ** ((duration - intercept) / slope)
    alike(fit.speed_error, math.sqrt(np.mean((read / 10**x - 1) ** 2)))
    for answer, frames in zip(fit.answers_mm_s, (67, 1)):
        alike(answer, 10 ** ((frames - intercept) / slope))
    assert (fit.range_mm_s, fit.speeds) == ((100, 200), 11)
    assert len(fit.frames) + sum(fit.left_out.values()) == 110
    # The simulated sensor is fitted to the paper's law: 151.06 − 56.29 log10 v, R² 0.99.
    assert abs(fit.slope - 56.29) < 5 and fit.r2 > 0.97


def test_the_papers_law_is_found_again() -> None:
    speed = np.arange(100.0, 210, 10)
    fit = wstac.fit_speed({"speed": speed, "duration": 151.06 - 56.29 * np.log10(speed)})
    alike(fit.intercept, 151.06)
    alike(fit.slope, 56.29)
    assert fit.r2 > 1 - 1e-12 and fit.speed_error < 1e-9
    np.testing.assert_allclose(fit.speed(fit.duration(speed)), speed)
    # At 15 frames per second a frame lasts twice as long.
    slow = wstac.fit_speed({"speed": speed, "duration": fit.frames / 2}, fps=15)
    alike(slow.slope, 56.29)
    alike(slow.answers_mm_s[0], float(fit.speed(2 * 67)))


def test_a_file_of_the_command_gives_a_table_that_it_takes(data: dict[str, Any], tmp_path: Path) -> None:
    sweep, file, table = tmp_path / "sweep.toml", tmp_path / "slides.npz", tmp_path / "speed.toml"
    sweep.write_text("\n".join(f"{key} = {value!r}".replace("'", '"') for key, value in SWEEP.items()))
    subprocess.run([WSTAC, "dataset", sweep, "-o", file], check=True, capture_output=True)
    fit = wstac.fit_speed(file)
    assert fit.toml() == wstac.fit_speed(data).toml() == wstac.fit_speed([str(file)]).toml()
    assert len(wstac.fit_speed([file, data]).frames) == 2 * len(fit.frames)
    table.write_text(fit.toml(threshold=0.0475, threshold_on="absolute"))
    event = command("run", "scene:Saw3@150,seed=5", "--config", str(table), "--json")[0]
    assert abs(event["speed"]["mm_s"] - 150) < 15 and not event["speed"]["extrapolated"]


def test_the_range_holds_every_speed() -> None:
    speed = 80.1 + 13.3 * np.arange(9)
    fit = wstac.fit_speed({"speed": speed, "duration": 150 - 50 * np.log10(speed)})
    low, high = (np.float32(text) for text in fit.toml().split("[")[-1].split("]")[0].split(", "))
    assert low <= speed[0] and high >= speed[-1] and high - low < np.ptp(speed) + 1e-4


def test_slides_that_are_left_out_are_counted_by_their_reason() -> None:
    speed = [100.0, math.nan, 120, 130, 140, 150]
    fit = wstac.fit_speed({"speed": speed, "duration": [38, 37, -1, 35, 33, 30], "reliable": [1, 1, 1, 0, 1, 1]}, fps=25)
    assert fit.left_out == {"no_speed": 1, "no_duration": 1, "unreliable": 1}
    np.testing.assert_allclose(fit.frames, 1.2 * np.array([38, 33, 30]))


def test_the_figure_has_the_slides_and_the_law(data: dict[str, Any]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    fit = wstac.fit_speed(data)
    slides, law = fit.plot().get_lines()
    assert len(slides.get_xdata()) == len(fit.frames)  # type: ignore[arg-type]
    np.testing.assert_allclose(law.get_ydata(), fit.duration(law.get_xdata()))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arrays", "part"),
    [
        ({"speed": SPEEDS}, "array duration: missing, found speed"),
        ({"duration": SPEEDS}, "array speed: missing, found duration"),
        ({"speed": SPEEDS, "duration": np.arange(4)}, "4 slides at 2 different speeds (0 left out), expected at least 3"),
        ({"speed": SPEEDS[:2], "duration": np.arange(2)}, "2 slides at 1 different speed ("),
        ({"speed": SPEEDS, "duration": np.full(4, -1)}, "0 slides at 0 different speeds (4 left out)"),
        ({"speed": np.full(4, np.nan), "duration": np.arange(4)}, "0 slides at 0 different speeds (4 left out)"),
        ({"speed": SPEEDS, "duration": np.arange(3)}, "array duration: has 3 elements, expected 4 as speed has"),
        ({"speed": np.array([1, 2, np.inf]), "duration": np.arange(3)}, "element 2 is inf, expected mm/s above 0"),
        ({"speed": np.array([1.0, -2]), "duration": np.ones(2)}, "array speed: element 1 is -2"),
        ({"speed": SPEEDS, "duration": np.array([1, 2, 3, np.nan])}, "element 3 is nan, expected frames"),
        ({"speed": SPEEDS, "duration": np.array([1, 2, 3, -2])}, "array duration: element 3 is -2"),
        ({"speed": np.arange(1, 5), "duration": np.full(4, 30)}, "all slides last equally long"),
        ({"speed": np.arange(1, 5), "duration": np.arange(4)}, "durations do not fall with speed"),
        ({"speed": SPEEDS[:, None], "duration": SPEEDS}, "array speed: shape [4, 1], expected one dimension"),
        ({"speed": SPEEDS.astype(str), "duration": SPEEDS}, "array speed: type <U32, expected numbers"),
        ({"speed": SPEEDS, "duration": SPEEDS, "fps": np.array(0.0)}, "array fps: 0, expected frames per second above 0"),
    ],
)
def test_what_is_wrong_is_named(arrays: dict[str, Any], part: str, tmp_path: Path) -> None:
    path = tmp_path / "wrong.npz"
    np.savez(path, **arrays)
    for data, name in ((arrays, "data"), (path, str(path))):
        with pytest.raises(wstac.Error) as caught:
            wstac.fit_speed(data)
        assert str(caught.value).startswith(f"{name}: ") and part in str(caught.value)


def test_rates_and_files_that_do_not_fit_are_named(tmp_path: Path) -> None:
    speed = np.arange(100.0, 210, 10)
    at = {fps: {"speed": speed, "duration": 300 - speed, "fps": np.array(fps)} for fps in (20.0, 30.0)}
    with pytest.raises(wstac.Error, match="array fps: 20 frames per second, but fps is 30; leave fps out"):
        wstac.fit_speed(at[20.0], fps=30)
    with pytest.raises(wstac.Error, match="30 frames per second, expected 20, as the sets before have"):
        wstac.fit_speed([at[20.0], at[30.0]])
    with pytest.raises(FileNotFoundError, match="none.npz: no such file or folder"):
        wstac.fit_speed(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("no data set")
    with pytest.raises(wstac.Error, match="text.npz: cannot be read, expected a .npz file"):
        wstac.fit_speed(tmp_path / "text.npz")

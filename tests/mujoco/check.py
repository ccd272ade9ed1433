"""Checks wstac.mujoco in MuJoCo itself: the light is that of the same scene, slides of meshes and primitives are
answered, a gripper stops a part that slips, and steps are fast.

    check.py [--keep]    --keep also writes docs/pictures/gripper.svg and gripper.webp
"""

from __future__ import annotations

import contextlib
import io
import math
import os
import re
import sys
import tempfile
import time
from pathlib import Path

# Before MuJoCo is imported: without a screen.
os.environ.setdefault("MUJOCO_GL", "egl")

import film
import mujoco
import numpy as np
import wstac
import wstac.mujoco
from scenes import Slide

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "wstac-python/examples"), str(ROOT / "tests/pictures")]
import draw  # noqa: E402
import mujoco_gripper  # noqa: E402

# Limits: largest difference of light in % of the brightest taxel, error of a speed in % and of a direction in degrees,
# way of a part that slips in mm, and the fewest steps per second of a processor.
MOST_LIGHT, MOST_SPEED, MOST_DIRECTION, MOST_SLIP, FEWEST_STEPS = 5.0, 2.0, 1.5, 15.0, 15_000
PICTURE = ROOT / "docs/pictures/gripper.svg"
FILM, MOST_FILM = PICTURE.with_suffix(".webp"), 300_000

LONGER = {"whisker": {"length_mm": 9, "dome_degrees": 0}}
MIDDLE = {"whisker": {"present": "middle"}}

LIGHTS = [
    ("Fla0", 100, 0),
    ("Saw3", 150, 90),
    ("Tri4", 200, 30),
    ("Sin2", 60, 210),
    ("ball12", 120, 45),
    ("rod 6", 150, 200),
]
SLIDES = [
    ("Fla0", 100, 0),
    ("Fla0", 50, 135),
    ("Saw3", 150, 90),
    ("Saw3", 400, 0),
    ("Saw3", 30, 300),
    ("Tri4", 200, 270),
    ("Tri4", 120, 30),
    ("Sin2", 60, 180),
    ("Sin2", 300, 45),
    ("ball12", 100, 70),
    ("rod 6", 150, 250),
]


def rubbing() -> None:
    """Two sensors on bodies that move and turn see how fast the other body passes them, each by itself."""
    xml = """<mujoco><option gravity="0 0 0"/><worldbody>
      <body name="table">
        <joint name="turn" axis="0 0 1"/><geom type="box" size="1 1 0.01" contype="0" conaffinity="0"/></body>
      <body name="left" pos="-0.3 0 0.014" euler="0 0 30">
        <joint name="left" type="slide" axis="1 0 0"/><geom size="0.01" pos="0 0 0.1"/></body>
      <body name="right" pos="0.2 0 0.014" euler="0 0 -70">
        <joint name="right" type="slide" axis="1 0 0"/><geom size="0.01" pos="0 0 0.1"/></body>
    </worldbody></mujoco>"""
    spec = xml
    for name in ("left", "right"):
        spec = wstac.mujoco.attach(spec, name, name=f"{name} sensor")
    model = spec.compile()
    data = mujoco.MjData(model)
    sensors = [wstac.mujoco.Sensor(model, data, f"{name} sensor") for name in ("left", "right")]
    for turn, left, right in ((0.0, 0.1, -0.2), (0.0, 0.0, 0.3), (0.5, 0.0, 0.1)):
        data.qpos[:] = 0
        data.qvel[:] = turn, left, right
        mujoco.mj_forward(model, data)
        mujoco.mj_sensorPos(model, data)
        for sensor, body, speed in zip(sensors, ("left", "right"), (left, right)):
            # The velocity of the body less that of the table at each whisker.
            places = data.site(f"{body} sensor_0").xpos + (
                data.site_xpos[sensor._sites] - data.site_xpos[sensor._sites[0]]
            )
            along = data.body(body).xmat.reshape(3, 3)[:, 0] * speed
            table = np.cross((0, 0, turn), places)
            expected = 1e3 * np.linalg.norm((along - table)[:, :2], axis=1)
            found = np.broadcast_to(sensor._rubbing(12), 25)
            assert np.abs(found - expected).max() < 1e-6 * expected.max() + 1e-9, f"{found}, expected {expected}"
            assert np.allclose(1e3 * sensor._distance, 4 - 0.1)
    print("two sensors see how fast a table passes each")


def lights() -> None:
    """The light of a slide in MuJoCo is that in wstac-scene."""
    for kind, speed, direction in LIGHTS:
        slide = Slide(kind, speed, direction, noise=0)
        own, theirs = slide.run(), slide.scene.taxels
        # Without the black level, which is 1 of 255.
        brightest = theirs.max() - 1 / 255
        worst = 100 * np.abs(own - theirs).max() / brightest
        print(
            f"{kind:6} {speed:4} mm/s {direction:4}°  light within {worst:.2f} % of the brightest, {brightest:.2f}",
            flush=True,
        )
        assert brightest > 0.05 and worst <= MOST_LIGHT, f"light is off by {worst:.2f} %, expected at most {MOST_LIGHT}"


def slides() -> None:
    """Slides over a noisy sensor are slides, with their speed and direction."""
    errors, turns = [], []
    for seed, (kind, speed, direction) in enumerate(SLIDES):
        slide = Slide(kind, speed, direction, seed=seed)
        slide.run()
        [event] = slide.events
        print(f"{kind:6} {speed:4} mm/s {direction:4}°  {event.contact}", end="")
        assert event.contact == "slide" and event.speed and event.direction and event.direction.deg is not None, event
        errors.append(100 * abs(event.speed.mm_s / speed - 1))
        turns.append(abs((event.direction.deg - direction + 180) % 360 - 180))
        named = event.texture and event.texture.specimen
        print(f" {event.speed.mm_s:6.1f} mm/s {event.direction.deg:6.1f}°  {named or 'unknown'}", flush=True)
    print(f"speed off by {np.mean(errors):.2f} % on average, {max(errors):.2f} at worst", end="; ")
    print(f"direction by {np.mean(turns):.2f}°, {max(turns):.2f}° at worst")
    assert max(errors) <= MOST_SPEED and max(turns) <= MOST_DIRECTION


def refusals() -> None:
    """What cannot be a sensor is refused in words."""
    xml = '<mujoco><worldbody><body name="a"><geom size=".01"/></body></worldbody></mujoco>'
    spec = wstac.mujoco.attach(xml, "a", pos=(0, 0, 0.1))
    model = spec.compile()
    data = mujoco.MjData(model)
    sensor = wstac.mujoco.Sensor(model, data)
    # Their light is not that of the whiskers that a scene has by default, though they are at the same places.
    longer = mujoco.MjModel.from_xml_string(wstac.mujoco.attach(xml, "a", scene=LONGER).to_xml())
    assert wstac.mujoco.Sensor(longer, mujoco.MjData(longer), scene=LONGER).skin.length_mm == 9
    fresh = mujoco.MjSpec.from_string(xml)
    for call, said in [
        (lambda: wstac.mujoco.attach(xml, "b"), "has no body 'b', expected one of world, a"),
        (lambda: wstac.mujoco.attach("none.xml", "a"), "none.xml: no such file"),
        (lambda: wstac.mujoco.attach(spec, "a"), "has a body 'wstac' already"),
        (lambda: wstac.mujoco.attach(fresh, "a", stop_mm=5), "stop_mm is 5, expected above 0 and below 5.0"),
        (lambda: wstac.mujoco.attach(fresh, "a", scene=MIDDLE), 'scene: [whisker] present is "middle", expected "all"'),
        (lambda: wstac.mujoco.attach(fresh, "a", pos=(0, 0)), "pos is (0, 0), expected 3 numbers"),
        (lambda: wstac.mujoco.attach(fresh, "a", quat=(math.nan, 0, 0, 0)), "quat is (nan, 0, 0, 0), expected 4"),
        (lambda: wstac.mujoco.Sensor(model, data, "left"), "has no sensor 'left'"),
        (lambda: wstac.mujoco.Sensor(model, data, scene={"whisker": {"pitch_mm": 3}}), "are not those of scene"),
        (lambda: wstac.mujoco.Sensor(longer, mujoco.MjData(longer)), "are not those of scene"),
        (sensor.step, "time went from 0.0 to 0.0 s, expected a step ahead"),
    ]:
        try:
            call()
        except wstac.Error as error:
            assert said in str(error), f"{error}, expected {said}"
        else:
            raise AssertionError(f"nothing is refused, expected {said}")
    # What was refused has changed nothing, and a missing file is what it is everywhere.
    wstac.mujoco.attach(fresh, "a").compile()
    with contextlib.suppress(FileNotFoundError):
        wstac.mujoco.attach("none.xml", "a")
    mujoco.mj_step(model, data)
    assert sensor.step() is None
    mujoco.mj_resetData(model, data)
    sensor.reset()
    print("what cannot be used is refused")


def page() -> None:
    """The program of the page runs, for a shorter time."""
    [program] = re.findall(r"```python\n(.*?)```", (ROOT / "docs/PHYSICS.md").read_text(), re.DOTALL)
    assert "data.time < 10" in program
    printed = io.StringIO()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), contextlib.redirect_stdout(printed):
        Path("gripper.xml").write_text(mujoco_gripper.MODEL)
        exec(program.replace("data.time < 10", "data.time < 1"), {})
    assert len(printed.getvalue().split("None []")) > 29, printed.getvalue()
    print("the program of the page runs")


def gripper(filmed: film.Film) -> mujoco_gripper.Run:
    """The gripper of the example keeps the part by its slips alone, and loses it blind."""
    blind, held = mujoco_gripper.run(listens=False), mujoco_gripper.run(watch=filmed.take)
    first = held.slips[0]
    load = round(mujoco_gripper.LOAD_S * 30)
    at = held.moved_mm[first.frame]
    print(
        f"gripper: slip known at frame {first.frame} after {at:.1f} mm, held after {held.moved_mm[-1]:.1f} mm", end="; "
    )
    print(f"blind it moves by {blind.moved_mm[-1]:.0f} mm")
    # It holds until there is a load, slips, and is held again for the last second.
    assert len(held.slips) == 1 and first.frame > load and max(held.moved_mm[load : load + 10]) < 0.5
    assert at < MOST_SLIP / 2 and held.moved_mm[-1] < MOST_SLIP and held.moved_mm[-1] - held.moved_mm[-30] < 0.5
    assert blind.moved_mm[-1] > 3 * MOST_SLIP
    return held


def write_film(filmed: film.Film, run: mujoco_gripper.Run, file: Path) -> None:
    """Writes the film of the gripper: the part stays in the picture, the whiskers glow, and it is small."""
    example, slip = mujoco_gripper, run.slips[0].frame / 30
    told = [
        (0, "open"),
        (example.CLOSE_S, "grips"),
        (example.LIFT_S, "lifts"),
        (example.LOAD_S, "a load pulls the part down"),
    ]
    known = f"slip known after {run.moved_mm[run.slips[0].frame]:.1f} mm\\: grips harder"
    filmed.write(file, [*told, (slip, known), (slip + 1.2, f"held after {run.moved_mm[-1]:.1f} mm")])
    pictures = np.stack(filmed.pictures).astype(np.int16)
    # The part is orange, and what glows is green.
    orange = ((pictures[..., 0] - pictures[..., 2]) > 60).sum((1, 2))
    green = ((pictures[..., 1] - pictures[..., 0]) > 60).sum((1, 2))
    size = file.stat().st_size
    print(f"film: {len(pictures)} pictures, {size} bytes; the part has {orange.min()} pixels or more")
    assert orange.min() > 500 and green.max() > 500 and 0 < size <= MOST_FILM


def drawn(run: mujoco_gripper.Run) -> str:
    """Returns the gripper's run as a film: the whiskers, the sum of their light, and how far the part has moved."""
    first, last, every = 30, len(run.light) - 30, 3
    frames = list(range(first, last, every))
    film = draw.film_of(len(frames), every / 30)
    x = lambda frame: 260 + 640 * (frame - first) / (frames[-1] - first)
    sums = [float(np.sqrt(run.light[frame].sum())) for frame in range(first, last)]
    moved = run.moved_mm[first:last]
    points = {
        draw.GREEN: [f"{x(first + k):.0f},{140 - 70 * value / max(sums):.1f}" for k, value in enumerate(sums)],
        draw.INK: [f"{x(first + k):.0f},{150 + 70 * value / max(moved):.1f}" for k, value in enumerate(moved)],
    }
    slip = run.slips[0]
    heads = [(20, "25 whiskers"), (260, "their light (root), and the way of the part in the hand")]
    parts = [draw.text(at, 34, head, 15, weight="bold") for at, head in heads]
    still = min(range(len(frames)), key=lambda number: abs(frames[number] - slip.frame))
    parts += draw.taxels(20, 50, [run.light[frame].tolist() for frame in frames], still, film)
    for color, line in points.items():
        parts.append(f"<polyline points='{' '.join(line[::2])}' fill='none' stroke='{color}' stroke-width='2'/>")
    covers = [f"{x(frame) + 2:.0f}" for frame in frames]
    cover = f"y='64' width='700' height='166' fill='{draw.PAPER}'"
    parts.append(f"<rect x='{covers[-1]}' {cover}>{film('x', covers)}</rect><rect x='904' {cover}/>")
    example = mujoco_gripper
    moments = {
        "grip": example.CLOSE_S * 30,
        "lift": example.LIFT_S * 30,
        "load": example.LOAD_S * 30,
        "slip": slip.frame,
    }
    for name, moment in moments.items():
        parts.append(f"<path d='M{x(moment):.0f} 66V228' stroke='{draw.CALM}' stroke-dasharray='4 3'/>")
        parts.append(draw.text(round(x(moment)), 60, name, 13, "middle"))
    parts.append(draw.text(20, 258, "python mujoco_gripper.py", 12, fill=draw.CALM))
    known, still_mm = run.moved_mm[slip.frame], run.moved_mm[-1]
    said = f"the slip is known after {known:.1f} mm, and the part is held after {still_mm:.1f} mm"
    parts.append(draw.text(900, 258, said, 12, "end", draw.CALM))
    return draw.svg(920, 274, "A gripper in MuJoCo lifts a part, feels it slip and grips harder", parts)


def speed() -> None:
    """A step of MuJoCo with the sensor, measured in this process's own time while a mesh slides."""
    rates = []
    for _ in range(3):
        slide = Slide("Saw3", 150, 30)
        start, steps = time.process_time(), 0
        slide.run()
        steps = round(slide.data.time / slide.model.opt.timestep)
        rates.append(steps / (time.process_time() - start))
    each = ", ".join(f"{rate:.0f}" for rate in rates)
    print(f"{max(rates):.0f} steps per second of a processor, sensor and answers included ({each})")
    assert max(rates) >= FEWEST_STEPS, f"expected {FEWEST_STEPS}"


def main() -> None:
    print(f"MuJoCo {mujoco.__version__}, wstac {wstac.__version__}")
    refusals()
    rubbing()
    page()
    lights()
    slides()
    filmed = film.Film()
    held = gripper(filmed)
    picture = drawn(held)
    with tempfile.TemporaryDirectory() as folder:
        write_film(filmed, held, Path(folder) / "film.webp")
        new_film = (Path(folder) / "film.webp").read_bytes()
        if sys.argv[1:] == ["--keep"]:
            PICTURE.write_text(picture)
            FILM.write_bytes(new_film)
    kept_film = FILM.read_bytes()
    there, new = film.form_of(kept_film), film.form_of(new_film)
    # Another machine draws a little differently, and equal pictures are one.
    is_same = there[:2] == new[:2] and abs(there[2] - new[2]) <= 5 and abs(there[3] - new[3]) < 70
    assert is_same and len(kept_film) <= MOST_FILM, (
        f"{FILM}: has {there} and {len(kept_film)} bytes, expected {new}; ci/long mujoco --keep writes it"
    )
    kept = draw.says(PICTURE.read_text())
    assert kept == draw.says(picture), (
        f"{PICTURE}: says {kept}, expected {draw.says(picture)}; ci/long mujoco --keep writes it"
    )
    speed()


if __name__ == "__main__":
    main()

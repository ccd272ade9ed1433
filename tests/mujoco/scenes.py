"""The same slide in MuJoCo and in wstac-scene: specimens as meshes and primitives that move over a sensor."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import wstac
import wstac.mujoco
from numpy.typing import NDArray

# As the defaults of a scene: overlap of the crests with the middle whisker, length of a block and slope of its ends.
OVERLAP_MM, LENGTH_MM, EDGE = 3.0, 104.5, np.tan(np.radians(72))
# Narrower than a scene's, and wider than the sensor at any angle. Below the surface there is a base.
WIDTH_MM, BASE_MM = 60.0, 6.0
STEP_S = 5e-4


def drop(kind: str, behind: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns how far the top of a specimen is below its crests, in mm, so far behind its leading end (SPEC 8)."""
    depth = float(kind[3:])
    period = 2 * depth
    if kind.startswith("Fla"):
        texture = np.zeros_like(behind)
    elif kind.startswith("Saw"):
        texture = depth * (1 - behind % period / period)
    elif kind.startswith("Tri"):
        texture = depth * (1 - np.abs(1 - 2 * (behind % period) / period))
    else:
        # |sinc| around each crest, four half widths of which are a period. numpy's has a factor of pi.
        texture = depth * (1 - np.abs(np.sinc(4 * ((behind + period / 2) % period - period / 2) / period)))
    return np.maximum.reduce([texture, OVERLAP_MM - EDGE * behind, OVERLAP_MM - EDGE * (LENGTH_MM - behind)])


def block(kind: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Returns vertices in m and faces of a specimen: crests at z = 0, the leading end at x = 0, the rest behind it."""
    fine = np.arange(0, LENGTH_MM, 0.05)
    period = 2 * float(kind[3:]) or LENGTH_MM
    # Both sides of a saw's tooth, which falls at once.
    teeth = np.arange(0, LENGTH_MM, period)
    behind = np.unique(np.clip(np.concatenate([fine, teeth, teeth - 1e-6, [LENGTH_MM]]), 0, LENGTH_MM))
    top = drop(kind, behind)
    # Places on a straight line need no vertex.
    slope = np.diff(top) / np.diff(behind)
    kept = np.concatenate([[True], np.abs(np.diff(slope)) > 1e-6, [True]])
    behind, top = behind[kept], top[kept]
    count = len(behind)
    sides, base = (-WIDTH_MM / 2, WIDTH_MM / 2), np.full(count, BASE_MM)
    rows = [np.column_stack([-behind, np.full(count, y), -z]) for y in sides for z in (top, base)]
    vertices = np.concatenate(rows) * 1e-3
    right, right_base, left, left_base = (np.arange(count) + k * count for k in range(4))
    faces = []
    # Four sides, each counterclockwise from outside, and both ends.
    for a, b in ((right, left), (right_base, right), (left, left_base), (left_base, right_base)):
        faces += [(b[k], a[k], a[k + 1]) for k in range(count - 1)] + [
            (b[k], a[k + 1], b[k + 1]) for k in range(count - 1)
        ]
    for k, turn in ((0, 1), (count - 1, -1)):
        corners = (right_base[k], left_base[k], left[k], right[k])[::turn]
        faces += [corners[:3], (corners[0], corners[2], corners[3])]
    return vertices, np.array(faces)


def first_mm(half: float, direction: float) -> float:
    """Returns the place along the motion, from the middle, of the first whisker within this distance of the path."""
    whiskers = wstac.Skin().whiskers
    c, s = np.cos(np.radians(direction)), np.sin(np.radians(direction))
    along, across = whiskers[:, 0] * c + whiskers[:, 1] * s, whiskers[:, 1] * c - whiskers[:, 0] * s
    return float(along[np.abs(across) <= half + 1e-9].min())


def model(kind: str, direction: float) -> mujoco.MjModel:
    """Returns a sensor whose whiskers point down, and a specimen below it that slides to its x at no force.

    At qpos 0 its leading end is below the middle whisker. `kind` is "Saw3", or "ball12" or "rod 6" of so many mm.
    """
    option = f'<option timestep="{STEP_S}" gravity="0 0 0"/>'
    spec = wstac.mujoco.attach(f'<mujoco>{option}<worldbody><body name="holder"/></worldbody></mujoco>', "holder")
    turned = np.radians(direction) / 2
    crest = (OVERLAP_MM - wstac.Skin().length_mm) * 1e-3
    body = spec.worldbody.add_body(name="specimen", pos=(0, 0, crest), quat=(np.cos(turned), 0, 0, np.sin(turned)))
    body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(1, 0, 0))
    free = {"contype": 0, "conaffinity": 0}
    if kind[:4] in ("ball", "rod "):
        radius = float(kind[4:]) / 2e3
        if kind.startswith("ball"):
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(radius, 0, 0), pos=(-radius, 0, -radius), **free)
        else:
            lying = (np.sqrt(0.5), np.sqrt(0.5), 0, 0)
            size = (radius, WIDTH_MM / 2e3, 0)
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=size, pos=(-radius, 0, -radius), quat=lying, **free)
    else:
        vertices, faces = block(kind)
        # Vertices stay where they are: the geom's frame is moved back from the mesh's own.
        spec.add_mesh(name="specimen", uservert=vertices.ravel(), userface=faces.ravel())
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="specimen", **free)
    return spec.compile()


class Slide:
    """A slide in MuJoCo, from a scene's first frame to its last."""

    def __init__(self, kind: str, speed: float, direction: float, **scene: Any) -> None:
        shape, size = kind[:4].strip(), kind[4:]
        what = {"shape": shape, "diameter": float(size)} if shape in ("ball", "rod") else {"specimen": kind}
        self.sensor_keys = {"seed": 0, **scene}
        keys = {**what, "speed": speed, "direction": direction, "fidelity": "taxel", **self.sensor_keys}
        self.scene = wstac.simulate(keys)
        self.model = model(kind, direction)
        self.data = mujoco.MjData(self.model)
        given = {"scene": self.sensor_keys, "models": "builtin:taxel-path-svm"}
        self.sensor = wstac.mujoco.Sensor(self.model, self.data, **given)
        half = float(size) / 2 if shape == "ball" else np.inf
        start = self.scene.truth[0].start_s
        # Rangefinders see the state that a step starts with.
        self.data.qpos[0] = (first_mm(half, direction) - speed * (start - STEP_S)) * 1e-3
        self.speed = speed * 1e-3
        self.events: list[wstac.Event] = []

    def run(self) -> NDArray[np.float32]:
        """Runs it, and returns the taxels of each frame."""
        taxels = []
        while len(taxels) < len(self.scene.taxels):
            self.data.qvel[0] = self.speed
            mujoco.mj_step(self.model, self.data)
            if frame := self.sensor.step():
                taxels.append(self.sensor.pipeline.taxels)
                self.events += [frame.event] if frame.event else []
        return np.array(taxels)

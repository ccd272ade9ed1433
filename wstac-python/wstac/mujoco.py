"""A sensor on a body of a MuJoCo model: `pip install wstac[mujoco]`.

    import mujoco, wstac.mujoco

    model = wstac.mujoco.attach("arm.xml", "finger", pos=(0, 0, 0.03)).compile()
    data = mujoco.MjData(model)
    sensor = wstac.mujoco.Sensor(model, data)
    while data.time < 10:
        mujoco.mj_step(model, data)
        frame = sensor.step()
        if frame and frame.event:
            print(frame.event.contact, frame.event.speed)

A rangefinder along each whisker reads how deep the whisker is in the primitives and meshes of other bodies.
Light and answers follow from that. What the whiskers do to the object is not modeled: they neither drag it nor push it
back.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from ._answers import Event
from ._errors import NotFoundError
from ._pipeline import Pipeline
from ._skin import Skin
from ._wstac import Error

try:
    import mujoco  # type: ignore[import, unused-ignore]
except ImportError as _error:
    raise ImportError("mujoco: is not installed\nhelp: pip install wstac[mujoco]") from _error

__all__ = ["Frame", "Sensor", "attach"]


def attach(
    model: Union[mujoco.MjSpec, str, os.PathLike[str]],
    body: str,
    *,
    pos: Sequence[float] = (0, 0, 0),
    quat: Sequence[float] = (1, 0, 0, 0),
    name: str = "wstac",
    stop_mm: Optional[float] = None,
    scene: Optional[Mapping[str, Any]] = None,
) -> mujoco.MjSpec:
    """Puts a sensor on a body of a model, and returns the model's `MjSpec`, to be compiled.

    `model` is an `MjSpec`, which is changed, the path of a file, or XML. `pos` in m and `quat` place the base of the
    middle whisker on `body`, such as on its surface. The sensor's axes are those of its picture: x to the right, y up,
    and the whiskers point to -z. What `body` itself has before them counts as touched. Several sensors have several
    names.

    With `stop_mm`, a plate of the sensor stops objects that are so deep in the middle whisker, such as 3: it is the
    geom NAME_stop of 1 g, whose contact and friction are MuJoCo's. `scene` is that of `Skin`.

    Raises `Error` if the model has no such body, or a sensor of this name, or if `scene` leaves out whiskers. The
    model has not changed then. Raises `NotFoundError` if there is no such file.
    """
    if isinstance(model, mujoco.MjSpec):
        spec = model
    elif isinstance(model, str) and model.lstrip().startswith("<"):
        spec = mujoco.MjSpec.from_string(model)
    elif not Path(model).exists():
        raise NotFoundError(f"{os.fspath(model)}: no such file, expected a model of MuJoCo")
    else:
        spec = mujoco.MjSpec.from_file(os.fspath(model))
    there = spec.body(body)
    if there is None:
        names = ", ".join(of.name for of in spec.bodies if of.name)
        raise Error(f"model: has no body {body!r}, expected one of {names}")
    if spec.body(name) is not None:
        raise Error(f"model: has a body {name!r} already, expected another name for the sensor")
    skin = Skin(scene)
    if np.isnan(skin.whiskers).any():
        raise Error('scene: [whisker] present is "middle", expected "all"')
    if stop_mm is not None and not 0 < stop_mm < skin.length_mm:
        raise Error(f"stop_mm is {stop_mm}, expected above 0 and below {skin.length_mm}, the length of a whisker")
    for key, numbers, count in (("pos", pos, 3), ("quat", quat, 4)):
        if np.shape(numbers) != (count,) or not np.isfinite(np.asarray(numbers, np.float64)).all():
            raise Error(f"{key} is {numbers}, expected {count} numbers")
    sensor = there.add_body(name=name, pos=pos, quat=quat)
    spec.add_numeric(name=f"{name}_whiskers", data=_whiskers(skin))
    for taxel, place in enumerate(_starts(skin)):
        # A rangefinder looks along z of its site: half a turn about x.
        sensor.add_site(name=f"{name}_{taxel}", pos=place, quat=(0, 1, 0, 0), size=(3e-4, 3e-4, 3e-4))
        kind, site = mujoco.mjtSensor.mjSENS_RANGEFINDER, mujoco.mjtObj.mjOBJ_SITE
        spec.add_sensor(name=f"{name}_{taxel}", type=kind, objtype=site, objname=f"{name}_{taxel}", intprm=(1, 0, 0))
    if stop_mm is not None:
        half = (skin.length_mm - stop_mm) / 2e3
        side = float(np.abs(skin.whiskers[:, :2]).max()) * 1.25e-3
        box = mujoco.mjtGeom.mjGEOM_BOX
        sensor.add_geom(name=f"{name}_stop", type=box, size=(side, side, half), pos=(0, 0, -half), mass=1e-3)
    return spec


# The dome's outer bases are behind the middle one, and may be within the body. So rangefinders start before the middle
# one, by so many mm that the body's surface is not seen.
_START_MM = 0.1


def _whiskers(skin: Skin) -> NDArray[np.float64]:
    """Returns what a model keeps of the whiskers, in mm: their length, places and how far the dome lowers them."""
    return np.append(skin.length_mm, skin.whiskers)


def _starts(skin: Skin) -> NDArray[np.float64]:
    """Returns the places of the rangefinders in m."""
    return np.column_stack([skin.whiskers[:, :2], np.full(25, -_START_MM)]) * 1e-3


@dataclass(frozen=True)
class Frame:
    """A frame of the sensor's camera."""

    light: NDArray[np.float64]
    """Mean light of each base, float64 (25,), in fractions of full scale."""
    sums: NDArray[np.uint32]
    """Taxel sums with the camera's noise, uint32 (25,)."""
    event: Optional[Event]
    """The event that the frame completed, or None. Other answers are in `Sensor.pipeline`, such as its `slips`."""


class Sensor:
    """A sensor that `attach` has put on a body, in a compiled model.

    `scene` is that of `Skin`, and `options` are those of `Pipeline`, such as `models`, `motion` or `record`.
    Raises `Error` if the model has no sensor of this name, or one with other whiskers than those of `scene`.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        name: str = "wstac",
        *,
        scene: Optional[Mapping[str, Any]] = None,
        **options: Any,
    ) -> None:
        self._model, self._data, self._scene, self._options = model, data, scene, options
        sites = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, f"{name}_{taxel}") for taxel in range(25)]
        sensors = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, f"{name}_{taxel}") for taxel in range(25)]
        if min(*sites, *sensors) < 0:
            raise Error(f"model: has no sensor {name!r}, expected one of wstac.mujoco.attach")
        first = int(model.sensor_adr[sensors[0]])
        if (model.sensor_adr[sensors] != first + np.arange(25)).any():
            raise Error(f"model: the rangefinders of {name!r} are not in a row, expected those of wstac.mujoco.attach")
        self._sites, self._body = sites, int(model.site_bodyid[sites[0]])
        self._distance = data.sensordata[first : first + 25]
        self._geom = np.zeros(1, np.int32)
        self._twists = np.zeros((2, 6))
        self.reset()
        kept = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, f"{name}_whiskers")
        # In a file of a model, numbers may have six digits.
        if kept < 0 or not np.allclose(model.numeric(kept).data, _whiskers(self.skin), rtol=1e-5, atol=1e-5):
            raise Error(f"model: the whiskers of {name!r} are not those of scene; give that of wstac.mujoco.attach")
        self._reach = self.skin.length_mm - self.skin.whiskers[:, 2] - _START_MM
        self._x, self._y = self.skin.whiskers[:, 0].copy(), self.skin.whiskers[:, 1].copy()

    def reset(self) -> None:
        """Begins anew with whiskers at rest and another pipeline, as after `mujoco.mj_resetData`."""
        self.skin: Skin = Skin(self._scene)
        """The whiskers."""
        self.pipeline: Pipeline = self.skin.pipeline(**self._options)
        """What takes the frames: its `slips`, `contact_ends` and `motions` are answers besides the events."""
        self._time = self._data.time

    def step(self) -> Optional[Frame]:
        """Takes the state after each `mujoco.mj_step`. Returns the frame that ends, or None if none does.

        Raises `Error` if the time went back, or by more than a camera's frame ahead.
        """
        seconds = self._data.time - self._time
        if seconds <= 0:
            found = f"time went from {self._time} to {self._data.time} s"
            raise Error(f"data: {found}, expected a step ahead\nhelp: call reset() after mj_resetData")
        overlap = self._reach - 1e3 * self._distance
        # Nothing is there: the distance is -1.
        overlap[self._distance < 0] = -1
        speed = self._rubbing(int(overlap.argmax())) if overlap.max() > 0 else 0.0
        light = self.skin.step(np.maximum(overlap, -1.0), speed, seconds)
        self._time = self._data.time
        if light is None:
            return None
        sums = self.skin.sums(light)
        return Frame(light, sums, self.pipeline.push_sums(sums))

    def _rubbing(self, deepest: int) -> Union[float, NDArray[np.float64]]:
        """Returns the speeds over the tips, in mm/s, of the body that the deepest whisker is in."""
        model, data, site = self._model, self._data, self._sites[deepest]
        turned = data.xmat[self._body]
        base = data.site_xpos[site]
        mujoco.mj_ray(model, data, base, -turned[2::3], None, True, self._body, self._geom)
        if self._geom[0] < 0:
            return 0.0
        velocities = []
        (x, y, z), (xx, yx, zx, xy, yy, zy, xz, yz, zz) = data.xpos[self._body].tolist(), turned.tolist()
        for body, twist in zip((int(model.geom_bodyid[self._geom[0]]), self._body), self._twists):
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, twist, 0)
            (a, b, c, u, v, w), (px, py, pz) = twist.tolist(), data.xpos[body].tolist()
            dx, dy, dz = x - px, y - py, z - pz
            velocities.append((u + b * dz - c * dy, v + c * dx - a * dz, w + a * dy - b * dx, a, b, c))
        u, v, w, a, b, c = (of - own for of, own in zip(*velocities))
        # Along the sensor's axes, in mm/s, and turns about its z.
        across, up = 1e3 * (u * xx + v * xy + w * xz), 1e3 * (u * yx + v * yy + w * yz)
        turn = a * zx + b * zy + c * zz
        if abs(turn) < 1e-9:
            return math.hypot(across, up)
        speeds: NDArray[np.float64] = np.hypot(across - turn * self._y, up + turn * self._x)
        return speeds

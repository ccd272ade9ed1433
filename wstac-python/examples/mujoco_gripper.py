"""A gripper in MuJoCo that lifts a part, feels it slip, and grips harder: python mujoco_gripper.py [--blind]

The load on the part grows until its friction is too small. With --blind the gripper does not listen, and loses it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import mujoco  # type: ignore[import, unused-ignore]
import wstac.mujoco

MODEL = """
<mujoco>
  <option timestep="0.001" cone="elliptic" impratio="20" noslip_iterations="5" integrator="implicitfast"/>
  <default><geom friction="0.5"/></default>
  <worldbody>
    <geom name="table" type="plane" size="1 1 0.1"/>
    <body name="hand" pos="0 0 0.08">
      <joint name="lift" type="slide" axis="0 0 1" damping="20"/>
      <geom type="box" size="0.06 0.02 0.01" pos="0 0 0.06" mass="0.5"/>
      <body name="left" pos="-0.05 0 0">
        <joint name="left" type="slide" axis="1 0 0" damping="20"/>
        <geom name="left" type="box" size="0.005 0.012 0.02" mass="0.1"/>
      </body>
      <body name="right" pos="0.05 0 0">
        <joint name="right" type="slide" axis="-1 0 0" damping="20"/>
        <geom name="right" type="box" size="0.005 0.012 0.02" mass="0.1"/>
      </body>
    </body>
    <body name="part" pos="0 0 0.06">
      <freejoint/>
      <geom name="part" type="box" size="0.015 0.02 0.06" mass="0.2"/>
    </body>
  </worldbody>
  <actuator>
    <position name="lift" joint="lift" kp="2000"/>
    <motor name="left" joint="left"/>
    <motor name="right" joint="right"/>
  </actuator>
</mujoco>"""

CLOSE_S, LIFT_S, LOAD_S, END_S = 1.2, 2.0, 3.2, 7.0
GRIP_N, HARDER_N, MOST_LOAD_N, LOAD_N_S = 5.0, 10.0, 4.5, 1.5


@dataclass
class Run:
    """What happened."""

    slips: list[wstac.Slip] = field(default_factory=list)
    light: list[Any] = field(default_factory=list)
    """The light of the whiskers in every frame."""
    moved_mm: list[float] = field(default_factory=list)
    """How far the part has moved down in the hand since it was lifted, in every frame."""


def run(listens: bool = True, watch: Callable[[Any, Any, Any], None] = lambda model, data, frame: None) -> Run:
    """Closes the gripper, lifts, and loads the part. `watch` sees every frame."""
    # The whiskers point to the left, -x: a half turn of their z about the y axis. The picture's x points down.
    spec = wstac.mujoco.attach(MODEL, "right", pos=(-0.005, 0, 0), quat=(0.5**0.5, 0, 0.5**0.5, 0), stop_mm=3)
    model = spec.compile()
    data = mujoco.MjData(model)
    sensor = wstac.mujoco.Sensor(model, data, scene={"seed": 1})
    done, part, hand, start = Run(), data.body("part"), data.body("hand"), 0.0
    grip = GRIP_N
    while data.time < END_S:
        data.actuator("left").ctrl = data.actuator("right").ctrl = grip if data.time > CLOSE_S else -0.5
        data.actuator("lift").ctrl = min(max(data.time - LIFT_S, 0.0), 1.0) * 0.05
        data.body("part").xfrc_applied[2] = -min(max(data.time - LOAD_S, 0.0) * LOAD_N_S, MOST_LOAD_N)
        mujoco.mj_step(model, data)
        frame = sensor.step()
        if frame is None:
            continue
        watch(model, data, frame)
        height = part.xpos[2] - hand.xpos[2]
        if data.time < LOAD_S:
            start = height
        done.light.append(frame.light)
        done.moved_mm.append(1e3 * (start - height))
        if len(sensor.pipeline.slips) > len(done.slips):
            done.slips.append(sensor.pipeline.slips[-1])
            if listens and data.time > LOAD_S:
                grip = HARDER_N
    return done


if __name__ == "__main__":
    seen = run("--blind" not in sys.argv)
    for slip in seen.slips:
        moved = seen.moved_mm[slip.frame]
        print(f"frame {slip.frame}: slip since frame {slip.onset_frame}; the part has moved by {moved:.1f} mm")
    print(f"at the end it has moved by {seen.moved_mm[-1]:.1f} mm")

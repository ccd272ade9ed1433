"""A film of the gripper: MuJoCo's own picture of it, its 25 whiskers, and what happens."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

# Pixels, the side of a whisker in them, and of 30 frames per second every second one.
WIDTH, HEIGHT, SIDE, EVERY = 512, 288, 26, 2
COLORS = {
    "left": (0.45, 0.5, 0.55, 1),
    "right": (0.45, 0.5, 0.55, 1),
    "part": (0.95, 0.6, 0.2, 1),
    "table": (0.93, 0.93, 0.9, 1),
}


class Film:
    """Takes a picture of every second frame. What happens is told below it."""

    def __init__(self) -> None:
        self.pictures: list[np.ndarray] = []
        self._renderer: mujoco.Renderer | None = None
        self._count = 0

    def take(self, model: mujoco.MjModel, data: mujoco.MjData, frame: Any) -> None:
        self._count += 1
        if self._count % EVERY:
            return
        if self._renderer is None:
            for name, color in COLORS.items():
                model.geom(name).rgba = color
            model.vis.headlight.ambient, model.vis.headlight.diffuse = (0.45,) * 3, (0.5,) * 3
            self._renderer = mujoco.Renderer(model, HEIGHT, WIDTH)
            self._camera = mujoco.MjvCamera()
            self._camera.lookat, self._camera.distance = (0.05, 0, 0.096), 0.31
            self._camera.azimuth, self._camera.elevation = 78, -12
        self._renderer.update_scene(data, self._camera)
        picture = self._renderer.render().copy()
        # The sky.
        picture[(picture == 0).all(-1)] = 235
        whole = 5 * (SIDE + 3) + 9
        picture[16 : 16 + whole, WIDTH - whole - 16 : WIDTH - 16] = 10
        # The square root, so that faint light is seen.
        light = np.sqrt(np.clip(np.asarray(frame.light).reshape(5, 5) / 0.12, 0, 1))
        for row, column in np.ndindex(5, 5):
            top, left = 22 + row * (SIDE + 3), WIDTH - 5 * (SIDE + 3) - 19 + column * (SIDE + 3)
            picture[top : top + SIDE, left : left + SIDE] = 20 + 235 * light[row, column] * np.array((0.15, 1, 0.3))
        self.pictures.append(picture)

    def write(self, file: Path, told: list[tuple[float, str]]) -> None:
        """Writes an animated WebP. `told` are texts from a time in s on."""
        ends = [start for start, _ in told[1:]] + [1e3]
        style = f"drawtext=font=DejaVu Sans:fontsize=19:fontcolor=0x1f2328:x=20:y=h-34"
        texts = [
            f"{style}:text='{text}':enable='between(t,{start:.2f},{end - 0.01:.2f})'"
            for (start, text), end in zip(told, ends)
        ]
        drawn = ",".join(["drawbox=y=ih-46:h=46:w=iw:color=white:t=fill", *texts])
        raw = f"-f rawvideo -pix_fmt rgb24 -s {WIDTH}x{HEIGHT} -r {30 // EVERY} -i -".split()
        small = "-c:v libwebp_anim -quality 45 -compression_level 6 -loop 0".split()
        content = b"".join(picture.tobytes() for picture in self.pictures)
        subprocess.run(["ffmpeg", "-loglevel", "error", *raw, "-vf", drawn, *small, file], check=True, input=content)


def form_of(content: bytes) -> tuple[int, int, int, int]:
    """Returns width and height of an animated WebP, its number of pictures, and how long it lasts, in ms."""
    assert content[:4] == b"RIFF" and content[8:16] == b"WEBPVP8X", content[:16]
    number = lambda at: int.from_bytes(content[at : at + 3], "little")
    at, count, lasts = 12, 0, 0
    while at < len(content):
        if content[at : at + 4] == b"ANMF":
            # Behind the chunk's head of 8 bytes: x, y, width, height and duration, of 3 bytes each.
            count, lasts = count + 1, lasts + number(at + 20)
        size = int.from_bytes(content[at + 4 : at + 8], "little")
        at += 8 + size + size % 2
    return number(24) + 1, number(27) + 1, count, lasts

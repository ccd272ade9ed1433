"""A WSTac sensor as a camera of LeRobot, of the type "wstac".

LeRobot finds it by its name: `--robot.cameras='{tactile: {type: wstac, source: /dev/video0, show: taxels}}'`.
"""

import threading
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import wstac
from lerobot.cameras.camera import Camera
from lerobot.cameras.configs import CameraConfig


@CameraConfig.register_subclass("wstac")
@dataclass(kw_only=True)
class WstacCameraConfig(CameraConfig):
    """A source of `wstac.open`; `show` is "picture", or "taxels": 5 × 5 squares of `gain` times the light."""

    source: str = "/dev/video0"
    show: str = "picture"
    gain: float = 4.0

    def __post_init__(self) -> None:
        if self.show not in ("picture", "taxels"):
            raise ValueError(f'show is {self.show!r}, expected "picture" or "taxels"')


class WstacCamera(Camera):
    """Frames of the sensor as RGB, uint8 (height, width, 3); taxels by default 80 × 80."""

    def __init__(self, config: WstacCameraConfig) -> None:
        super().__init__(config)
        self.config = config
        self._stream: wstac.Stream | None = None
        self._thread: threading.Thread | None = None
        self._news = threading.Condition()
        self._frame, self._at, self._is_new, self._error = None, 0.0, False, None

    @property
    def is_connected(self) -> bool:
        return self._stream is not None

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        return []

    def connect(self, warmup: bool = True) -> None:
        if self._stream is not None:
            raise ConnectionError(f"{self.config.source}: is connected, expected a call of disconnect before")
        size = (self.width, self.height) if self.width and self.height and self.config.show == "picture" else None
        self._stream = wstac.open(self.config.source, fps=self.fps, size=size, paced=True)
        if self.config.show == "picture":
            self.width, self.height = self._stream.size
        else:
            self.width, self.height = self.width or 80, self.height or 80
        self.fps = self.fps or round(self._stream.fps)
        self._frame, self._is_new, self._error = None, False, None
        self._thread = threading.Thread(target=self._follow, args=(self._stream,), daemon=True)
        self._thread.start()
        try:
            if warmup:
                self.async_read(10_000)
        except BaseException:
            self.disconnect()
            raise

    def _follow(self, stream: wstac.Stream) -> None:
        error: Exception = RuntimeError(f"{self.config.source}: has ended")
        try:
            for frame in stream.frames(pictures=self.config.show == "picture"):
                picture = self._picture(frame, stream)
                with self._news:
                    self._frame, self._at, self._is_new = picture, time.monotonic(), True
                    self._news.notify_all()
        except Exception as raised:
            error = raised
        with self._news:
            self._error = error
            self._news.notify_all()

    def _picture(self, frame: wstac.Frame, stream: wstac.Stream) -> np.ndarray:
        code = stream.format.rstrip()
        if self.config.show == "taxels":
            if np.isnan(frame.taxels).any():
                raise ValueError(f"{self.config.source}: sends no taxels, expected a camera, a recording or a scene")
            light = np.clip(frame.taxels * self.config.gain * 255, 0, 255).astype(np.uint8)
            plane = light[np.ix_(np.arange(self.height) * 5 // self.height, np.arange(self.width) * 5 // self.width)]
        elif code in ("RGB3", "BGR3"):
            return frame.picture if code == "RGB3" else np.ascontiguousarray(frame.picture[..., ::-1])
        elif code in ("GREY", "YUYV", "UYVY"):
            plane = {"GREY": frame.picture, "YUYV": frame.picture[..., 0], "UYVY": frame.picture[..., -1]}[code]
        else:
            raise ValueError(
                f'{self.config.source}: format {code}, expected GREY, RGB3, BGR3, YUYV or UYVY; or show = "taxels"'
            )
        return np.repeat(plane[..., None], 3, axis=2)

    def _wait(self, timeout_ms: float, fresh: bool) -> np.ndarray:
        if self._stream is None:
            raise ConnectionError(f"{self.config.source}: is not connected")
        with self._news:
            self._news.wait_for(
                lambda: self._error or (self._is_new if fresh else self._frame is not None), timeout_ms / 1e3
            )
            if self._frame is None or (fresh and not self._is_new):
                raise self._error or TimeoutError(f"{self.config.source}: no frame within {timeout_ms:g} ms")
            self._is_new = False
            return self._frame

    def read(self, color_mode: Any = None) -> np.ndarray:
        return self.async_read(10_000)

    def async_read(self, timeout_ms: float = 200) -> np.ndarray:
        return self._wait(timeout_ms, fresh=True)

    def read_latest(self, max_age_ms: int = 500) -> np.ndarray:
        frame = self._wait(0, fresh=False)
        if (time.monotonic() - self._at) * 1e3 > max_age_ms:
            raise TimeoutError(f"{self.config.source}: the last frame is older than {max_age_ms} ms")
        return frame

    def disconnect(self) -> None:
        if self._stream is not None:
            self._stream.close()
            # Its end is not that of the next connection.
            if self._thread is not None:
                self._thread.join()
            self._stream = self._thread = None

"""The video of a set of `wstac.lerobot`, which ffmpeg writes."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from ._stream import Stream
from ._wstac import Error

PICTURE = "observation.images.tactile"
NAME = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
# Size of a file above which the next episode has the next one, and files in a folder: those of LeRobot.
MOST_MB, CHUNK = 200, 1000
# Pictures of an episode that its statistics are made of, and the width above which pixels are left out.
_SAMPLED, _SAMPLED_WIDTH = 100, 150
# The names that ffmpeg has for formats of frames.
_PIXELS = {
    **{"GREY": "gray", "RGB3": "rgb24", "BGR3": "bgr24", "YUYV": "yuyv422", "UYVY": "uyvy422", "RGBP": "rgb565le"},
    **{"NV12": "nv12", "NV21": "nv21", "NV16": "nv16", "YU12": "yuv420p", "422P": "yuv422p", "Y10": "gray10le"},
    **{"Y12": "gray12le", "Y16": "gray16le", "XR24": "bgr0", "AR24": "bgra", "BGR4": "bgr0", "XB24": "rgb0"},
    **{"AB24": "rgba", "RGGB": "bayer_rggb8", "GRBG": "bayer_grbg8", "GBRG": "bayer_gbrg8", "BA81": "bayer_bggr8"},
}


class Video:
    """Videos of one camera: several episodes in a file."""

    def __init__(self, folder: Path, fps: int, size: Optional[tuple[int, int]]) -> None:
        self._folder, self._fps, self._wanted = folder, fps, size
        self.size: Optional[tuple[int, int]] = size
        self.number, self.frames = 0, 0
        self._ffmpeg: Optional[subprocess.Popen[bytes]] = None
        self._errors = tempfile.TemporaryFile()
        self._form: Optional[tuple[str, int, int]] = None

    @property
    def path(self) -> Path:
        return self._folder / NAME.format(
            video_key=PICTURE, chunk_index=self.number // CHUNK, file_index=self.number % CHUNK
        )

    def _file_size(self) -> int:
        # ffmpeg makes the file at its first frames.
        return self.path.stat().st_size if self.path.exists() else 0

    def begin(self, source: str, stream: Stream) -> None:
        """Begins an episode: in the same file, if that is not too large and has frames of the same form."""
        code, (width, height) = stream.format.rstrip(), stream.size
        if self._ffmpeg and (self._form != (code, width, height) or self._file_size() > MOST_MB << 20):
            self.end()
            self.number, self.frames = self.number + 1, 0
        size = self._wanted or (width, height)
        if size[0] % 2 or size[1] % 2:
            raise Error(f"{source}: frames of {size[0]}x{size[1]}, expected even numbers\nhelp: scale them with --size")
        if self.size not in (None, size):
            raise Error(
                f"{source}: frames of {size[0]}x{size[1]}, expected those of the first episode\n"
                "help: scale them with --size"
            )
        if code not in _PIXELS:
            raise Error(f"{source}: format {code}, expected one of {', '.join(_PIXELS)}")
        self.size, self._form = size, (code, width, height)
        if self._ffmpeg is None:
            self._start(source)

    def _start(self, source: str) -> None:
        assert self._form and self.size
        code, width, height = self._form
        self.path.parent.mkdir(parents=True, exist_ok=True)
        given = f"-f rawvideo -pix_fmt {_PIXELS[code]} -s {width}x{height} -r {self._fps} -i pipe:0"
        # A key frame each second frame, as LeRobot has it: training reads frames in any order.
        made = f"-vf scale={self.size[0]}:{self.size[1]}:flags=area -c:v libx264 -preset veryfast"
        made += " -crf 10 -g 2 -bf 0 -pix_fmt yuv420p"
        command = ["ffmpeg", "-nostdin", "-v", "error", *given.split(), *made.split(), str(self.path)]
        try:
            self._ffmpeg = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=self._errors)
        except FileNotFoundError:
            raise Error(f"{source}: ffmpeg is not installed\nhelp: sudo apt install ffmpeg") from None

    def add(self, picture: NDArray[Any]) -> None:
        """Writes a frame."""
        assert self._ffmpeg and self._ffmpeg.stdin
        try:
            self._ffmpeg.stdin.write(np.ascontiguousarray(picture).data.cast("B"))
        except BrokenPipeError:
            self.end()
            raise Error(f"{self.path}: ffmpeg ended early, without an error; write the video again") from None
        self.frames += 1

    def end(self) -> None:
        """Ends the file."""
        if self._ffmpeg is None:
            return
        self._ffmpeg.communicate()
        code, self._ffmpeg = self._ffmpeg.returncode, None
        if code:
            raise self._failed(self.path, code)

    def _failed(self, path: Path, code: int) -> Error:
        self._errors.seek(0)
        said = " ".join(self._errors.read().decode(errors="replace").split())
        return Error(f"{path}: ffmpeg failed with exit code {code}, expected 0: {said or 'it said nothing'}")

    def abandon(self) -> None:
        """Stops the program that writes it."""
        if self._ffmpeg is not None:
            self._ffmpeg.kill()
            self._ffmpeg.communicate()

    def sampled(self, lengths: list[int], path: Path) -> Iterator[NDArray[np.uint8]]:
        """Yields some pictures of each episode of a file, as training decodes them: (n, height, width, 3)."""
        assert self.size
        width, height = self.size
        step = max(1, width // _SAMPLED_WIDTH)
        command = ["ffmpeg", "-nostdin", "-v", "error", "-i", str(path)]
        command += ["-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"]
        decoder = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self._errors)
        assert decoder.stdout
        try:
            for length in lengths:
                wanted = set(np.linspace(0, length - 1, min(length, _SAMPLED)).round().astype(int).tolist())
                pictures = []
                for number in range(length):
                    raw = decoder.stdout.read(width * height * 3)
                    if len(raw) < width * height * 3:
                        if code := decoder.wait():
                            raise self._failed(path, code)
                        raise Error(f"{path}: ends at frame {number} of an episode, expected {length}: write it again")
                    if number in wanted:
                        pictures.append(np.frombuffer(raw, np.uint8).reshape(height, width, 3)[::step, ::step])
                yield np.stack(pictures)
            if decoder.stdout.read(1):
                raise Error(f"{path}: has more frames than its episodes, expected {sum(lengths)}: write it again")
            if code := decoder.wait():
                raise self._failed(path, code)
        finally:
            decoder.kill()
            decoder.stdout.close()
            decoder.wait()

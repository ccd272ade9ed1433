"""Calls tests/peers/frames from Python."""

import ctypes

import numpy as np


class Native:
    """A stream of frames of one format, as wstac sums them."""

    # In the library's order.
    FORMATS = (
        "GREY", "YUYV linear", "YUYV exact", "NV12 linear", "NV12 exact", "YU12 linear", "YU12 exact", "RGB24", "Y16", "Y10", "RGB565", "RGGB8",
    )  # fmt: skip

    def __init__(self, library, name, width, height, taxel, corners):
        self.name, self.library = name, library
        library.wstac_open.restype = ctypes.c_void_p
        library.wstac_frame_bytes.restype = ctypes.c_size_t
        library.wstac_read.restype = ctypes.c_uint64
        layout = np.array([(taxel, taxel), *corners], dtype=np.uint16)
        number = self.FORMATS.index(name)
        self.stream = ctypes.c_void_p(library.wstac_open(number, width, height, ctypes.c_void_p(layout.ctypes.data)))
        if not self.stream:
            raise ValueError(f"no stream of {name}, {width} x {height}, taxels of {taxel}")
        self.frame_bytes = library.wstac_frame_bytes(self.stream)
        self.out = np.zeros(10, dtype=np.int16)
        self.to = ctypes.c_void_p(self.out.ctypes.data)

    def _at(self, made, frames):
        if made.nbytes < frames * self.frame_bytes:
            raise ValueError(f"{made.nbytes} bytes, expected {frames} frames of {self.frame_bytes}")
        return ctypes.c_void_p(made.ctypes.data)

    def features(self, made, frames, count):
        """Returns the features of the last of `count` frames, which are taken in turn from `frames` frames."""
        at = self._at(made, frames)
        self.library.wstac_features(self.stream, at, ctypes.c_size_t(frames), ctypes.c_size_t(count), self.to)
        return self.out

    def read(self, made, frames, count, pixel, ahead):
        """Reads the bytes under the taxels of as many frames. `ahead` prefetches cache lines."""
        at = self._at(made, frames)
        numbers = (ctypes.c_size_t(number) for number in (frames, count, pixel))
        return self.library.wstac_read(self.stream, at, *numbers, ctypes.c_bool(ahead))

    @staticmethod
    def instruction_set(library):
        library.wstac_instruction_set.restype = ctypes.c_char_p
        return library.wstac_instruction_set().decode()

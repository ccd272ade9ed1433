"""A USB camera with gray frames and MJPEG, for the kernel's uvcvideo: usb_camera.py SOCKET FOLDER.

It speaks the protocol of usbredir to the virtual machine, and to the guest USB Video Class 1.0 with one bulk endpoint. Its JPEG
pictures have the faults of cameras that are sold: each of ODD changes every fifth picture. FOLDER/log has a line for each picture,
and for each control that the guest sets; FOLDER/clean has the pictures without faults.
"""

from __future__ import annotations

import re
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from slide_frames import HEIGHT, WIDTH, frames

RATE = 5
"""A slow machine needs up to 80 ms for a picture, and may stall for as long."""
TRUNCATED = 120
"""The number of a picture that ends in its middle."""
ENDPOINT, PACKET, PAYLOAD = 0x81, 512, 16384


def extra_byte(picture: bytes) -> bytes:
    """Puts a byte before restart markers, as Logitech's C270 and C910 do before one."""
    start = picture.index(b"\xff\xda")
    return picture[:start] + re.sub(rb"\xff[\xd0-\xd7]", lambda marker: b"\0" + marker[0], picture[start:])


def without_tables(picture: bytes) -> bytes:
    """Leaves out the Huffman tables, which are then those of the standard's annex K.3."""
    start = picture.index(b"\xff\xc4")
    while picture[start : start + 2] == b"\xff\xc4":
        length = struct.unpack(">H", picture[start + 2 : start + 4])[0]
        picture = picture[:start] + picture[start + 2 + length :]
    return picture


ODD: list[Callable[[bytes], bytes]] = [
    lambda picture: picture,
    extra_byte,
    lambda picture: picture[:-2],
    lambda picture: picture + bytes(700),
    without_tables,
]


def encode(folder: Path) -> None:
    """Writes the frames as JPEG with restart markers."""
    folder.mkdir(parents=True)
    command = ["ffmpeg", "-v", "error", "-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{WIDTH}x{HEIGHT}", "-r", str(RATE), "-i", "-"]
    command += ["-pix_fmt", "yuvj422p", "-c:v", "mjpeg", "-huffman", "default", "-q:v", "2", "-threads", "4", "-thread_type", "slice"]
    subprocess.run([*command, folder / "%03d.jpg"], check=True, input=np.stack(list(frames())).tobytes())


def clean_pictures(folder: Path) -> list[bytes]:
    """Returns the encoded pictures."""
    return [path.read_bytes() for path in sorted(folder.iterdir())]


def as_sent(clean: list[bytes]) -> list[bytes]:
    """Returns the pictures with the faults."""
    sent = [ODD[number % len(ODD)](picture) for number, picture in enumerate(clean)]
    sent[TRUNCATED] = clean[TRUNCATED][: len(clean[TRUNCATED]) // 2]
    return sent


def descriptor(*fields: int | bytes) -> bytes:
    """Returns a descriptor: its length and its bytes."""
    body = b"".join(field if isinstance(field, bytes) else bytes([field]) for field in fields)
    return bytes([len(body) + 1]) + body


def half(value: int) -> bytes:
    """Returns 16 bits."""
    return struct.pack("<H", value)


def word(*values: int) -> bytes:
    """Returns 32 bits for each value."""
    return struct.pack(f"<{len(values)}I", *values)


INTERVAL = 10_000_000 // RATE
BUFFER = WIDTH * HEIGHT * 2
DEVICE = descriptor(1, half(0x0200), 0xEF, 2, 1, 64, half(0x1209), half(0x0001), half(0x0100), 0, 0, 0, 1)
# USB Device Class Definition for Video Devices 1.0: a camera (1), a processing unit (2), and what goes to the host (3).
UNITS = (
    descriptor(0x24, 2, 1, half(0x0201), 0, 0, half(0), half(0), half(0), 3, bytes([0x0A, 0, 0]))
    + descriptor(0x24, 5, 2, 1, half(0), 2, bytes([0x01, 0x02]), 0)
    + descriptor(0x24, 3, 3, half(0x0101), 0, 2, 0)
)
CONTROL = descriptor(0x24, 1, half(0x0100), half(13 + len(UNITS)), word(48_000_000), 1, 1) + UNITS
# USB_Video_Payload_MJPEG and USB_Video_Payload_Uncompressed 1.0; the GUID is that of 8 bits of gray.
GRAY = b"Y800" + bytes.fromhex("00001000800000aa00389b71")
FRAME = 1, 0, half(WIDTH), half(HEIGHT), word(1_000_000, 40_000_000, BUFFER, INTERVAL), 1, word(INTERVAL)
FORMATS = (
    descriptor(0x24, 6, 1, 1, 1, 1, 0, 0, 0, 0)
    + descriptor(0x24, 7, *FRAME)
    + descriptor(0x24, 0x0D, 1, 1, 4)
    + descriptor(0x24, 4, 2, 1, GRAY, 8, 1, 0, 0, 0, 0)
    + descriptor(0x24, 5, *FRAME)
    + descriptor(0x24, 0x0D, 1, 1, 4)
)
STREAM = descriptor(0x24, 1, 2, half(15 + len(FORMATS)), ENDPOINT, 0, 3, 0, 0, 0, 1, 0, 0) + FORMATS
INTERFACES = (
    descriptor(0x0B, 0, 2, 0x0E, 3, 0, 0)
    + descriptor(4, 0, 0, 0, 0x0E, 1, 0, 0)
    + CONTROL
    + descriptor(4, 1, 0, 1, 0x0E, 2, 0, 0)
    + STREAM
    + descriptor(5, ENDPOINT, 2, half(PACKET), 0)
)
CONFIGURATION = descriptor(2, half(9 + len(INTERFACES)), 2, 1, 0, 0x80, 50) + INTERFACES

# Minimum, maximum, step, default and bytes of each control, by unit and selector. The exposure is in 0.1 ms.
CONTROLS = {
    (1, 0x02): [1, 8, 9, 8, 1],
    (1, 0x04): [1, 2047, 1, 156, 4],
    (2, 0x02): [0, 255, 1, 128, 2],
    (2, 0x04): [0, 255, 1, 64, 2],
}
SET_CUR, GET_CUR, GET_MIN, GET_MAX, GET_RES, GET_LEN, GET_INFO, GET_DEF = 0x01, *range(0x81, 0x88)
HELLO, CONNECT, RESET, INTERFACE_INFO, ENDPOINT_INFO = 0, 1, 3, 4, 5
SET_CONFIGURATION, GET_CONFIGURATION, CONFIGURATION_STATUS = 6, 7, 8
SET_ALTERNATE, GET_ALTERNATE, ALTERNATE_STATUS = 9, 10, 11
CANCEL, CONTROL_PACKET, BULK_PACKET = 21, 100, 101
DONE, CANCELLED, STALLED = 0, 1, 4


class Camera:
    """The device at one end of the connection."""

    def __init__(self, connection: socket.socket, folder: Path) -> None:
        self.connection, self.log = connection, (folder / "log").open("w", buffering=1)
        self.formats = {1: as_sent(clean_pictures(folder / "clean")), 2: [frame.tobytes() for frame in frames()]}
        self.format = 1
        self.values = {key: row[3] for key, row in CONTROLS.items()}
        self.waiting: list[tuple[int, bytes]] = []
        self.number = self.offset = 0
        self.next_time = 0.0

    def send(self, kind: int, number: int, body: bytes) -> None:
        """Sends a packet of the protocol."""
        # Numbers have 32 bits, because no capability for 64 is offered.
        self.connection.sendall(word(kind, len(body), number) + body)

    def connect(self) -> None:
        """Says what the device is."""
        self.send(HELLO, 0, b"wstac usb_camera".ljust(64, b"\0") + word(1 << 1 | 1 << 4))
        self.describe()
        self.send(CONNECT, 0, bytes([2, 0xEF, 2, 1]) + struct.pack("<HHH", 0x1209, 0x0001, 0x0100))

    def describe(self) -> None:
        """Lists interfaces and endpoints."""
        columns = [bytes(column).ljust(32, b"\0") for column in ([0, 1], [0x0E, 0x0E], [1, 2], [0, 0])]
        self.send(INTERFACE_INFO, 0, word(2) + b"".join(columns))
        kinds, sizes, owners = bytearray([255] * 32), [0] * 32, bytearray(32)
        for place, kind, size in ((0, 0, 64), (16, 0, 64), (17, 2, PACKET)):
            kinds[place], sizes[place] = kind, size
        owners[17] = 1
        self.send(ENDPOINT_INFO, 0, bytes(kinds) + bytes(32) + bytes(owners) + struct.pack("<32H", *sizes))

    def run(self) -> None:
        """Answers until the machine goes."""
        pending = b""
        while True:
            self.connection.settimeout(self.deliver())
            try:
                got = self.connection.recv(1 << 16)
            except TimeoutError:
                continue
            if not got:
                return
            pending += got
            while len(pending) >= 12:
                kind, length, number = struct.unpack("<III", pending[:12])
                if len(pending) < 12 + length:
                    break
                self.handle(kind, number, pending[12 : 12 + length])
                pending = pending[12 + length :]

    def handle(self, kind: int, number: int, body: bytes) -> None:
        """Answers one packet."""
        if kind == SET_CONFIGURATION:
            self.describe()
            self.send(CONFIGURATION_STATUS, number, bytes([DONE, body[0]]))
        elif kind == GET_CONFIGURATION:
            self.send(CONFIGURATION_STATUS, number, bytes([DONE, 1]))
        elif kind in (SET_ALTERNATE, GET_ALTERNATE):
            self.send(ALTERNATE_STATUS, number, bytes([DONE, body[0], 0]))
        elif kind == CANCEL:
            for waiting in [each for each in self.waiting if each[0] == number]:
                self.waiting.remove(waiting)
                self.send(BULK_PACKET, number, bytes([ENDPOINT, CANCELLED]) + bytes(6))
        elif kind == BULK_PACKET:
            self.waiting.append((number, body[:8]))
        elif kind == CONTROL_PACKET:
            endpoint, request, target, _, value, index, length = struct.unpack("<BBBBHHH", body[:10])
            answer = self.control(target, request, value, index, body[10:])
            status, data = (STALLED, b"") if answer is None else (DONE, answer[:length])
            count = len(data) if target & 0x80 else length
            self.send(CONTROL_PACKET, number, struct.pack("<BBBBHHH", endpoint, request, target, status, value, index, count) + data)

    def control(self, target: int, request: int, value: int, index: int, data: bytes) -> bytes | None:
        """Returns the answer to a request of endpoint 0, or None for one that is not known."""
        if (target, request) == (0x80, 6):
            return {1: DEVICE, 2: CONFIGURATION}.get(value >> 8)
        if target & 0x60 == 0:
            return b""  # such as the end of a stalled endpoint
        selector = value >> 8
        if index == 1:
            return self.stream(selector, request, data)
        key = index >> 8, selector
        if key not in CONTROLS:
            return None
        row = CONTROLS[key]
        if request == SET_CUR:
            self.values[key] = int.from_bytes(data, "little")
            print(f"control {key[0]} {selector} {self.values[key]}", file=self.log)
            return b""
        if request == GET_INFO:
            return b"\x03"
        if request == GET_LEN:
            return half(row[4])
        order = {GET_CUR: self.values[key], GET_MIN: row[0], GET_MAX: row[1], GET_RES: row[2], GET_DEF: row[3]}
        return order[request].to_bytes(row[4], "little") if request in order else None

    def stream(self, selector: int, request: int, data: bytes) -> bytes | None:
        """Answers VS_PROBE_CONTROL and VS_COMMIT_CONTROL: only the format can be chosen."""
        if selector not in (1, 2):
            return None
        if request == SET_CUR:
            self.format = data[2]
            if selector == 2:
                self.number = self.offset = 0
                self.next_time = time.monotonic()
                print("stream", file=self.log)
            return b""
        if request == GET_INFO:
            return b"\x03"
        if request == GET_LEN:
            return half(26)
        return half(0) + bytes([self.format, 1]) + word(INTERVAL) + bytes(10) + word(BUFFER, PAYLOAD)

    def deliver(self) -> float | None:
        """Sends what the guest waits for and is due. Returns the seconds until more is due, or None if it waits for nothing."""
        sent = self.formats[self.format]
        while self.waiting and self.number < len(sent):
            wait = self.next_time - time.monotonic()
            if self.offset == 0 and wait > 0:
                return wait
            picture = sent[self.number]
            number, header = self.waiting.pop(0)
            room = min(PAYLOAD, struct.unpack("<H", header[2:4])[0]) - 2
            part = picture[self.offset : self.offset + room]
            self.offset += len(part)
            last = self.offset == len(picture)
            data = bytes([2, 0x80 | last << 1 | self.number & 1]) + part
            self.send(BULK_PACKET, number, bytes([ENDPOINT, DONE]) + half(len(data)) + header[4:8] + data)
            if last:
                print(f"picture {self.number}", file=self.log)
                self.number, self.offset = self.number + 1, 0
                # A guest that is too slow loses no picture of this camera: the next one comes later.
                self.next_time = max(self.next_time + 1 / RATE, time.monotonic())
        return None


def main(path: str, folder: Path) -> None:
    """Serves one virtual machine."""
    encode(folder / "clean")
    listening = socket.socket(socket.AF_UNIX)
    listening.bind(path)
    listening.listen(1)
    print("ready", flush=True)
    camera = Camera(listening.accept()[0], folder)
    camera.connect()
    camera.run()


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))

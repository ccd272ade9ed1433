"""Writes the pictures of this folder with libjpeg-turbo's cjpeg, and the green that its djpeg decodes: make.py

422.pgm is the green of every picture whose name begins with 422. A name with a + is the picture before it, with a fault that
cameras have; djpeg gives the same green of it. It refuses only a second start marker.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

AT = Path(__file__).parent
WIDTH, HEIGHT = 29, 21
SCANS = "separate"
KINDS: dict[str, list[str]] = {
    "411": ["-sample", "4x1"],
    "420": ["-sample", "2x2"],
    "420-arithmetic": ["-sample", "2x2", "-arithmetic"],
    "420-progressive": ["-sample", "2x2", "-progressive"],
    "420-separate": ["-sample", "2x2", "-scans", SCANS],
    "422": ["-sample", "2x1"],
    "422-optimized": ["-sample", "2x1", "-optimize"],
    "422-restart": ["-sample", "2x1", "-restart", "1B"],
    "440": ["-sample", "1x2"],
    "444": ["-sample", "1x1"],
    "444-separate": ["-sample", "1x1", "-scans", SCANS],
    "coarse": ["-sample", "2x2", "-quality", "20"],
    "gray": ["-grayscale"],
    "rgb": ["-rgb"],
}
FAULTS: dict[str, Callable[[bytes], bytes]] = {
    "bare": lambda picture: re.sub(rb"\xff\xc4.*?(?=\xff[\xda\xdd])", b"", picture, flags=re.DOTALL),
    "byte": lambda picture: re.sub(rb"\xff[\xd0-\xd7\xd9]", lambda marker: b"\0" + marker[0], picture),
    "endless": lambda picture: picture[:-2],
    "fill": lambda picture: re.sub(rb"\xff[\xc0\xc4\xd0-\xd7\xd9-\xdb\xdd]", lambda marker: b"\xff\xff" + marker[0], picture),
    "padded": lambda picture: picture + bytes(9),
    "starts": lambda picture: picture[:2] + picture,
}


def pixel(x: int, y: int) -> bytes:
    """Returns a bright spot on a dark slope, with lines of other colors and some texture."""
    spot = max(0, 200 - 4 * ((x - 17) ** 2 + (y - 11) ** 2))
    texture = (x * 7 + y * 13) % 11
    red, blue = (90, 20) if x % 9 < 3 else (10, 60)
    return bytes([red + spot // 4 + texture, 20 + spot + texture + y // 2, blue + 3 * y])


def green_of(picture: bytes) -> bytes | None:
    """Returns the green that djpeg decodes, or None if it refuses the picture."""
    done = subprocess.run(["djpeg", "-pnm"], check=False, input=picture, capture_output=True)
    header = re.match(rb"P([56])\n%d %d\n255\n" % (WIDTH, HEIGHT), done.stdout)
    pixels = done.stdout[header.end() :] if header else None
    return pixels[1::3] if pixels and header[1] == b"6" else pixels


def main() -> None:
    """Writes all files."""
    colors = b"".join(pixel(x, y) for y in range(HEIGHT) for x in range(WIDTH))
    (AT / SCANS).write_text("0;\n1;\n2;\n")
    for name, options in KINDS.items():
        command = ["cjpeg", "-quality", "90", *options]
        picture = subprocess.run(command, check=True, input=b"P6 %d %d 255\n" % (WIDTH, HEIGHT) + colors, capture_output=True, cwd=AT).stdout
        (AT / f"{name}.jpg").write_bytes(picture)
        green = green_of(picture)
        kept = AT / f"{name.partition('-')[0]}.pgm"
        if kept.stem == name:
            kept.write_bytes(b"P5 %d %d 255\n" % (WIDTH, HEIGHT) + green)
        assert kept.read_bytes().endswith(green), name
        for fault, put in FAULTS.items() if name == "422-restart" else ():
            faulty = put(picture)
            found = green_of(faulty)
            assert faulty != picture and (found == green or (found is None and fault == "starts")), (name, fault)
            (AT / f"{name}+{fault}.jpg").write_bytes(faulty)
    (AT / SCANS).unlink()


main()

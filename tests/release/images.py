"""Writes a board's program as a file for its boot loader: .uf2 for a Raspberry Pi Pico or Pico 2, .dfu for an OpenMV Cam H7,
a WeAct MiniSTM32H743 or an Arduino Nicla Vision.

    images.py rp2040|rp2350|openmv|weact|nicla PROGRAM OUT
"""

from __future__ import annotations

import struct
import sys
import zlib
from pathlib import Path

# Microsoft's UF2 1.0: blocks of 512 bytes, here with 256 of a page of the flash each.
UF2_BEGIN, UF2_END, PAGE, SECTOR = (0x0A324655, 0x9E5D5157), 0x0AB16F30, 256, 4096
HAS_FAMILY, HAS_TAG = 0x2000, 0x8000
FAMILIES = {"rp2040": 0xE48BFF56, "rp2350": 0xE48BFF59}
# RP2350-E10: the first revision of the boot ROM needs a first block that is to be ignored, of the family of any address.
ANY_ADDRESS, IGNORED, IGNORE = 0xE48BFF57, 0x10FFFF00, 0x9957E304
# The boot ROM of an RP2350 looks for a block with this beginning (section 5.1.5 of its datasheet); that of an RP2040 for none.
START_BLOCK = struct.pack("<I", 0xFFFFDED3)
# The suffix of USB DFU 1.1, and of each boot loader its numbers and where a program begins: OpenMV's has a part FIRMWARE;
# that in the ROM of an STM32 (AN2606) and Arduino's take an address.
DFU = 0x0100
LOADERS = {"openmv": (0x37C5, 0x9204, 0x08040000), "weact": (0x0483, 0xDF11, 0x08000000), "nicla": (0x2341, 0x035F, 0x08040000)}


def parts(elf: bytes) -> list[tuple[int, bytes]]:
    """Returns the addresses and bytes of what is flashed."""
    table, size, count = struct.unpack_from("<I", elf, 28)[0], *struct.unpack_from("<HH", elf, 42)
    headers = (struct.unpack_from("<5I", elf, at) for at in range(table, table + size * count, size))
    return sorted((place, elf[offset : offset + length]) for kind, offset, _, place, length in headers if kind == 1 and length)


def pages(elf: bytes) -> dict[int, bytearray]:
    """Returns the pages of the sectors that the program takes, by their addresses: all of a sector's (RP2040-E14)."""
    found: dict[int, bytearray] = {}
    for place, data in parts(elf):
        for at, byte in enumerate(data, place):
            found.setdefault(at - at % PAGE, bytearray(PAGE))[at % PAGE] = byte
    for sector in {at - at % SECTOR for at in found}:
        found |= {at: found.get(at, bytearray(PAGE)) for at in range(sector, sector + SECTOR, PAGE)}
    return dict(sorted(found.items()))


def block(address: int, data: bytes, number: int, count: int, family: int, tag: int = 0) -> bytes:
    flags = HAS_FAMILY | (HAS_TAG if tag else 0)
    head = struct.pack("<8I", *UF2_BEGIN, flags, address, PAGE, number, count, family)
    return head + (data + struct.pack("<I", tag)).ljust(476, b"\0") + struct.pack("<I", UF2_END)


def uf2(elf: bytes, chip: str) -> bytes:
    every = pages(elf)
    found = "rp2350" if any(START_BLOCK in data for at, data in every.items() if at < min(every) + SECTOR) else "rp2040"
    if found != chip:
        sys.exit(f"the program is that of an {found}, expected one of an {chip}")
    blocks = [block(at, data, number, len(every), FAMILIES[chip]) for number, (at, data) in enumerate(every.items())]
    if chip == "rp2350":
        blocks.insert(0, block(IGNORED, b"\xef" * PAGE, 0, 2, ANY_ADDRESS, IGNORE))
    return b"".join(blocks)


def dfu(elf: bytes, board: str) -> bytes:
    every = parts(elf)
    vendor, product, begin = LOADERS[board]
    if every[0][0] != begin:
        sys.exit(f"the program begins at {every[0][0]:#x}, expected {begin:#x}: is it that of the board {board}?")
    image = bytearray()
    for place, data in every:
        image.extend(bytes(place - begin - len(image)) + data)
    image += struct.pack("<4H3sB", 0xFFFF, product, vendor, DFU, b"UFD", 16)
    return bytes(image + struct.pack("<I", zlib.crc32(image) ^ 0xFFFFFFFF))


def main() -> None:
    if len(sys.argv) != 4 or sys.argv[1] not in (*FAMILIES, *LOADERS):
        sys.exit(__doc__)
    try:
        chip, elf = sys.argv[1], Path(sys.argv[2]).read_bytes()
    except OSError as error:
        sys.exit(f"{sys.argv[2]}: {error.strerror}, expected a program that cargo has built")
    Path(sys.argv[3]).write_bytes(dfu(elf, chip) if chip in LOADERS else uf2(elf, chip))


if __name__ == "__main__":
    main()

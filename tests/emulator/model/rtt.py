"""The log: defmt's frames in the ring of a SEGGER RTT channel. They are read as a debug probe does it, and decoded with
the ELF's strings.
"""

import json
import struct

from elftools.elf.elffile import ELFFile

EVERY = 72_000  # cycles between two reads: a millisecond
BLOCKS = 2  # the mode of a channel that waits for room
LEVELS = {"defmt_error": "error", "defmt_warn": "warning", "defmt_info": "info"}


class Log:
    """Reads the log while the program runs. `lines` has level and format, without its numbers, each with its time in
    cycles. If it is `forgotten`, it asks the program to wait for it, and reads nothing.
    """

    def __init__(self, machine, elf):
        self.machine, self.block, self.bytes, self.lines = machine, machine.symbols["_SEGGER_RTT"], b"", []
        self.forgotten = False
        self.formats = _formats(elf)
        machine.at(EVERY, self._look)

    def _look(self):
        self.machine.at(self.machine.now + EVERY, self._look)
        memory = self.machine.uc
        if bytes(memory.mem_read(self.block, 10)) != b"SEGGER RTT":
            return
        channel = self.block + 24
        if self.forgotten:
            memory.mem_write(channel + 20, struct.pack("<I", BLOCKS))
            return
        _, ring, size, write, read, _ = struct.unpack("<6I", memory.mem_read(channel, 24))
        if write == read:
            return
        data = bytes(memory.mem_read(ring, size))
        self.bytes += data[read:write] if read < write else data[read:] + data[:write]
        memory.mem_write(channel + 16, struct.pack("<I", write))
        *frames, self.bytes = self.bytes.split(b"\0")
        self.lines += [(self.machine.now, self._line(frame)) for frame in frames if frame]

    def _line(self, frame):
        data = _unstuffed(frame)
        return self.formats.get(int.from_bytes(data[:2], "little"), f"unknown: {data.hex()}")


def _formats(elf):
    """Returns the format strings by number. They are symbols whose name is JSON, in a section that is not loaded."""
    formats = {}
    with open(elf, "rb") as file:
        for symbol in ELFFile(file).get_section_by_name(".symtab").iter_symbols():
            if symbol.name.startswith("{"):
                described = json.loads(symbol.name)
                if described["tag"] in LEVELS:
                    formats[symbol["st_value"] & 0xFFFF] = f"{LEVELS[described['tag']]}: {described['data']}"
    return formats


def _unstuffed(frame):
    """Decodes reverse-zero-compressing COBS, which is read from its end."""
    rest, data = list(frame), bytearray()
    while rest:
        code = rest.pop()
        if code == 0xFF:
            data += bytes(rest.pop() for _ in range(134))
        elif code >= 0x80:
            data += b"\0" + bytes(rest.pop() for _ in range((code & 0x7F) + 7))
        else:
            # One bit for each of seven bytes says whether it is zero. The lowest bit is for the last byte.
            data += bytes(0 if code >> bit & 1 else rest.pop() for bit in reversed(range(7)))
    return bytes(reversed(data))

"""The effect of a Cortex-M's instructions on the stack, and where they lead, from the text of `arm-none-eabi-objdump
-d`.
"""

import re
from dataclasses import dataclass

CONDITIONS = "eq|ne|cs|hs|cc|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le"
LABEL = re.compile(r"([0-9a-f]+) <(.+)>:$")
LINE = re.compile(r"\s*([0-9a-f]+):\t([0-9a-f ]+)\t(\S+)(?:\t([^@;]*))?(?:[@;] \(([0-9a-f]+) )?")
NAME = re.compile(rf"(pop|push|vpop|vpush|ldmia|stmdb|ldr|bx|blx|bl|b|add|mov|sub)({CONDITIONS})?$")

SIGNS = {"sub": 1, "subs": 1, "subw": 1, "add": -1, "adds": -1, "addw": -1}  # of instructions that make the stack deeper
FILL = "d4d4"  # padding that rust-lld puts between functions


class Unclear(Exception):
    """Reports code that this analysis does not understand."""


@dataclass
class Instruction:
    """An instruction."""

    address: int
    name: str  # without condition and width
    operands: str
    condition: str | None = None
    literal: int | None = None  # address of the word that it loads
    padding: bool = False  # may stand between functions

    def __str__(self):
        return f"{self.address:x}: {self.name}{self.condition or ''} {self.operands}"


@dataclass
class Function:
    """The instructions between two labels, in the order of their addresses."""

    name: str
    instructions: list


@dataclass
class Program:
    """The code of a program."""

    functions: dict  # by address
    words: dict  # constants among the code, by address


def parse(text):
    """Parses a disassembly into functions and constants."""
    program, function = Program({}, {}), None
    for line in text.splitlines():
        if label := LABEL.match(line):
            function = program.functions[int(label[1], 16)] = Function(label[2], [])
        elif (found := LINE.match(line)) and function:
            address, name, operands = int(found[1], 16), found[3], (found[4] or "").strip()
            if name == ".word":
                program.words[address] = int(operands, 16)
            elif not name.startswith("."):
                literal = int(found[5], 16) if found[5] else None
                padding = name == "nop" or found[2].strip() == FILL
                function.instructions.append(instruction(address, name, operands, literal, padding))
    for function in program.functions.values():
        while function.instructions and function.instructions[-1].padding:
            function.instructions.pop()
    return program


def instruction(address, name, operands, literal=None, padding=False):
    """Parses an instruction, and separates its name from the condition."""
    name = re.sub(r"\.[nw]$", "", name)
    split = NAME.match(name)
    return Instruction(address, *(split[1], operands, split[2]) if split else (name, operands), literal=literal, padding=padding)


def registers(operands):
    """Returns the number of words in a list of registers: {r4, r5, lr}, {r4-r7}, {d8-d9}. A d register has two words."""
    count = 0
    for part in re.search(r"\{(.*)\}", operands)[1].split(","):
        first, _, last = part.strip().partition("-")
        span = int(last[1:]) - int(first[1:]) + 1 if last else 1
        count += span * (2 if first.startswith("d") else 1)
    return count


def number(operand):
    """Returns the value of `#n`."""
    found = re.search(r"#(-?\d+)", operand)
    return int(found[1]) if found else None


def grows(program, before, code, depth, frame):
    """Returns the bytes by which an instruction makes the stack deeper, below 0 if less deep. Returns `None` if it does
    not change the stack pointer.

    `before` are the instructions that lead to it. `depth` is the stack's depth before it, and `frame` is the depth that
    r7 points to.
    """
    name, operands = code.name, code.operands
    if name in ("push", "vpush") or name in ("stmdb", "vstmdb") and operands.startswith("sp!"):
        return 4 * registers(operands)
    if name in ("pop", "vpop") or name in ("ldmia", "vldmia") and operands.startswith("sp!"):
        return -4 * registers(operands)
    if written_back := re.search(r"\[sp, #(-?\d+)\]!$|\[sp\], #(-?\d+)$", operands):
        return -int(written_back[1] or written_back[2])
    if name in ("ldmia", "stmia", "vldmia", "vstmia") and re.match(r"sp, \{(?!.*\b(?:sp|pc)\b)", operands):
        # Without "!", the stack pointer is only the address, and stays.
        return None
    target, *sources = operands.split(", ")
    if not target.startswith("sp") or name in ("cmp", "cmn", "tst"):
        return None
    by = None
    if name in SIGNS and (sources[0] == "sp" or len(sources) == 1):
        by = number(sources[-1]) if "#" in sources[-1] else constant(program, before, sources[-1])
        by = by if by is None else SIGNS[name] * by
    elif name in SIGNS and sources[0] == "r7" and frame is not None and number(sources[1]) is not None:
        by = frame + SIGNS[name] * number(sources[1]) - depth
    elif name == "mov" and (there := frame_address(before, sources[0], frame)) is not None:
        by = there - depth
    if by is None or target != "sp":
        raise Unclear(f"unknown change of the stack pointer at {code}")
    return by


def constant(program, before, register):
    """Returns the signed value of a register that was loaded with a constant just before."""
    for code in reversed(before):
        target, _, source = code.operands.partition(", ")
        if target != register:
            continue
        value = None
        if code.name == "ldr" and code.literal is not None:
            value = program.words.get(code.literal)
        elif code.name in ("mov", "movs", "movw"):
            value = number(source)
        return value - (1 << 32) if value is not None and value >> 31 else value
    return None


def frame_address(before, register, frame):
    """Returns the depth that a register points to, if it was computed from r7 just before."""
    if register == "r7":
        return frame
    offset = 0
    for code in reversed(before):
        parts = code.operands.split(", ")
        if parts[0] != register:
            continue
        by = number(parts[-1])
        if code.name not in SIGNS or by is None or frame is None:
            return None
        offset += SIGNS[code.name] * by
        if len(parts) == 3 and parts[1] == "r7":
            return frame + offset
        if len(parts) == 3 and parts[1] != register:
            return None
    return None

"""Computes the depth of the stack in a function and all that it calls."""

import re
from dataclasses import dataclass, field

from disassembly import Unclear, grows, number


# Kernels by hand, by a part of their names: they jump to computed places, which all are their own. Their stack is the same
# at all of these.
KERNELS = ("byte_sums::packed::add",)


@dataclass
class Use:
    """The stack of a function."""

    bytes: int  # with everything that it calls
    path: tuple  # names, from the function to the deepest one that it calls
    returns: bool  # whether it ever returns
    indirect: set = field(default_factory=set)  # calls through registers, its own and those of the functions that it calls


class Analysis:
    """Computes the stack of a program's functions."""

    def __init__(self, program):
        self.program = program
        self.ends = dict(zip(sorted(program.functions), [*sorted(program.functions)[1:], 1 << 32]))
        self.uses = {}
        self.under_way = []

    def use(self, address):
        """Returns the stack of the function at an address."""
        if address not in self.uses:
            if address not in self.program.functions:
                raise Unclear(f"no function at {address:x}, called by {self.program.functions[self.under_way[-1]].name}")
            if address in self.under_way:
                names = [self.program.functions[each].name for each in (*self.under_way, address)]
                raise Unclear("recursion: " + " > ".join(names[self.under_way.index(address) :]))
            self.under_way.append(address)
            try:
                self.uses[address] = Walk(self, address).use()
            finally:
                self.under_way.pop()
        return self.uses[address]


class Walk:
    """Walks all paths through one function."""

    def __init__(self, analysis, address):
        self.analysis = analysis
        self.start, self.end = address, analysis.ends[address]
        function = analysis.program.functions[address]
        self.name, self.code = function.name, function.instructions
        self.index = {code.address: at for at, code in enumerate(self.code)}
        self.seen = {}  # (depth, depth that r7 points to) at each instruction, by index
        self.deepest = Use(0, (self.name,), False)
        self.tables = []

    def use(self):
        self.follow(self.start, (0, None))
        # The targets of a jump table are not in the instructions, so they are all places that nothing else leads to.
        while self.tables and (rest := [code for at, code in enumerate(self.code) if at not in self.seen and not code.padding]):
            self.follow(rest[0].address, max(self.tables, key=lambda state: state[0]))
        return self.deepest

    def follow(self, address, state):
        """Continues from an instruction. `state` has the depth of the stack."""
        to_do = [(address, state)]
        while to_do:
            address, state = to_do.pop()
            if not self.start <= address < self.end:
                self.call(address, state[0], leaves=True)
                continue
            at = self.index.get(address)
            if at is None:
                if self.code and address <= self.code[-1].address:
                    raise Unclear(f"{self.name}: a jump to {address:x}, where there is no instruction")
                # After the last instruction comes another function.
                self.call(self.end, state[0], leaves=True)
                continue
            if at in self.seen:
                if self.seen[at][0] != state[0]:
                    raise Unclear(f"{self.name}: the stack is {self.seen[at][0]} or {state[0]} bytes deep at {self.code[at]}")
                continue
            self.seen[at] = state
            to_do += self.step(at, *state)

    def step(self, at, depth, frame):
        """Returns where an instruction leads, and the depth of the stack there."""
        code = self.code[at]
        behind = self.code[at + 1].address if at + 1 < len(self.code) else self.end
        by = grows(self.analysis.program, self.code[max(0, at - 12) : at], code, depth, frame)
        name, operands = code.name, code.operands
        if by is not None:
            gone = "pc" in operands
            if code.condition and by > 0:
                raise Unclear(f"{self.name}: the stack is taken on a condition at {code}")
            if not code.condition:
                depth += by
            if depth < 0:
                raise Unclear(f"{self.name}: more is given back than was taken at {code}")
            self.at_least(depth, (self.name,))
            self.deepest.returns |= gone
            return [] if gone and not code.condition else [(behind, (depth, frame))]
        if operands.startswith("r7, sp") and name in ("add", "mov"):
            frame = depth - (number(operands) or 0)
        on = [(behind, (depth, frame))]
        if name == "b":
            to = (int(operands.split()[0], 16), (depth, frame))
            return [to, *on] if code.condition else [to]
        if name in ("cbz", "cbnz"):
            return [(int(operands.split()[1], 16), (depth, frame)), *on]
        if name in ("bl", "blx"):
            if re.match(r"[0-9a-f]+ <", operands):
                to = int(operands.split()[0], 16)
                if to in self.index and to != self.start:
                    # A jump within a long function on a Cortex-M0, where lr has been saved.
                    return [(to, (depth, frame))]
                return on if self.call(to, depth) else []
            self.deepest.indirect.add(f"{self.name} at {code}")
            return on
        if any(kernel in self.name for kernel in KERNELS) and (name == "bx" and operands != "lr" or operands.startswith("pc, [sp")):
            self.tables.append((depth, frame))
            return []
        if name == "bx" and f"{operands}, pc, #" in " ".join(code.operands for code in self.code[max(0, at - 12) : at]):
            self.tables.append((depth, frame))
            return []
        if name == "bx" and operands != "lr":
            self.deepest.indirect.add(f"{self.name} at {code}")
        if name == "bx":
            self.deepest.returns = True
            return on if code.condition else []
        if name in ("tbb", "tbh") or name in ("mov", "add") and operands.startswith("pc, "):
            self.tables.append((depth, frame))
            return []
        if operands.startswith("pc, ") or name == "msr" and re.match("MSP,|PSP,|CONTROL,", operands):
            raise Unclear(f"{self.name}: unknown jump or stack at {code}")
        return [] if name == "udf" else on

    def call(self, address, depth, leaves=False):
        """Handles a call, or a jump that leaves this function. Returns whether it comes back."""
        use = self.analysis.use(address)
        self.at_least(depth + use.bytes, (self.name, *use.path))
        self.deepest.indirect |= use.indirect
        self.deepest.returns |= leaves and use.returns
        return use.returns

    def at_least(self, bytes_, path):
        if bytes_ > self.deepest.bytes:
            self.deepest.bytes, self.deepest.path = bytes_, path

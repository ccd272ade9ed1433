"""Registers that only store what is written: ports, and others that only have to exist."""


class Registers:
    """Stores what is written. `initial` has the values at reset that are not 0."""

    def __init__(self, base, initial=None):
        self.base, self.initial = base, initial or {}
        self.values = dict(self.initial)

    def reset(self):
        """Resets the registers."""
        self.values = dict(self.initial)

    def read(self, offset):
        """Returns a register."""
        return self.values.get(offset, 0)

    def write(self, offset, value):
        """Stores a register."""
        self.values[offset] = value

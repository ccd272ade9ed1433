"""Registers that do nothing but keep what is written: ports, and whatever only has to be there."""


class Registers:
    """Keeps what is written; `initial` are the values at reset that are not 0."""

    def __init__(self, base, initial=None):
        self.base, self.initial = base, initial or {}
        self.values = dict(self.initial)

    def reset(self):
        """As after a reset."""
        self.values = dict(self.initial)

    def read(self, offset):
        """A register."""
        return self.values.get(offset, 0)

    def write(self, offset, value):
        """Keeps it."""
        self.values[offset] = value

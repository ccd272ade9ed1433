"""Errors that are more than one of Python's."""

from __future__ import annotations

import errno

from ._wstac import Error


class NotFoundError(Error, FileNotFoundError):
    """A file, a device or a model does not exist: both an `Error` and a `FileNotFoundError`."""

    errno: int

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.errno = errno.ENOENT


# Where it is known.
NotFoundError.__module__ = "wstac"

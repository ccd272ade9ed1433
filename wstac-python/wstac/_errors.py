"""Errors that are more than one of Python's."""

from __future__ import annotations

import errno

from ._wstac import Error


class NotFoundError(Error, FileNotFoundError):
    """A file, a device or a model does not exist: both an `Error` and a `FileNotFoundError`.

    >>> import wstac
    >>> try:
    ...     wstac.Model.load("none.wsm")
    ... except FileNotFoundError as error:
    ...     print(error)
    none.wsm: no such file; wstac model list --all lists built-in models
    """

    errno: int

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.errno = errno.ENOENT


# Errors of the host have a kind of their own.
Error.kind = None
# Where it is known.
NotFoundError.__module__ = "wstac"
# Its example is in the extension, where doctest does not look.
__test__ = {"Error": Error}

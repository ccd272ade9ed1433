"""Makes the reference of installed Python packages with pdoc. Every warning is an error.

    python_api.py PACKAGE… FOLDER

What a class has of a base that is not public is shown as the class's own, because a reader finds it nowhere else.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import pdoc
import pdoc.doc
import pdoc.render


def own_members(self: pdoc.doc.Class) -> list[pdoc.doc.Doc]:
    """Returns the members of a class and of its private bases."""
    private = f"{self.modulename}._"
    return [member for member in self.members.values() if member.taken_from[0] == self.modulename or member.taken_from[0].startswith(private)]


def main() -> None:
    """Makes the reference."""
    *packages, folder = sys.argv[1:]
    warnings.simplefilter("error")
    pdoc.doc.Class.own_members = property(own_members)
    pdoc.render.configure(docformat="markdown", show_source=False, search=False)
    pdoc.pdoc(*packages, output_directory=Path(folder))


if __name__ == "__main__":
    main()

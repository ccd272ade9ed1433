"""The address of this repository and the mail of its maintainers, which they set once: no address is invented.

    address.py URL MAIL    writes them where crates, wheels, packages of Debian and ROS 2, and citations take them from
    address.py             checks that all of these state the same, and prints the URL; fails if one is not set
"""

from __future__ import annotations

import re
import sys

from common import PLACES, ROOT, fail, place

FORMS = {"URL": r"https://[^\s\"\\]+", "MAIL": r"[\w.%+-]+@(?!example\.)[\w.-]+\.[A-Za-z]{2,}"}


def main() -> None:
    given = sys.argv[1:]
    if given and (len(given) != 2 or not all(map(re.fullmatch, FORMS.values(), given))):
        fail(f"address is {' '.join(given)!r}, expected https://… name@domain")
    new, first = dict(zip(FORMS, given)), {}
    for name, line in PLACES.items():
        word, found = place(name)
        if new:
            text = found.string[: found.start()] + line.replace(word, new[word]) + found.string[found.end() :]
            (ROOT / name).write_text(text, encoding="utf-8")
        elif not re.fullmatch(FORMS[word], found[1]) or found[1] != first.setdefault(word, found[1]):
            fail(f"{name}: {word} is {found[1]!r}; help: python3 tests/release/address.py URL MAIL sets the same in all files")
    if not new:
        print(first["URL"])


main()

"""The address of this repository, which its maintainer sets once: no address is invented.

    address.py URL    writes it where crates, the wheel, Debian packages and citations take it from
    address.py        checks that all of them state the same, and prints it; fails if none is set
"""

from __future__ import annotations

import re
import sys

from common import ROOT, fail

# A line that is a comment until there is an address. The crates inherit the first.
PLACES = {
    "Cargo.toml": 'repository = "ADDRESS"',
    "wstac-python/pyproject.toml": 'urls = { Repository = "ADDRESS" }',
    "CITATION.cff": 'repository-code: "ADDRESS"',
}


def main() -> None:
    stated = {}
    for name, line in PLACES.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        pattern = re.compile(rf"^(?:# )?{re.escape(line).replace('ADDRESS', '(.*)')}$", re.MULTILINE)
        stated[name] = pattern.search(text)[1]
        if len(sys.argv) > 1:
            if not re.fullmatch(r"https://[^\s\"\\]+", sys.argv[1]):
                fail(f"address is {sys.argv[1]!r}, expected https://…")
            (ROOT / name).write_text(pattern.sub(line.replace("ADDRESS", sys.argv[1]), text), encoding="utf-8")
    if len(sys.argv) > 1:
        return
    if len(set(stated.values())) > 1 or "" in stated.values():
        said = ", ".join(f"{name} {address!r}" for name, address in stated.items())
        fail(f"address of the repository is {said}; expected one; help: python3 tests/release/address.py URL writes it")
    print(stated["Cargo.toml"])


main()

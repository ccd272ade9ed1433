"""The address of this repository and the mail of its maintainers, which they set once: no address is invented.

    address.py URL MAIL    writes them where crates, wheels, packages of Debian and ROS 2, and citations take them from
    address.py             checks that all of these state the same, and prints the URL; fails if one is not set
"""

from __future__ import annotations

import re
import sys

from common import ROOT, fail

# A line that is a comment until there is an address. The crates inherit the first. Packages of ROS 2 need a mail: until there is
# one, it is nobody's. Those of Debian take it from there.
MAINTAINER = '  <maintainer email="MAIL">The WSTac authors</maintainer>'
PLACES = {
    "Cargo.toml": 'repository = "URL"',
    "wstac-python/pyproject.toml": 'urls = { Repository = "URL" }',
    "CITATION.cff": 'repository-code: "URL"',
    "wstac-ros/wstac_msgs/package.xml": MAINTAINER,
    "wstac-ros/wstac_ros/package.xml": MAINTAINER,
}
FORMS = {"URL": r"https://[^\s\"\\]+", "MAIL": r"[\w.%+-]+@(?!example\.)[\w.-]+\.[A-Za-z]{2,}"}


def main() -> None:
    given = sys.argv[1:]
    if given and (len(given) != 2 or not all(map(re.fullmatch, FORMS.values(), given))):
        fail(f"address is {' '.join(given)!r}, expected https://… name@domain")
    new, first = dict(zip(FORMS, given)), {}
    for name, line in PLACES.items():
        word = "MAIL" if line == MAINTAINER else "URL"
        text = (ROOT / name).read_text(encoding="utf-8")
        pattern = re.compile(rf"^(?:# )?{re.escape(line).replace(word, '(.*)')}$", re.MULTILINE)
        found = pattern.search(text)[1]
        if new:
            (ROOT / name).write_text(pattern.sub(line.replace(word, new[word]), text), encoding="utf-8")
        elif not re.fullmatch(FORMS[word], found) or found != first.setdefault(word, found):
            fail(f"{name}: {word} is {found!r}, expected one, the same everywhere; help: python3 tests/release/address.py URL MAIL writes both")
    if not new:
        print(first["URL"])


main()

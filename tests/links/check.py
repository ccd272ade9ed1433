#!/usr/bin/env python3
"""Checks that the links of every Markdown page lead somewhere: to a file or folder of the repository, and to a heading of a page.

    check.py [PAGE…]    all pages that git knows, without arguments

Links to other hosts are not followed: a check needs no network.
"""

import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(\s*<?([^()\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)|^\[[^\]]+\]:\s*(\S+)", re.MULTILINE)
ELSEWHERE = re.compile(r"[a-z][a-z0-9+.-]*:", re.IGNORECASE)


def prose(text):
    """A page's text without its code, which may look like links."""
    text = re.sub(r"^(```|~~~).*?^\1", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    return re.sub(r"(`+).*?\1", "code", re.sub(r"(?:(?<=\n\n)|\A)(?:    .*\n)+", "", text), flags=re.DOTALL)


def slug(heading):
    """The anchor that GitHub and mdBook give a heading."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    return re.sub(r"[^\w\- ]", "", plain.strip().lower()).replace(" ", "-")


@cache
def anchors(page):
    """The anchors of a page; the second heading of a name ends with -1, and so on."""
    found, seen = set(), {}
    text = re.sub(r"^(```|~~~).*?^\1", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    for heading in re.findall(r"^#{1,6} +(.*?)#* *$", text, re.MULTILINE):
        name = slug(heading)
        count = seen.get(name, 0)
        seen[name] = count + 1
        found.add(f"{name}-{count}" if count else name)
    return found | set(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", text))


def problem(page, target):
    """What is wrong with a link of a page, or `None`."""
    if ELSEWHERE.match(target):
        return None
    path, _, anchor = unquote(target).partition("#")
    to = (page.parent / path).resolve() if path else page
    if not to.exists():
        return "no such file"
    if not to.is_relative_to(ROOT):
        return "leads out of the repository"
    if anchor and to.suffix == ".md" and anchor not in anchors(to):
        return "no such heading"
    return None


def main():
    pages = sys.argv[1:] or subprocess.check_output(["git", "ls-files", "-z", "*.md"], cwd=ROOT, text=True).split("\0")[:-1]
    count, wrong = 0, []
    for page in (ROOT / name for name in pages):
        if not page.exists():
            continue
        for found in LINK.finditer(prose(page.read_text())):
            target = found[1] or found[2]
            count += 1
            if said := problem(page, target):
                wrong.append(f"{page.relative_to(ROOT)}: {target}: {said}")
    if wrong or not count:
        sys.exit("\n".join(wrong) or "check.py: no links found")
    print(f"links: {count} in {len(pages)} pages lead somewhere")


if __name__ == "__main__":
    main()

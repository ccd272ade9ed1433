"""What the check of commands knows about them: those that are not run, with the reason, and what takes the place of hardware."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass
class Rule:
    """An entry of the list."""

    match: re.Pattern[str]
    """Matches a part of a command."""
    page: str | None
    """The page that it is for; `None` for all."""
    given: dict[str, Any]
    """Its other keys."""
    used: bool = False

    def takes(self, page: str, command: str) -> bool:
        """Tells whether the entry is for a command, and keeps that it was of use."""
        found = self.page in (None, page) and self.match.search(command) is not None
        self.used |= found
        return found


@dataclass
class Rules:
    """All entries of a list, and what single pages need."""

    named: list[Rule] = field(default_factory=list)
    """Commands that are not run; `why` is the reason."""
    instead: list[Rule] = field(default_factory=list)
    """`put` takes the place of what matches; `why` is the reason."""
    service: list[Rule] = field(default_factory=list)
    """Commands that run until a signal; `says` is in what they print when they are ready, `more` are further arguments."""
    screen: list[Rule] = field(default_factory=list)
    """Commands that need a terminal, and end by the key `q`; `says` is on their first screen."""
    prepare: dict[str, str] = field(default_factory=dict)
    """Commands for files that a page assumes."""

    def named_by(self, page: str, command: str) -> str | None:
        """Returns why a command is not run, or `None` if it is run."""
        # All entries are asked, so that none of them is without use.
        found = [rule.given["why"] for rule in self.named if rule.takes(page, command)]
        return found[0] if found else None

    def replaced(self, page: str, text: str) -> str:
        """Returns a command with what takes the place of hardware."""
        for rule in self.instead:
            if rule.takes(page, text):
                text = rule.match.sub(rule.given["put"], text)
        return text

    def unused(self, read: set[str]) -> list[str]:
        """Returns the entries that were of no use for the pages that were read."""
        rules = [*self.named, *self.instead, *self.service, *self.screen]
        found = [f"the entry {rule.match.pattern!r} matches no command" for rule in rules if not rule.used]
        return found + [f"{page} is prepared, and has no command" for page in self.prepare if page not in read]


def load(file: Path) -> Rules:
    """Reads a list."""
    content = tomllib.loads(file.read_text(encoding="utf-8"))
    rules = Rules(prepare=content.pop("prepare", {}))
    for kind, entries in content.items():
        for entry in entries:
            rule = Rule(re.compile(entry.pop("match")), entry.pop("page", None), entry)
            getattr(rules, kind).append(rule)
    return rules

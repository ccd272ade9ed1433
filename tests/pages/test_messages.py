"""Tests that docs/TROUBLESHOOTING.md has the messages that do not say themselves what to do, and none that the source code lacks,
and that no message expects something which helps nobody."""

import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/TROUBLESHOOTING.md").read_text(encoding="utf-8")
LITERAL = re.compile(r'"((?:[^"\\]|\\.)*)"', re.DOTALL)
HOLLOW = re.compile(r"expected ((no|that|neither|it|one at least|one that|the same|a way back|others of)\b|none:|(fewer|less)$)")


def words(text):
    """Returns a text of the code or the page in one form: one line, and `…` for each part that is filled in."""
    text = re.sub(r"\\\n\s*", "", text).replace('\\"', '"')
    text = re.sub(r"(?<!\{)\{[^{}]*\}", "…", text)
    return re.sub(r"\s+", " ", text).strip()


def literals(path):
    """Returns the texts of a source file, without those of its tests and comments."""
    code = re.split(r"^#\[cfg\(test\)\]\n(?:pub )?mod ", path.read_text(encoding="utf-8"), flags=re.MULTILINE)[0]
    code = re.sub(r"^\s*//.*$", "", code, flags=re.MULTILINE)
    # A quotation mark as a character would begin a text.
    return [words(found) for found in LITERAL.findall(code.replace("'\"'", "''"))]


def sources():
    """Yields the source files of all crates, without their tests, and those that check how the firmware is built."""
    for path in sorted(ROOT.glob("wstac-*/**/*.rs")):
        inside = path.relative_to(ROOT).parts
        if ("src" in inside or inside[:2] == ("wstac-fw", "build")) and "target" not in inside and not path.stem.endswith("tests") and "tests" not in inside:
            yield path


def part(file, begin, end):
    """Returns the part of a source file between two texts."""
    text = (ROOT / file).read_text(encoding="utf-8")
    return text.split(begin, 1)[1].split(end, 1)[0]


def pieces(message):
    """Returns the parts of a message that are not filled in, without the punctuation around them.

    What was expected often is a constant of its own.
    """
    return [piece for piece in (one.strip(" :;,.()") for one in re.split(r"…|[,;] expected ", message)) if len(piece) > 1]


def on_page():
    """Returns the messages and names that the items of the page's lists begin with."""
    begins = re.findall(r"^- (`[^`]*`(?:,\s+`[^`]*`)*)(?::|$)", PAGE, re.MULTILINE)
    return [message for begin in begins for message in re.findall(r"`([^`]*)`", begin)]


class Messages(unittest.TestCase):
    def assert_there(self, messages, least):
        """Checks that there are so many messages, and that the page has each."""
        self.assertGreaterEqual(len(messages), least)
        named = on_page()
        for message in messages:
            with self.subTest(message=message):
                self.assertTrue(
                    any(all(piece in one for piece in pieces(message)) for one in named), f"docs/TROUBLESHOOTING.md does not have {message!r}"
                )

    def test_every_reason_for_a_missing_answer(self):
        textures = part("wstac-host/src/texture.rs", "impl NoTexture", "\n}\n")
        self.assert_there([words(one) for one in re.findall(r'=> "(.*?)"', textures)], 4)
        others = part("wstac-core/src/reason.rs", "impl Reason", "\n}\n")
        self.assert_there([words(one) for one in re.findall(r'"(.*?)"', others)], 22)
        speeds = part("wstac-host/src/output/event.rs", "pub fn why_texture", "\n    }\n")
        self.assert_there([words(one) for one in re.findall(r'format!\("(.*?)"', speeds)], 1)
        reasons = part("wstac-cli/src/commands/run/no_event.rs", "impl fmt::Display for Reason", "\n}\n")
        # The last one is of two lines, and the second is a hint in parentheses.
        self.assert_there([words(one) for one in re.findall(r'=> f.write_str\("(.*?)"', reasons)], 3)

    def test_every_fault(self):
        names = re.findall(r'\w+ = "(.*?)"', part("wstac-host/src/reasons.rs", "FaultKind:", "\n}"))
        self.assert_there(names, 10)
        self.assertEqual(set(names) - set(on_page()), set())
        topic = (ROOT / "wstac-cli/src/commands/topics/sources.txt").read_text(encoding="utf-8")
        self.assertEqual(set(names) - set(re.findall(r"^    ([\w-]+)  ", topic, re.MULTILINE)), set())
        board = part("wstac-host/src/monitor/board.rs", "fn fault_in_words", "\n}\n")
        found = [words(found) for found in LITERAL.findall(board)]
        self.assert_there([message for message in found if "; help: " not in message], 6)

    def test_no_message_that_is_gone(self):
        code = "\n".join(text for path in sources() for text in literals(path))
        self.assertGreater(len(on_page()), 60)
        for message in on_page():
            for piece in pieces(words(message)):
                with self.subTest(piece=piece):
                    self.assertTrue(piece in code, f"no source file has the text {piece!r} of {message!r}")

    def test_no_hollow_message(self):
        texts = [(path, text) for path in sources() for text in literals(path)]
        texts += [(path, path.read_text(encoding="utf-8")) for path in ROOT.glob("wstac-python/wstac/*.py")]
        for path, text in texts:
            with self.subTest(path=path):
                self.assertNotRegex(text, HOLLOW)


if __name__ == "__main__":
    unittest.main()

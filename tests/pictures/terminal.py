"""Terminals as pictures: what a program shows in a real terminal (tmux), with its colors, as SVG."""

import html
import re
import subprocess
import time

# A character in pixels, and the space around all of them.
WIDE, HIGH, MARGIN = 8, 17, 12
INK, PAPER = "#d6dbe1", "#14181d"
PALETTE = ["#14181d", "#e5534b", "#57ab5a", "#c69026", "#539bf5", "#b083f0", "#39c5cf", "#adbac7"]
BRIGHT = ["#768390", "#ff938a", "#8ddb8c", "#eac55f", "#96d0ff", "#dcbdfb", "#56d4dd", "#f0f3f6"]

# Blocks: where they begin and how high they are, in rows.
BLOCKS = {"▀": (0, 0.5), "▄": (0.5, 0.5), "█": (0, 1)}


def screen(command, columns, rows, until, keys=(), patience=60):
    """Runs a command in a terminal, waits until a text is on its screen, presses keys, and returns the screen with its escapes.

    Each key is followed by the text that it is to bring.
    """
    name = f"wstac-picture-{time.time_ns()}"
    tmux = lambda *arguments: subprocess.run(["tmux", "-L", name, "-f", "/dev/null", *arguments], check=True, capture_output=True, text=True).stdout
    # The end of a program would end its terminal.
    inside = ["sh", "-c", '"$@"; printf "\\n"; sleep 600', "sh", *map(str, command)]
    tmux("new-session", "-d", "-s", "picture", "-x", str(columns), "-y", str(rows), "env", "TERM=tmux-256color", "COLORTERM=truecolor", "LC_ALL=C.UTF-8", *inside)
    try:
        for key, wanted in (("", until), *keys):
            if key:
                tmux("send-keys", "-t", "picture", key)
            end = time.monotonic() + patience
            while not re.search(wanted, tmux("capture-pane", "-p", "-t", "picture")):
                if time.monotonic() > end:
                    raise SystemExit(f"{command}: {wanted!r} is not on the screen:\n{tmux('capture-pane', '-p', '-t', 'picture')}")
                time.sleep(0.02)
        return tmux("capture-pane", "-e", "-N", "-p", "-t", "picture").rstrip("\n").split("\n")
    finally:
        tmux("kill-server")


def color(codes, at):
    """Returns the color of an extended code, and the place behind it."""
    if codes[at] == 2:
        return "#%02x%02x%02x" % tuple(codes[at + 1 : at + 4]), at + 4
    number = codes[at + 1]
    if number < 16:
        found = (PALETTE + BRIGHT)[number]
    elif number < 232:
        number -= 16
        levels = [0, 95, 135, 175, 215, 255]
        found = "#%02x%02x%02x" % (levels[number // 36], levels[number // 6 % 6], levels[number % 6])
    else:
        found = "#%02x%02x%02x" % ((8 + 10 * (number - 232),) * 3)
    return found, at + 2


class Style:
    """The colors and the weight of what follows."""

    def __init__(self):
        self.ink = self.paper = None
        self.bold = self.dim = self.swapped = False

    def take(self, codes):
        """Takes the numbers of an escape sequence."""
        at = 0
        while at < len(codes):
            code = codes[at]
            at += 1
            if code == 0:
                self.__init__()
            elif code in (1, 2, 22):
                self.bold, self.dim = code == 1, code == 2
            elif code in (7, 27):
                self.swapped = code == 7
            elif 30 <= code < 38 or 90 <= code < 98:
                self.ink = (PALETTE if code < 40 else BRIGHT)[code % 10]
            elif 40 <= code < 48 or 100 <= code < 108:
                self.paper = (PALETTE if code < 50 else BRIGHT)[code % 10]
            elif code == 38:
                self.ink, at = color(codes, at)
            elif code == 48:
                self.paper, at = color(codes, at)
            elif code == 39:
                self.ink = None
            elif code == 49:
                self.paper = None

    @property
    def colors(self):
        ink, paper = self.ink or INK, self.paper
        return (paper or PAPER, ink) if self.swapped else (ink, paper)


def runs(line, style):
    """Yields the parts of a line that look alike: column, text, ink, paper, weight."""
    column = 0
    for part in re.split(r"(\x1b\[[\d;:]*m|\x1b\(B|\x0f|\x0e)", line):
        escape = re.fullmatch(r"\x1b\[([\d;:]*)m", part)
        if escape:
            style.take([int(code or 0) for code in re.split("[;:]", escape[1])])
        elif part and part[0] not in "\x1b\x0e\x0f":
            yield column, part, *style.colors, "bold" if style.bold else "normal", style.dim
            column += len(part)


def picture(title, lines, columns):
    """Returns a screen as SVG."""
    width, height = columns * WIDE + 2 * MARGIN, len(lines) * HIGH + 2 * MARGIN
    papers, texts = [], []
    style = Style()
    for row, line in enumerate(lines):
        for column, part, ink, paper, weight, is_dim in runs(line, style):
            x, y = MARGIN + column * WIDE, MARGIN + row * HIGH
            if paper and paper != PAPER:
                papers.append(f"<rect x='{x}' y='{y}' width='{len(part) * WIDE}' height='{HIGH}' fill='{paper}'/>")
            blocks = BLOCKS.get(part[0]) if set(part) <= {part[0]} else None
            if blocks:
                # Glyphs of blocks would leave lines between rows.
                top, share = blocks
                papers.append(f"<rect x='{x}' y='{y + top * HIGH:g}' width='{len(part) * WIDE}' height='{share * HIGH:g}' fill='{ink}'/>")
                continue
            extra = (" font-weight='bold'" if weight == "bold" else "") + (" opacity='.6'" if is_dim else "")
            # Each word has its place and its length, so that columns stay columns in any font.
            for word in re.finditer(r"\S+", part):
                place, length = x + word.start() * WIDE, len(word[0]) * WIDE
                texts.append(f"<text x='{place}' y='{y + 13}' fill='{ink}' textLength='{length}' lengthAdjust='spacingAndGlyphs'{extra}>{html.escape(word[0])}</text>")
    head = f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' viewBox='0 0 {width} {height}' role='img'>"
    group = "<g font-family='DejaVu Sans Mono, Menlo, Consolas, monospace' font-size='13'>"
    return "\n".join([head, f"<title>{html.escape(title)}</title>", f"<rect width='{width}' height='{height}' rx='8' fill='{PAPER}'/>", *papers, group, *texts, "</g></svg>"]) + "\n"

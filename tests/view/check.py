"""Checks `wstac view` in a real terminal (tmux): the screen, keys, signals and sizes. At the end, the terminal must be
as before.

check.py WSTAC BOARD    BOARD prints what a board sends for a scene
"""

import contextlib
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import time

CHANGELOG = pathlib.Path(__file__).parents[2] / "CHANGELOG.md"
SCENE = "scene:Saw3@150,90deg"
# Small frames, so that a program without optimization plays them in time.
SMALL = ["--size", "320x180"]
# The time limit of every wait on a busy machine. Usually the expected screen comes at once.
PATIENCE = 120


class Terminal:
    """A tmux server of its own with one window that runs `wstac view`, and then prints how it ended."""

    def __init__(self, wstac, arguments, size=(80, 24), variables=()):
        self.socket = f"wstac-view-{os.getpid()}-{time.monotonic_ns()}"
        # The kernel's name of the process.
        self.name = pathlib.Path(wstac).name[:15]
        width, height = size
        command = " ".join([*variables, shlex.quote(str(wstac)), "view", *arguments])
        # What a shell finds afterwards: the exit code, and whether line mode and echo are as before.
        script = f"stty sane; {command}; echo \"left $?\"; stty -a | grep -q ' icanon' && stty -a | grep -q ' echo ' && echo given back; exec sleep 1000"
        self.tmux("-f", "/dev/null", "new-session", "-d", "-x", str(width), "-y", str(height), "sh", "-c", script)

    def tmux(self, *arguments):
        done = subprocess.run(["tmux", "-L", self.socket, *arguments], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise AssertionError(f"tmux {' '.join(arguments)}: {done.stderr.strip()}")
        return done.stdout

    def screen(self, colors=False):
        return self.tmux("capture-pane", "-p", *(["-e"] if colors else []))

    def flag(self, name):
        return self.tmux("display-message", "-p", f"#{{{name}}}").strip()

    def until(self, pattern, what):
        """Waits until the screen shows the pattern. Returns the screen."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            screen = self.screen()
            if re.search(pattern, screen, re.MULTILINE):
                return screen
            time.sleep(0.05)
        raise AssertionError(f"{what}: no {pattern!r} on the screen after {PATIENCE} s:\n{screen}")

    def keys(self, *keys):
        self.tmux("send-keys", *keys)

    def process(self):
        """Returns the process id of wstac, the child of the window's shell."""
        shell = self.flag("pane_pid")
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            children = pathlib.Path(f"/proc/{shell}/task/{shell}/children").read_text().split()
            for child in children:
                with contextlib.suppress(OSError):
                    if pathlib.Path(f"/proc/{child}/comm").read_text().strip() == self.name:
                        return int(child)
            time.sleep(0.02)
        raise AssertionError("wstac does not run")

    def left(self, code):
        """Waits for the end. The terminal must be as before."""
        self.until(r"^left \d+$", "leaving")
        screen = self.until("^given back$", "the terminal's settings")
        assert f"left {code}\n" in screen, f"expected exit code {code}:\n{screen}"
        assert self.flag("alternate_on") == "0", "the terminal is still on its other screen"
        assert self.flag("cursor_flag") == "1", "the cursor is still hidden"
        return screen

    def close(self):
        with contextlib.suppress(AssertionError):
            self.tmux("kill-server")


@contextlib.contextmanager
def view(wstac, *arguments, **options):
    terminal = Terminal(wstac, [*arguments], **options)
    try:
        yield terminal
    finally:
        terminal.close()


def frame(screen):
    return int(re.search(r"frame +(\d+)", screen)[1])


def check_a_slide(wstac):
    with view(wstac, SCENE, *SMALL) as terminal:
        screen = terminal.until(r"baseline \d+/25", "the baseline")
        assert screen.startswith("wstac view  scene: Saw3 at 150 mm/s, 90 degrees"), screen
        screen = terminal.until(r"event \d+/70", "contact")
        assert screen.count("▀") > 200, f"no picture:\n{screen}"
        assert all(name in screen for name in ("r1", "r5", "c1", "c5", "30 fps, nominal")), screen
        screen = terminal.until(r"\bended\b", "the end")
        event = re.search(r"^event at frame 35: slide, speed 1\d\d\.\d ± \d\.\d mm/s, direction (89|90)\.\d ± \d\.\d°", screen, re.MULTILINE)
        assert event, f"no event:\n{screen}"
        assert "events  1" in screen and "dropped 0" in screen, screen
        assert terminal.flag("alternate_on") == "1"
        terminal.keys("q")
        screen = terminal.left(0)
        assert "140 frames, 0 dropped, 1 event" in screen, screen


def check_what_is_not_stated(wstac):
    with tempfile.TemporaryDirectory() as folder:
        video = pathlib.Path(folder) / "slide.y4m"
        video.write_bytes(b"YUV4MPEG2 W40 H40 F30:1 Cmono\n" + 9 * (b"FRAME\n" + bytes(1600)))
        with view(wstac, str(video)) as terminal:
            screen = terminal.until("^readout unknown: ", "the note about the readout")
            assert len(re.findall(r"^no \[layout\] is given", screen, re.MULTILINE)) == 1, screen


def check_keys(wstac):
    with view(wstac, SCENE, *SMALL) as terminal:
        terminal.until(r"watching|event \d+/70", "the baseline's end")
        terminal.keys("Space")
        there = frame(terminal.until("PAUSED", "space"))
        # The time of ten frames.
        time.sleep(0.3)
        assert frame(terminal.screen()) == there, "a file stands still while it is paused"
        terminal.keys("z")
        screen = terminal.until(rf"^at frame {there}: a new baseline", "z")
        terminal.keys("Space")
        screen = terminal.until(r"baseline \d+/25", "going on after z")
        assert frame(screen) >= there, screen
        terminal.keys("C-c")
        terminal.left(0)


def check_removed(wstac):
    """Keys, options and sources that were removed are answered with what to use instead."""
    table = CHANGELOG.read_text().split("\n### From 0.3\n", 1)[1].split("\n### ", 1)[0]
    rows = re.findall(r"^\| (?:.*\bits )?keys? (.*?) \| .*?`(.*?)`", table, re.MULTILINE)
    names = {"←": "Left", "→": "Right", "↑": "Up", "↓": "Down"}
    assert len(rows) == 3, rows
    with view(wstac, SCENE, *SMALL, size=(80, 100)) as terminal:
        there = frame(terminal.until(r"\bended\b", "the end"))
        for keys, instead in rows:
            for count, key in enumerate(re.findall("`(.+?)`", keys), 1):
                terminal.keys(names.get(key, key))
                screen = terminal.until(rf"(?:^.*: was removed; help: {re.escape(instead)}.*\n){{{count}}}", f"the key {key}")
                assert frame(screen) == there, screen
        terminal.keys("q")
        terminal.left(0)
    with view(wstac, f"left={SCENE}", "right=scene:Tri2@120") as terminal:
        screen = terminal.left(2).replace("\n", "")
        assert "was removed; help: wstac serve left=SOURCE right=SOURCE" in screen, screen
    with tempfile.TemporaryDirectory() as folder:
        both = pathlib.Path(folder) / "both.mcap"
        sources = [f"left={SCENE}", "right=scene:Tri2@120"]
        subprocess.run([wstac, "record", *sources, *SMALL, "-o", str(both)], check=True, capture_output=True, timeout=PATIENCE)
        with view(wstac, str(both)) as terminal:
            screen = terminal.left(2).replace("\n", "")
            assert "has sensors left, right, expected one of them as --sensor; wstac serve shows all" in screen, screen
        with view(wstac, str(both), "--sensor", "right") as terminal:
            screen = terminal.until(r"\bended\b", "the end of one")
            assert "picture, white" in screen and "events  1" in screen, screen
            terminal.keys("q")
            terminal.left(0)


def check_sizes(wstac):
    with view(wstac, SCENE, *SMALL, size=(20, 5)) as terminal:
        screen = terminal.until(r"^(baseline|watching|event)", "20 x 5")
        assert screen.splitlines()[4].startswith("q quit"), screen
        terminal.until(r"\bended\b", "the end")
        for width, height, shown in [(120, 40, "picture, white"), (60, 20, "picture, whi"), (40, 12, "^r5"), (40, 10, "^r5"), (20, 5, "^ended"), (80, 24, "picture, white")]:
            terminal.tmux("resize-window", "-x", str(width), "-y", str(height))
            screen = terminal.until(shown, f"{width} x {height}")
            lines = screen.splitlines()
            assert all(len(line) <= width for line in lines), screen
        terminal.keys("q")
        terminal.left(0)


def check_signals(wstac):
    for number, code in [(15, 143), (2, 130), (1, 129)]:
        with view(wstac, SCENE, *SMALL) as terminal:
            terminal.until(r"baseline|watching|event", "the start")
            os.kill(terminal.process(), number)
            terminal.left(code)


def check_a_terminal_that_is_gone(wstac):
    with view(wstac, SCENE, *SMALL) as terminal:
        terminal.until(r"baseline|watching|event", "the start")
        process = terminal.process()
        terminal.tmux("kill-server")
        end = time.monotonic() + PATIENCE
        while pathlib.Path(f"/proc/{process}").exists():
            status = pathlib.Path(f"/proc/{process}/stat")
            with contextlib.suppress(OSError):
                if status.read_text().rsplit(")", 1)[1].split()[0] == "Z":
                    return
            assert time.monotonic() < end, "wstac goes on without its terminal"
            time.sleep(0.05)


def check_colors(wstac):
    """Colors are those of 256 or none, as the terminal announces."""
    for variables, expected, forbidden in [
        (["TERM=xterm-256color", "COLORTERM=truecolor"], r"\x1b\[[0-9;]*[34]8;5;", r"\x1b\[[0-9;]*[34]8;2;"),
        (["COLORTERM=", "TERM=screen-256color"], r"\x1b\[[0-9;]*[34]8;5;", r"\x1b\[[0-9;]*[34]8;2;"),
        (["COLORTERM=", "TERM=screen"], r"[:=+*#%@]{2}", r"\x1b\[[0-9;]*[349][0-8][;m]"),
        (["NO_COLOR=1"], r"[:=+*#%@]{2}", r"\x1b\[[0-9;]*[349][0-8][;m]"),
    ]:
        with view(wstac, SCENE, *SMALL, variables=["env", *variables]) as terminal:
            terminal.until(r"event [2-6]\d/70", "contact")
            terminal.keys("Space")
            terminal.until("PAUSED", "space")
            screen = terminal.screen(colors=True)
            assert re.search(expected, screen), f"{variables}: no {expected}\n{screen}"
            # Colors that the terminal does not have must not appear.
            assert not re.search(forbidden, screen), f"{variables}: {forbidden}\n{screen}"
            terminal.keys("q")
            terminal.left(0)


def check_no_terminal(wstac):
    done = subprocess.run([wstac, "view", SCENE], capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 1 and done.stdout == "", done
    assert "standard output: is no terminal, which wstac view draws on" in done.stderr, done.stderr


def check_a_background(wstac):
    # timeout runs the command in a process group of its own, which the terminal does not wait for.
    with view(wstac, SCENE, variables=["timeout", "60"]) as terminal:
        assert "not in the foreground" in terminal.left(1), terminal.screen()


def check_a_wrong_source(wstac):
    with view(wstac, "nowhere.y4m") as terminal:
        screen = terminal.left(1)
        assert "nowhere.y4m" in screen and "no such file" in screen, screen


def check_a_broken_file(wstac):
    """A file ends inside a frame. Its error is on the screen until q and then on standard error, and the exit code is
    1.
    """
    clip = pathlib.Path(os.environ.get("TMPDIR", "/tmp")) / f"wstac-view-{os.getpid()}.y4m"
    clip.write_bytes(b"YUV4MPEG2 W64 H64 F30:1 Cmono\n" + (b"FRAME\n" + bytes(64 * 64)) * 30 + b"FRAME\n" + bytes(100))
    try:
        with view(wstac, str(clip)) as terminal:
            screen = terminal.until("FAILED|ended", "the file's end")
            if "FAILED" in screen:
                assert clip.name in screen.replace("\n", ""), screen
                terminal.keys("q")
                screen = terminal.left(1)
                assert clip.name in screen, screen
            else:
                assert re.search(r"dropped 1", screen), screen
    finally:
        clip.unlink()


@contextlib.contextmanager
def board():
    """What a board sends of the scene, as a source."""
    sent = pathlib.Path(os.environ.get("TMPDIR", "/tmp")) / f"wstac-board-{os.getpid()}"
    data = subprocess.run([sys.argv[2], SCENE], stdout=subprocess.PIPE, check=True).stdout
    sent.write_bytes(data)
    try:
        yield f"board:{sent}"
    finally:
        sent.unlink()


def check_a_board(wstac):
    with board() as source, view(wstac, source) as terminal:
        # All of it may be on the first screen, which a terminal shows piece by piece.
        for part in ("ended", r"events +1\b", r"\bspeed 1[45]\d\.\d ± "):
            terminal.until(part, "what the board sent")
        terminal.keys("q")
        terminal.left(0)


def main():
    wstac = sys.argv[1]
    checks = [check_no_terminal, check_a_background, check_a_wrong_source, check_a_slide, check_what_is_not_stated, check_keys, check_removed, check_sizes, check_signals, check_a_terminal_that_is_gone, check_colors, check_a_broken_file, check_a_board]
    for check in checks:
        check(wstac)
        print(f"ok: {check.__name__.removeprefix('check_').replace('_', ' ')}", flush=True)


if __name__ == "__main__":
    main()

"""Checks `wstac view` in a real terminal (tmux): the screen, keys, signals and sizes. At the end, the terminal must be
as before.

check.py WSTAC BOARD          checks; BOARD prints what a board sends for a scene
check.py WSTAC BOARD --keep   writes the screens in docs/VIEW.md as well
"""

import contextlib
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = "scene:Saw3@150,90deg"
# Two sensors: their slides go upward and to the right.
TWO = ["cam:left=scene:Saw3@150,90deg", "cam:right=scene:Tri2@120"]
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
        event = re.search(r"^ +35 +1\d\d mm/s +↑  90° +±0° +lit 2\d$", screen, re.MULTILINE)
        assert event, f"no event:\n{screen}"
        assert "events  1" in screen and "dropped 0" in screen, screen
        assert terminal.flag("alternate_on") == "1"
        terminal.keys("q")
        screen = terminal.left(0)
        assert "140 frames, 0 dropped, 1 event" in screen, screen


def check_keys(wstac):
    with view(wstac, SCENE, *SMALL) as terminal:
        terminal.until(r"watching|event \d+/70", "the baseline's end")
        terminal.keys("Space")
        there = frame(terminal.until("PAUSED", "space"))
        # The time of ten frames.
        time.sleep(0.3)
        assert frame(terminal.screen()) == there, "a file stands still while it is paused"
        terminal.keys("z")
        screen = terminal.until(rf"^ +{there}  re-zero", "z")
        terminal.keys("Space")
        screen = terminal.until(r"baseline \d+/25", "going on after z")
        assert frame(screen) >= there, screen
        terminal.keys("?")
        terminal.until(r"^z +re-zero: gather a new baseline", "?")
        terminal.keys("?")
        terminal.until("picture, white", "? again")
        terminal.keys("C-c")
        terminal.left(0)


def check_seek(wstac):
    """Keys go back and forth by seconds and frames, and what was shown is shown again."""
    with view(wstac, SCENE, *SMALL) as terminal:
        terminal.until(r"event \d+/70", "contact")
        terminal.keys("Space")
        there = frame(terminal.until("PAUSED", "space"))
        before = terminal.screen()
        for key, moved in [(".", 1), (".", 1), (",", -1), (",", -1)]:
            there += moved
            terminal.keys(key)
            terminal.until(rf"frame +{there}$", f"the key {key}")
        assert terminal.screen() == before, f"another screen at frame {there}:\n{before}\n{terminal.screen()}"
        terminal.keys("Right")
        terminal.until(rf"frame +{there + 30}$", "right")
        terminal.keys("Left")
        terminal.until(rf"frame +{there}$", "left")
        terminal.keys("Home")
        terminal.until(r"frame +0$", "home")
        terminal.keys("Up")
        screen = terminal.until(r"\bended\b", "up, behind the end")
        assert re.search(r"^ +35 +1\d\d mm/s", screen, re.MULTILINE), f"no event:\n{screen}"
        # From the end, too.
        terminal.keys("Left")
        terminal.until(r"frame +110$", "left from the end")
        terminal.keys("q")
        terminal.left(0)


def frames(screen):
    """The frames of all sensors on the screen."""
    return [int(number) for number in re.findall(r"frame +(\d+)", screen)]


def check_several(wstac):
    """Two sensors are beside each other or below each other, one can be chosen, and keys move both."""
    with view(wstac, *TWO, *SMALL, size=(40, 10), variables=["env", "NO_COLOR=1"]) as terminal:
        screen = terminal.until(r"^left  event \d+/70", "contact")
        lines = screen.splitlines()
        assert lines[0] == "wstac view  2 sensors" and lines[5].startswith("right  "), screen
        assert re.match(r"^[█▀▄·]{10}  30 fps, nominal  0 dropped$", lines[2]), screen
        assert lines[9].startswith("q quit  Tab one"), screen
        terminal.keys("Space")
        terminal.until("^left  PAUSED", "space")
        # The seek begins at a time, and both sensors are there.
        terminal.keys("Home")
        terminal.until(r"^left  PAUSED  frame 0\b(?s:.*)^right  PAUSED  frame 0\b", "home")
        terminal.keys("Right")
        screen = terminal.until(r"^left  PAUSED  frame 30\b(?s:.*)^right  PAUSED  frame 30\b", "right")
        terminal.keys(".")
        terminal.until(r"^left  PAUSED  frame 31\b(?s:.*)^right  PAUSED  frame 31\b", "a step")
        terminal.keys(",")
        terminal.until(r"^left  PAUSED  frame 30\b(?s:.*)^right  PAUSED  frame 30\b", "a step back")
        assert terminal.screen() == screen, f"another screen at frame 30:\n{screen}\n{terminal.screen()}"
        # One alone, by its number and by Tab, and both again.
        for key, shown in [("2", r"^wstac view  right \(2 of 2\)"), ("2", "^wstac view  2 sensors"), ("Tab", r"^wstac view  left \(1 of 2\)"), ("Tab", r"^wstac view  right \(2"), ("Tab", "^wstac view  2 sensors")]:
            terminal.keys(key)
            terminal.until(shown, f"the key {key}")
        terminal.keys("Up")
        terminal.until(r"^left  ended(?s:.*)\d+ mm/s +↑(?s:.*)^right  ended(?s:.*)\d+ mm/s +→", "the end of both")
        for width, height, shown in [(80, 24, "left .*right "), (120, 40, "picture, white.*picture, white"), (40, 24, r"^left  ended(?s:.*) r5 (?s:.*)^right  ended(?s:.*) r5 "), (20, 5, "^wstac view  2 senso…"), (80, 24, "left .*right ")]:
            terminal.tmux("resize-window", "-x", str(width), "-y", str(height))
            screen = terminal.until(shown, f"{width} x {height}")
            lines = screen.splitlines()
            assert all(len(line) <= width for line in lines), screen
        terminal.keys("q")
        screen = terminal.left(0)
        screen = screen.replace("\n", "")
        assert "left: 140 frames" in screen and "right: " in screen, screen


def check_more_sensors_than_fit(wstac):
    sources = [f"cam:s{number}=scene:Saw3@150,seed={number}" for number in range(1, 6)]
    with view(wstac, *sources, "--size", "160x90", size=(40, 10)) as terminal:
        screen = terminal.until(r"^wstac view  5 sensors, 1 not shown", "the count")
        assert "s4  " in screen and "s5  " not in screen, screen
        terminal.keys("5")
        terminal.until(r"^wstac view  s5 \(5 of 5\)", "the key 5")
        terminal.keys("q")
        terminal.left(0)


def check_a_recording_of_several(wstac):
    """A recording of two sensors is shown as both, or as one of them. One source that fails does not stop the other."""
    with tempfile.TemporaryDirectory() as folder:
        both = pathlib.Path(folder) / "both.mcap"
        subprocess.run([wstac, "record", *TWO, *SMALL, "-o", str(both)], check=True, capture_output=True, timeout=PATIENCE)
        with view(wstac, str(both)) as terminal:
            terminal.until(r"left  ended.*right  ended", "the end of both")
            terminal.keys("Left")
            screen = terminal.until(r"frame 1[0-2]\d .*frame 1[0-2]\d", "left from the end")
            assert abs(frames(screen)[0] - frames(screen)[1]) <= 30, screen
            terminal.keys("q")
            terminal.left(0)
        with view(wstac, str(both), "--sensor", "right") as terminal:
            terminal.until(r"\bended\b", "the end of one")
            assert "picture, white" in terminal.screen(), terminal.screen()
            terminal.keys("q")
            terminal.left(0)
        with view(wstac, *TWO, "--record", str(both)) as terminal:
            assert "--record: is given, expected it only with one sensor" in terminal.left(2).replace("\n", "")
        broken = pathlib.Path(folder) / "broken.y4m"
        broken.write_bytes(b"YUV4MPEG2 W64 H64 F30:1 Cmono\n" + (b"FRAME\n" + bytes(64 * 64)) * 10 + b"no frame at all\n" * 500)
        with view(wstac, f"cam:broken={broken}", f"cam:slide={both}", "--sensor", "left") as terminal:
            assert 'sensor is "left", expected only with a recording' in terminal.left(2).replace("\n", "")
        one = pathlib.Path(folder) / "one.mcap"
        subprocess.run([wstac, "record", SCENE, *SMALL, "-o", str(one)], check=True, capture_output=True, timeout=PATIENCE)
        with view(wstac, f"cam:broken={broken}", f"cam:slide={one}") as terminal:
            screen = terminal.until(r"broken  FAILED.*slide  ended", "the end")
            assert re.search(r"35 +1\d\d mm/s", screen), screen
            terminal.keys("q")
            screen = terminal.left(1).replace("\n", "")
            assert "1 of 2 sensors: failed" in screen and "broken.y4m" in screen, screen
        with view(wstac, SCENE, SCENE) as terminal:
            assert "several sources need names" in terminal.left(2).replace("\n", "")


def check_loop(wstac):
    with view(wstac, SCENE, *SMALL, "--loop", "--fast") as terminal:
        terminal.until(r"events +1", "the event")
        # The source starts again: an earlier frame is shown, and its end never.
        end, last, again = time.monotonic() + PATIENCE, 0, 0
        while again < 3 and time.monotonic() < end:
            now = frame(terminal.screen())
            again += now < last
            last = now
        assert again >= 3, f"the source started {again} times again"
        terminal.keys("q")
        terminal.left(0)
    with view(wstac, "-", "--loop") as terminal:
        assert "can be read once" in terminal.left(2).replace("\n", "")


def check_recording(wstac):
    """The key r starts a recording and ends it, and so does q. Both files can be read again."""
    with tempfile.TemporaryDirectory() as folder:
        named = pathlib.Path(folder) / "slide.mcap"
        with view(wstac, SCENE, *SMALL, "--record", str(named), size=(160, 24)) as terminal:
            terminal.until(r"baseline \d+/25|watching", "the baseline")
            terminal.keys("r")
            screen = terminal.until(r"^● REC .*slide\.mcap, [3-9]\d frames, \d+ behind", "r")
            assert "r end recording" in screen, screen
            terminal.keys("r")
            terminal.until(r"slide\.mcap: \d+ frames recorded", "r again")
            terminal.keys("r")
            terminal.until(r"^● REC .*slide-2\.mcap, \d+ frames", "r once more")
            terminal.keys("q")
            screen = terminal.left(0)
            said = [int(frames) for frames in re.findall(r"slide(?:-2)?\.mcap: (\d+) frames recorded", screen)]
            assert len(said) == 2 and min(said) > 0, screen
        for file, frames in zip([named, named.with_name("slide-2.mcap")], said, strict=True):
            done = subprocess.run([wstac, "run", str(file), "--json"], capture_output=True, text=True, check=False, timeout=PATIENCE)
            assert done.returncode == 0, done
            end = json.loads(done.stdout.splitlines()[-1])
            assert end["kind"] == "end" and end["frames"] == frames, (end, frames)
        with view(wstac, SCENE, *SMALL, "--record", str(named)) as terminal:
            assert "exists already" in terminal.left(1).replace("\n", "")


def check_sizes(wstac):
    with view(wstac, SCENE, *SMALL, size=(20, 5)) as terminal:
        screen = terminal.until(r"^(baseline|watching|event)", "20 x 5")
        assert screen.splitlines()[4].startswith("q quit"), screen
        terminal.until(r"\bended\b", "the end")
        for width, height, shown in [(120, 40, "picture, white"), (60, 20, "picture, white"), (40, 12, "^r5"), (40, 10, "^r5"), (20, 5, "^ended"), (80, 24, "picture, white")]:
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
    """Colors are true color, 256, 16 or none, as the terminal announces."""
    for variables, expected, forbidden in [
        (["TERM=xterm-256color", "COLORTERM=truecolor"], r"\x1b\[[0-9;]*[34]8;2;", None),
        (["COLORTERM=", "TERM=screen-256color"], r"\x1b\[[0-9;]*[34]8;5;", r"\x1b\[[0-9;]*[34]8;2;"),
        (["COLORTERM=", "TERM=screen"], r"\x1b\[[0-9;]*[34]8;5;1?[0-9]m", r"\x1b\[[0-9;]*[34]8;(2;|5;(1[6-9]|[2-9][0-9]|[0-9]{3}))"),
        (["NO_COLOR=1"], r"[:=+*#%@]{2}", r"\x1b\[[0-9;]*[349][0-8][;m]"),
    ]:
        with view(wstac, SCENE, *SMALL, variables=["env", *variables]) as terminal:
            terminal.until(r"event [2-6]\d/70", "contact")
            terminal.keys("Space")
            terminal.until("PAUSED", "space")
            screen = terminal.screen(colors=True)
            assert re.search(expected, screen), f"{variables}: no {expected}\n{screen}"
            # tmux may give colors that it takes for others. Colors that the terminal does not have must not appear.
            assert not forbidden or not re.search(forbidden, screen), f"{variables}: {forbidden}\n{screen}"
            terminal.keys("q")
            terminal.left(0)


def check_no_terminal(wstac):
    done = subprocess.run([wstac, "view", SCENE], capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 1 and done.stdout == "", done
    assert "standard output: is no terminal, expected one" in done.stderr, done.stderr


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
                terminal.keys("q")
                screen = terminal.left(1)
                assert clip.name in screen, screen
            else:
                assert re.search(r"dropped 1", screen), screen
    finally:
        clip.unlink()


@contextlib.contextmanager
def board(part=1.0):
    """What a board sends of this part of the scene, as a source."""
    sent = pathlib.Path(os.environ.get("TMPDIR", "/tmp")) / f"wstac-board-{os.getpid()}"
    data = subprocess.run([sys.argv[2], SCENE], stdout=subprocess.PIPE, check=True).stdout
    # A frame of the link ends with a zero.
    sent.write_bytes(data[: data.rindex(b"\0", 0, int(len(data) * part)) + 1])
    try:
        yield f"board:{sent}"
    finally:
        sent.unlink()


def check_a_board(wstac):
    with board() as source, view(wstac, source) as terminal:
        screen = terminal.until("ended", "the end of what the board sent")
        assert re.search(r"events +1\b", screen) and re.search(r"\b1[45]\d\.?\d* mm/s", screen), screen
        terminal.keys("q")
        terminal.left(0)


def check_a_board_beside_a_scene(wstac):
    with board() as source, view(wstac, f"cam:board={source}", f"cam:scene={SCENE}", *SMALL) as terminal:
        screen = terminal.until(r"board  ended.*scene  ended", "the end of both")
        assert len(re.findall(r"35 +1\d\d mm/s", screen)) == 2, screen
        terminal.keys("q")
        terminal.left(0)


def fenced(title, screen):
    """A section of the page with a screen."""
    lines = [line.rstrip() for line in screen.splitlines()]
    return f"\n## {title}\n\n```text\n" + "\n".join(lines).rstrip() + "\n```\n"


def several(wstac, size):
    """The screen of two sensors, paused."""
    with view(wstac, *TWO, size=size, variables=["env", "NO_COLOR=1"]) as terminal:
        terminal.until(r"left .*event [34]\d/70", "contact")
        terminal.keys("Space")
        screen = terminal.until("PAUSED", "space")
        terminal.keys("q")
        terminal.left(0)
    return screen


def keep(wstac):
    """Writes docs/VIEW.md: screens of a camera, of two, and of a board, as text."""
    screens = []
    for size in [(80, 24), (120, 40)]:
        with view(wstac, SCENE, "--model", "builtin:svm", size=size, variables=["env", "NO_COLOR=1"]) as terminal:
            terminal.until(r"event [34]\d/70", "contact")
            terminal.keys("Space")
            terminal.until("PAUSED", "space")
            first = terminal.screen()
            terminal.keys("Space")
            terminal.until(r"\bended\b", "the end")
            screens.append((size, first))
            terminal.keys("q")
            terminal.left(0)
    with board(0.83) as source, view(wstac, source, variables=["env", "NO_COLOR=1"]) as terminal:
        of_board = terminal.until(r"\bended\b", "the end of what the board sent").replace(source.removeprefix("board:"), "board.bytes")
        terminal.keys("q")
        terminal.left(0)
    text = """# The screens of `wstac view`

The first two screens show a simulated slide, paused while it is captured, in two sizes of a terminal without colors.
With colors, the picture has two pixels per character, and the cells of the taxel map are filled.
The picture is scaled so that white is the given percentage of full scale.
Below it, each trace shows one feature, r1 to r5 for rows and c1 to c5 for columns: a dot per frame, and the newest value beside it.
The dashes are the threshold of the trigger.
The lines at the bottom list the events.
`ci/long view --keep` writes this page.
"""
    for (width, height), screen in screens:
        text += fenced(f"{width} × {height}", screen)
    text += SEVERAL
    for width, height in [(80, 24), (40, 10)]:
        text += fenced(f"Two sensors, {width} × {height}", several(wstac, (width, height)))
    text += fenced("A board", of_board).replace("```text", "A board sends features, events and its state, and no pictures.\n\n```text", 1)
    (ROOT / "docs/VIEW.md").write_text(text)
    print("docs/VIEW.md is written")


SEVERAL = """
## Several sensors

    wstac view left=/dev/video0 right=slide.mcap
    wstac view both.mcap

Sensors are next to each other on a wide terminal and below each other on a narrow one.
Tab or the number of a sensor shows it alone.
If not all have room, the first line says how many are not shown.
Files and scenes are on one time line: seek, step, pause and `--loop` move all of them.
The sensors of one recording keep the distances of their times, and other files start together.
A camera, a board or a pipe that stalls or ends does not stop the others.
"""


def main():
    wstac = sys.argv[1]
    checks = [check_no_terminal, check_a_background, check_a_wrong_source, check_a_slide, check_keys, check_seek, check_several, check_more_sensors_than_fit, check_a_recording_of_several, check_loop, check_recording, check_sizes, check_signals, check_a_terminal_that_is_gone, check_colors, check_a_broken_file, check_a_board, check_a_board_beside_a_scene]
    for check in checks:
        check(wstac)
        print(f"ok: {check.__name__.removeprefix('check_').replace('_', ' ')}", flush=True)
    if sys.argv[3:] == ["--keep"]:
        keep(wstac)


if __name__ == "__main__":
    main()

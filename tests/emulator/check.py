#!/usr/bin/env python3
"""Checks the programs of boards with an STM32 on modeled ones: its events and features are those of `wstac run` on the
same frames, whatever happens to the camera.

    check.py WSTAC ELF OPENMV WEACT TAKING SENT CONFIG MODEL OTHER…

WSTAC is the command on the host, ELF is the program of the Nucleo-H743ZI2, OPENMV that of the OpenMV Cam H7, WEACT that
of the WeAct MiniSTM32H743. TAKING takes linear models of the path over the link (feature `models`), and SENT is such a
model. Each OTHER is ELF with this configuration ("-" for the default) and this texture model compiled in. ELF.15,
ELF.25 and ELF.60 are ELF at these frame rates, and ELF.rest lets its sensor rest after 5 seconds without light.
ELF.u575.72 is the program of the Nucleo-U575ZI-Q, and ELF.u575.24 that for 24 MHz; ELF.nicla is that of the Arduino Nicla
Vision. The last OTHER learns textures (feature `learn`). Needs the packages of requirements.txt (`ci/boards emulator`).

Every case plays a rendered scene, frame by frame. It compares the output of `wstac monitor` on the serial line's bytes
with that of `wstac run` on the clip, byte for byte. Frames that a fault has cost may not appear. All others must be
right and in their places.
"""

import json
import re
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

from emulate import CLOCK, FRAME, HEIGHT, WIDTH, Board, cost, frames_of
from machine import AXI, AXI_SIZE, DTCM, Machine, Stopped
from model.camera import M0AR
from model.h747 import NICLA
from model.ports import NUCLEO, OPENMV, SCL, SDA, WEACT
from model.larger import Gc2145, Mt9m114, Ov2640, Ov5640, SlowOv2640
from model.sensor import Hm01b0, Hm0360, Ov7670, Ov7690, Ov7692, Ov7725
from model.u575 import NUCLEO_U575, NUCLEO_U575_SLOW

SCENE = Path(__file__).parents[1] / "firmware" / "two_slides.toml"
# The configuration of a program that is built without one.
CONFIG = Path(__file__).parents[2] / "wstac-fw" / "wstac.toml"
# Requests from the host, as frames: begin, version, sequence, message, value, checksum, end. `wstac monitor` sends the
# same.
HELLO, FEATURES, SAMPLES, KEEP_EVENTS, ACKNOWLEDGE, PICTURE, TIME, SETTINGS, SET, FORGET = 0, 1, 2, 4, 5, 6, 7, 8, 9, 10
MODEL, SEND_MODEL, MODEL_PIECE, FORGET_MODEL = 15, 16, 17, 18
# Messages from the board, by their numbers.
EVENT, PICTURE_PART, PICTURE_END, BOARD_TIME, IN_USE = 3, 13, 14, 15, 16
ANSWER, BOARD_MODEL = 17, 20
BANK2, BANK2_SIZE = 0x0810_0000, 0x10_0000
ROWS = 8  # of a stripe
# Of the OV7725: 240 rows, each of two lines of 784 pixels, at two clocks of 24 MHz per pixel.
READOUT_MS = 239 * 2 * 784 * 2 / 24_000
# Of an HM01B0 with eight wires: 376 clocks, each of 4 of 24 MHz.
HM01B0_READOUT_MS = 239 * 376 * 4 / 24_000
# Limits of the whole program without a model: 100 kB of flash, of which 1 kB sums rows in an interrupt and 1 kB says in
# numbers what a camera sends, which most first flashes need; and 16 KiB of RAM with the ring and the stack, less 100
# bytes. Instructions of a frame of 320 x 240, its reads and writes of the AXI SRAM, which has no variables, and its
# cycles with the time of the sensor's bus have a margin above today's; the goal was 45,000 instructions. The kernel reads
# nine times per row of a taxel, 6,750 times per frame.
BUDGET = {"frame": 46_500, "flash": 100_000, "ram": 16_284, "AXI SRAM": 7_100, "cycles": 200_000}


class Host:
    """Runs the command, and keeps its output for the clip."""

    def __init__(self, wstac, folder):
        self.wstac, self.folder, self.notes = wstac, Path(folder), ""
        self.clip, self.frames = self.rendered(SCENE.read_text(), "clip")

    def rendered(self, text, name, readout_ms=READOUT_MS, fps=30):
        """Returns the clip of a scene before a rolling shutter as a file, and its frames."""
        text = text.replace("[sensor]\n", f"[sensor]\nfps = {fps}\nreadout_ms = {readout_ms}\n")
        scene, clip, raw = (self.folder / f"{name}.{ending}" for ending in ("toml", "y4m", "raw"))
        scene.write_text(text)
        self._says("scene", "render", scene, "-o", clip)
        self._says("scene", "render", scene, "-o", raw)
        return clip, frames_of(raw)

    def of_clip(self, *options, readout_ms=READOUT_MS):
        """Returns the lines of `wstac run`."""
        return self.of_file(self.clip, *options, readout_ms=readout_ms)

    def of_file(self, clip, *options, readout_ms=READOUT_MS):
        """Returns the lines of `wstac run` on another clip."""
        options += () if "--config" in options else ("--config", CONFIG)
        return self._says("run", clip, "--json", "--readout", str(readout_ms), *options).splitlines()

    def of_line(self, data, *options):
        """Returns the lines of `wstac monitor` on bytes that a board sent. Its messages are in `notes`."""
        file = self.folder / "serial"
        file.write_bytes(data)
        return self._says("monitor", file, "--json", *options).splitlines()

    def calibrated(self, source):
        """Returns the configuration that `wstac calibrate` writes, without its first line, which names the source."""
        config = self.folder / "found.toml"
        self._says("calibrate", source, "-o", config, "--force")
        return config.read_text().split("\n", 1)[1]

    def _says(self, *arguments):
        done = subprocess.run([self.wstac, *arguments], capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"check.py: wstac {arguments[0]} failed: {done.stderr}")
        self.notes = done.stderr
        return done.stdout


def request(message, *wanted):
    """Returns the frame of a request."""
    data = bytes([4, 0, message, *wanted])
    data += zlib.crc32(data).to_bytes(4, "little")
    stuffed = b"".join(bytes([len(part) + 1]) + part for part in data.split(b"\0"))
    return b"\0" + stuffed + b"\0"


def contents(data):
    """Returns the contents of the frames in the bytes that a board sent, without version, sequence number and
    checksum."""
    found = []
    for stuffed in data.split(b"\0"):
        content, at = b"", 0
        while at < len(stuffed):
            block = stuffed[at + 1 : at + stuffed[at]]
            at += stuffed[at]
            content += block + (b"\0" if at < len(stuffed) and len(block) < 254 else b"")
        if len(content) > 4 and zlib.crc32(content[:-4]) == int.from_bytes(content[-4:], "little"):
            found.append(varint(content[:-4], 1)[1])
    return found


def as_varint(number):
    """Returns the bytes of a number."""
    data = b""
    while number > 0x7F:
        data, number = data + bytes([number & 0x7F | 0x80]), number >> 7
    return data + bytes([number])


def with_layout(settings, taxel, corners):
    """Returns the bytes of settings with another layout: frame, taxel and corners are their first 54 numbers."""
    numbers = []
    for _ in range(54):
        number, settings = varint(settings)
        numbers.append(number)
    numbers[2:] = [*taxel, *(place for corner in corners for place in corner)]
    return b"".join(map(as_varint, numbers)) + settings


def varint(data, at=0):
    """Returns the number at a place, and the bytes behind it."""
    number = shift = 0
    while True:
        number |= (data[at] & 0x7F) << shift
        shift, at = shift + 7, at + 1
        if data[at - 1] < 0x80:
            return number, data[at:]


def pictures(data):
    """Returns the pictures in the bytes that a board sent: the parts of each, as frame, place and bytes."""
    parts, whole = [], []
    for content in contents(data):
        if content[0] == PICTURE_PART:
            frame, rest = varint(content, 2)
            first, rest = varint(rest)
            length, pixels = varint(rest)
            assert len(pixels) == length
            parts.append((frame, first, pixels))
        elif content[0] == PICTURE_END:
            whole.append(parts)
            parts = []
    return whole


def together(parts):
    """Returns the picture of parts of which each byte came once."""
    parts = sorted(parts, key=lambda part: part[1])
    picture = b""
    for _, first, pixels in parts:
        assert first == len(picture), "a part is missing, or came twice"
        picture += pixels
    return picture


def of_kind(lines, *kinds):
    """Returns the lines of these kinds."""
    return [line for line in lines if json.loads(line)["kind"] in kinds]


def fault_lines(board):
    """Returns the problems in the log, with the clip's frame times since it began."""
    begun = board.camera.began or 0
    said = [(time, line) for time, line in board.log.lines if not line.startswith("info: event") and time >= begun]
    return [((time - begun) / board.frame_time, line.split(": ", 1)[1]) for time, line in said]


class Check:
    """Runs cases and counts failures."""

    def __init__(self, host, elf, wiring=NUCLEO, sensor=Ov7725):
        self.host, self.elf, self.wiring, self.sensor, self.failures = host, elf, wiring, sensor, 0
        self.events = of_kind(host.of_clip(), "event")
        self.features = of_kind(host.of_clip("--features"), "features")

    def board(self, frames, sensor=None, faults=(), elf=None):
        """Returns the board with a clip of these frames."""
        return Board(elf or self.elf, frames, sensor or self.sensor, faults, self.wiring)

    def say(self, name, problems):
        """Prints one line per case."""
        self.failures += bool(problems)
        print(f"{'FAILED' if problems else 'passed'}  {name}")
        for problem in problems:
            print(f"        {problem}")

    def plain(self, sensor, name):
        """Nothing goes wrong, and the host requests nothing."""
        board = self.board(self.host.frames, sensor)
        events = of_kind(self.host.of_line(board.run()), "event")
        # The board's sensor table states it, and the sensor has it by its registers.
        expected = of_kind(self.host.of_clip(readout_ms=board.sensor.readout_ms()), "event")
        problems = [] if events == expected else [f"events are {events}, expected {expected}"]
        if len(expected) != 2 or '"reliable":true' not in expected[0]:
            expectation = "expected 2 events, the first reliable: it shows less than it should"
            problems.append(f"the clip has {expected}, {expectation}")
        problems += [f"the log says {line}" for _, line in fault_lines(board)]
        if "on the chip's clock" in self.host.notes:
            problems.append("the board's clock is not used")
        self.say(name, problems)

    def rate(self, fps, sensor, readout_ms, exposure, count=None):
        """A program for another rate: rate, readout and exposure are those of the registers, and every line is the
        host's."""
        clip, frames = self.host.rendered(SCENE.read_text(), f"{sensor.__name__} at {fps}", readout_ms, fps)
        board = self.board(frames[:count], sensor, elf=f"{self.elf}.{fps}")
        board.sensor.nominal = exposure
        board.line.receive(request(FEATURES, 1))
        lines = self.host.of_line(board.run(), "--features")
        expected = self.host.of_file(clip, "--features", readout_ms=readout_ms)
        problems = [f"the log says {line}" for _, line in fault_lines(board)]
        for kind in ("features",) if count else ("event", "features"):
            found, right = of_kind(lines, kind), of_kind(expected, kind)[: count and count // 3]
            # Above 45 per second, two frames are a feature frame: the first one behind the clip may complete one.
            found = found[: len(right)]
            if found != right or not right:
                counts = f"{len(found)} lines are not the host's {len(right)}"
                problems.append(f"of {kind}, {counts}: {found[:2]}, {right[:2]}")
        has = board.sensor.readout_ms(), board.sensor.period() * fps
        if abs(has[0] - readout_ms) > 1e-6 or abs(has[1] - 1) > 0.004:
            problems.append(f"readout and frame time are {has}, expected {readout_ms} and 1")
        self.say(f"{sensor.__name__} at {fps} per second", problems)

    def other(self, elf, config, model):
        """Another configuration and a texture model, compiled in, have the same effect as on the host."""
        options = [] if config == "-" else ["--config", config]
        expected = of_kind(self.host.of_clip(*options, "--model", model), "event", "texture")
        lines = of_kind(self.host.of_line(self.board(self.host.frames, elf=elf).run()), "event", "texture")
        problems = [] if lines == expected else [f"events are {lines}, expected {expected}"]
        if not expected or expected == self.events:
            problems.append("configuration and model change nothing: this shows less than it should")
        self.say(f"{Path(config).name}, {Path(model).name}", problems)

    def samples(self):
        """A host that requests samples gets them."""
        board = self.board(self.host.frames)
        board.line.receive(request(SAMPLES, 1))
        events = of_kind(self.host.of_line(board.run(), "--samples"), "event")
        expected = of_kind(self.host.of_clip("--samples"), "event")
        self.say("samples", [] if events == expected else ["events with samples are not the host's"])

    def again(self, name, acknowledged):
        """A host that acknowledges events gets them again until it does so, and prints each once."""
        board = self.board(self.host.frames)
        board.line.receive(request(KEEP_EVENTS, 1))
        for number, event in enumerate(map(json.loads, self.events)):
            if acknowledged:
                # The event is complete 70 frames after its first one.
                acknowledge = lambda number=number: board.line.receive(request(ACKNOWLEDGE, number))
                board.camera.faults[event["frame"] + 80] = acknowledge
        sent = bytes(board.run())
        events = of_kind(self.host.of_line(sent), "event")
        problems = [] if events == self.events else [f"events are {events}, expected {self.events}"]
        tries = {}
        for content in contents(sent):
            if content[0] == EVENT:
                # An event's first field is its frame.
                tries[content[1:3]] = tries.get(content[1:3], 0) + 1
        first, *_ = tries.values()
        # Ten frames are a third of a second. The line is still read 4 seconds after the first event.
        if first != 2 if acknowledged else not 5 <= first <= 16:
            problems.append(f"the first event is sent {first} times")
        if len(tries) != len(self.events):
            problems.append(f"{len(tries)} events are sent, expected {len(self.events)}")
        self.say(name, problems)

    def status(self, name):
        """The board reports its chip, its revision and its state to the host."""
        board = self.board(self.host.frames, faults={40: "overrun"})
        board.machine.paint_stack()
        self.host.of_line(board.run(), "--status")
        problems = []
        # The lowest word is the last one.
        if not re.search(r", revision [0-9a-f]{12}, chip 0c0b0a090807060504030201\n", self.host.notes):
            problems.append(f"the host notes {self.host.notes!r}")
        pattern = (
            r"the board: up for (\d+) s, (?:([\d.]+) frames per second, )?(\d) overruns?, 0 restarts, "
            r"(\d+) bytes of stack used, (?:(-?[\d.]+) °C, )?(\d) events?\n"
        )
        states = re.findall(pattern, self.host.notes)
        seconds = [int(state[0]) for state in states]
        # The clock that the frames have is 0.05 % slow, and the first second has no frames.
        if not states or seconds != sorted(seconds) or abs(seconds[-1] - board.machine.now / (30 * FRAME)) > 2:
            problems.append(f"the uptimes are {seconds}")
        elif not 29.9 < float(states[-1][1] or 0) < 30.1 or [states[-1][at] for at in (2, 5)] != ["1", "2"]:
            problems.append(f"the last state is {states[-1]}")
        elif not abs(int(states[-1][3]) - board.machine.deepest_stack()) <= 256:
            problems.append(f"{states[-1][3]} bytes of stack, expected {board.machine.deepest_stack()}")
        elif abs(float(states[-1][4] or 0) - 42.5) > 0.2:
            problems.append(f"{states[-1][4]} °C, expected 42.5")
        self.say(name, problems)

    def clock(self, name):
        """Asked at any time of a frame, the board tells its clock. It differs from the machine's by the same time
        always."""
        board = self.board(self.host.frames[:90])
        us = lambda: board.machine.now * 1_000_000 // CLOCK
        ask = lambda: board.line.receive(request(TIME, *as_varint(us())))
        begin = lambda at: board.machine.at(board.machine.now + at * FRAME // 60, ask)
        for frame in range(20, 80):
            board.camera.faults[frame] = lambda at=frame - 20: begin(at)
        answers = [content for content in contents(board.run()) if content[0] == BOARD_TIME]
        apart = []
        for content in answers:
            host_us, rest = varint(content, 1)
            apart.append(varint(rest)[0] - host_us)
        problems = [] if len(answers) == 60 else [f"{len(answers)} answers, expected 60"]
        if not apart or max(apart) - min(apart) > 1000:
            problems.append(f"the clocks are apart by {apart} us, expected the same within 1000")
        self.say(name, problems)

    def picture(self, name, speed, late=()):
        """While frames are used, a picture is sent. Each part is that of the frame that it names, byte for byte, and no
        feature or event is missing. `late` has frames in which the core stops so many cycles after a stripe.
        """
        board = self.board(self.host.frames)
        board.line.speed = speed
        board.camera.faults[20] = lambda: board.line.receive(request(PICTURE))
        for frame, cycles in dict(late).items():
            board.camera.faults[frame] = lambda cycles=cycles: halt_in_stripe(board, cycles)
        board.line.receive(request(FEATURES, 1))
        data = board.run()
        # Events have no samples without a loss.
        kinds = ["features"] if late else ["features", "event"]
        lines, expected = self.host.of_line(data, "--features"), self.host.of_clip("--features")
        right = [line for line in of_kind(expected, *kinds) if json.loads(line)["frame"] not in dict(late)]
        # A fast line also brings the features of a frame after the clip.
        found = [line for line in of_kind(lines, *kinds) if json.loads(line)["frame"] < len(self.features)]
        problems = [] if found == right else ["features and events are not the host's"]
        found = pictures(data)
        if len(found) != 1:
            problems.append(f"{len(found)} pictures are sent, expected 1")
        for frame, first, pixels in sum(found, []):
            if pixels != self.host.frames[frame][first : first + len(pixels)]:
                problems.append(f"the part at {first} is not that of frame {frame}")
        frames = {frame for frame, *_ in sum(found, [])}
        if found and len(together(found[0])) != WIDTH * HEIGHT:
            problems.append("the picture has another size than a frame")
        if not all(frame + 1 in frames for frame in dict(late)):
            problems.append(f"the picture is over before the core is late: frames {sorted(frames)}")
        self.say(name, problems[:5])

    def calibrate(self, name):
        """A host that asks for pictures, untouched and then pressed on, calibrates the board as it calibrates a
        camera."""
        # A picture takes the board most of a second. So the host gets the bytes of these three over and over.
        dark, lit = self.host.frames[:2], bytes(map(max, zip(*self.host.frames[30:100], strict=True)))
        shown = [*dark, lit]
        board = self.board([dark[0]] * 4000)
        board.line.speed = 16
        board.line.receive(request(HELLO))
        problems, hello, bytes_of = [], b"", []
        for number, frame in enumerate(shown):
            board.machine.run(lambda: board.camera.frame is not None)
            board.camera.clip = [frame] * 4000
            # The frame under way is still the last one.
            begun = board.camera.frame
            board.machine.run(lambda: board.camera.frame > begun + 1)
            from_here = len(board.line.sent)
            hello = hello or bytes(board.line.sent)
            board.line.receive(request(PICTURE))
            board.machine.run(lambda: board.camera.frame > begun + 45)
            bytes_of.append(bytes(board.line.sent[from_here:]))
            found = pictures(bytes_of[-1])
            if len(found) != 1 or together(found[0]) != frame:
                problems.append(f"picture {number} is not the frame, byte for byte")
        order = [0, 1] * 13 + [2] * 6
        raw = self.host.folder / "press.y4m"
        header = f"YUV4MPEG2 W{WIDTH} H{HEIGHT} F30:1 Cmono\n".encode()
        raw.write_bytes(header + b"".join(b"FRAME\n" + shown[number] for number in order))
        sent = self.host.folder / "pictures.bin"
        sent.write_bytes(hello + b"".join(bytes_of[number] for number in order))
        found, expected = self.host.calibrated(f"board:{sent}"), self.host.calibrated(raw)
        if found != expected or "corners" not in found:
            problems.append(f"the board's calibration is {found}, expected {expected}")
        self.say(name, problems[:5])

    def settings(self, name):
        """A layout that is set over the link is kept: after a reset and without power, the answers are the host's with
        it. A bad one is refused, and changes nothing. A reset in the middle leaves the old layout or the new one.
        """
        problems = []

        def asked(board, wanted, *kinds):
            """Sends a request when the board uses frames. Returns the contents that come back until all of these kinds
            have come, or for two seconds.
            """
            board.machine.run(lambda: board.camera.frame is not None)
            sent, until = len(board.line.sent), board.machine.now + 60 * FRAME
            found = lambda: contents(bytes(board.line.sent[sent:]))
            board.line.receive(wanted)
            while board.machine.now < until and not {*kinds} <= {content[0] for content in found()}:
                later = board.machine.now + FRAME
                board.machine.run(lambda later=later: board.machine.now > later)
            return found()

        def in_use(board):
            """Returns the settings in use, and whether they were set."""
            (answer,) = [content for content in asked(board, request(SETTINGS), IN_USE) if content[0] == IN_USE]
            return answer[1:-1], answer[-1]

        def after_power(board, clip=(), sensor=None):
            """Returns the board after it was without power."""
            again = self.board(clip, sensor)
            self.carry(board, again)
            return again

        board = self.board([])
        compiled_in, is_set = in_use(board)
        if is_set:
            problems.append("an empty flash has settings")
        corners = [[40 + 45 * (k % 5), 12 + 44 * (k // 5)] for k in range(25)]
        new = with_layout(compiled_in, [24, 28], corners)
        bad = with_layout(compiled_in, [24, 28], [*corners[:-1], [310, 12]])
        (answer,) = [content for content in asked(board, request(SET, *bad), ANSWER) if content[0] == ANSWER]
        # Refused: the layout, because of a taxel that is outside, the 25th.
        if answer[1:5] != bytes([1, 1, 2, 24]) or in_use(board) != (compiled_in, 0) or board.flash.words:
            problems.append(f"a bad layout is answered by {answer.hex()}, and {in_use(board)} is used")
        answers = asked(board, request(SET, *new), ANSWER, 0)
        if [content[1:] for content in answers if content[0] == ANSWER] != [b"\0"]:
            problems.append(f"a layout is answered by {[content.hex() for content in answers]}")
        if not any(content[0] == 0 for content in answers) or in_use(board) != (new, 1):
            problems.append("it is not used after the restart")
        words = board.flash.words
        toml = self.host.folder / "layout.toml"
        layout = f"[layout]\nframe = [{WIDTH}, {HEIGHT}]\ntaxel = [24, 28]\ncorners = {corners}\n"
        toml.write_text(CONFIG.read_text() + layout)
        expected = of_kind(self.host.of_clip("--config", toml, readout_ms=board.sensor.readout_ms()), "event")
        events = of_kind(self.host.of_line(after_power(board, self.host.frames).run()), "event")
        if events != expected or not events or events == self.events:
            problems.append(f"events are {events}, expected {expected}")
        # Settings without their error correction are not used, and the board starts.
        damaged = after_power(board)
        if self.wiring.chip is not None:
            # The flag of an error that was corrected before.
            damaged.flash.values[damaged.flash.ECCR] = 1 << 30
        damaged.flash.tear(range(BANK2 + 0x8_0000, BANK2 + 0x8_0100, 32 if self.wiring.chip is None else 16))
        if in_use(damaged) != (compiled_in, 0):
            problems.append(f"of damaged settings, {in_use(damaged)} is used")
        # A reset at some of the writes of four bytes, eight of which are a word, or four of an STM32U575.
        left = set()
        writes = 8 if self.wiring.chip is None else 4
        for cut in (1, writes // 2, writes, writes + 1, 2 * writes, writes * words // 2 + 3, writes * words - 1, writes * words):
            other = after_power(board)
            other.flash.cut_after = cut
            asked(other, request(SET, *compiled_in), 0)
            found = in_use(after_power(other))
            left.add(found[0] == new)
            if found not in ((new, 1), (compiled_in, 1)):
                problems.append(f"after a reset at write {cut}, {found} is used")
        if left != {True, False}:
            problems.append("a reset shows the old settings only, or the new ones: this shows less than it should")
        if self.sensor is Ov7725:
            # An exposure is bounded by the sensor that is there, of another one by that one.
            exposed = lambda lines: compiled_in[:-1] + bytes([1]) + as_varint(lines)
            (answer,) = [content for content in asked(board, request(SET, *exposed(501)), ANSWER) if content[0] == ANSWER]
            asked(board, request(SET, *exposed(500)), ANSWER, 0)
            found = answer[1:], in_use(board), in_use(after_power(board, sensor=Gc2145))
            if found != (bytes([1, 2]) + as_varint(501) + as_varint(500), (exposed(500), 1), (exposed(399), 1)):
                problems.append(f"exposures are answered and used as {found}")
        asked(board, request(FORGET), ANSWER, 0)
        if in_use(board) != (compiled_in, 0):
            problems.append("settings are not forgotten")
        self.say(name, problems[:5])

    def models(self, name, elf, model):
        """A model that is sent while events are answered is used after the start that follows, and the answers are then
        those of the host with it. A reset in the middle leaves none.
        """
        problems, file = [], Path(model).read_bytes()
        sent_model = [*as_varint(len(file)), *as_varint(int.from_bytes(file[4:8], "little"))]
        clip = self.host.frames

        def states(board):
            """Returns what the board says of its model: the checksum in use, whether it was sent, and what happened
            last, without what the board takes.
            """
            found = []
            for content in contents(bytes(board.line.sent)):
                if content[0] == BOARD_MODEL:
                    in_use, rest = varint(content, 2) if content[1] else (None, content[2:])
                    # Behind kind and sample is the size, and at the end the newest layout that the board reads.
                    step = varint(rest, 3)[1]
                    found.append((in_use, rest[0], step[:-2] if step[-2:] == bytes([1, 2]) else step))
            return found

        def sending(frames, cut_after=None):
            """Returns the board after a model was sent while these frames came. The board may be reset at a write of
            four bytes.
            """
            board = self.board(frames, elf=elf)
            board.flash.cut_after = cut_after

            def go_on():
                step = (states(board) or [(0, 0, b"")])[-1][2]
                if step[:1] != b"\1":
                    if not step or step == b"\0":
                        board.line.receive(request(SEND_MODEL, *sent_model))
                    return
                at = varint(step, 1 + len(sent_model))[0]
                piece = file[at : at + 160]
                board.line.receive(request(MODEL_PIECE, *as_varint(at), *as_varint(len(piece)), *piece))

            for frame in range(5, len(frames)):
                board.camera.faults[frame] = go_on
            board.run()
            return board

        def after_power(board, frames=clip):
            again = self.board(frames, elf=elf)
            self.carry(board, again)
            again.line.receive(request(MODEL))
            sent = bytes(again.run())
            return of_kind(self.host.of_line(sent), "event"), states(again)[0][:2]

        checksum = int.from_bytes(file[4:8], "little")
        board = sending(clip * 3)
        kept = [step for _, _, step in states(board) if step == bytes([2, *sent_model])]
        if not kept:
            problems.append(f"the model is not kept: {states(board)[-3:]}")
        starts = [content for content in contents(bytes(board.line.sent)) if content[0] == 0]
        if len(starts) != 2:
            problems.append(f"{len(starts)} starts are told, expected that of the power and that with the model")
        until = bytes(board.line.sent)
        events = of_kind(self.host.of_line(until), "event")
        if events[:2] != self.events[:2]:
            problems.append(f"events while the model is sent are {events}, expected {self.events}")
        expected = of_kind(self.host.of_clip("--model", model), "event")
        events, state = after_power(board)
        if events != expected or expected == self.events:
            problems.append(f"events are {events}, expected {expected}")
        if state != (checksum, 1):
            problems.append(f"the model in use is {state}, expected that of {checksum}")
        # A word is eight writes. The last one is that of the head.
        words = board.flash.words
        for cut in (8 * words // 2, 8 * words - 3, 8 * words):
            _, state = after_power(sending(clip[:40] * 6, cut), clip[:12])
            if state not in ((None, 0), (checksum, 1)):
                problems.append(f"after a reset at write {cut} of {8 * words}, {state} is used")
        # It can be forgotten.
        forgets = self.board(clip[:60], elf=elf)
        self.carry(board, forgets)
        forgets.camera.faults[20] = lambda: forgets.line.receive(request(FORGET_MODEL))
        forgets.run()
        events, state = after_power(forgets)
        if (events, state) != (self.events, (None, 0)):
            problems.append(f"after it was forgotten, {state} is used, and events are {events}")
        self.say(name, problems)

    @staticmethod
    def carry(board, again):
        """Gives a board the flash of another one that was without power."""
        again.machine.uc.mem_write(BANK2, bytes(board.machine.uc.mem_read(BANK2, BANK2_SIZE)))
        again.flash.tear(board.flash.torn)

    def faulty(self, name, faults, missing, said):
        """Features of all frames except the `missing` ones are right, and faults are reported within two frame times.

        `said` is what the log must contain, in order, each entry with the frame in which the fault begins.
        """
        board = self.board(self.host.frames, faults=faults)
        for frame, fault in list(board.camera.faults.items()):
            if callable(fault):
                board.camera.faults[frame] = lambda fault=fault: fault(board)
        board.line.receive(request(FEATURES, 1))
        lines = of_kind(self.host.of_line(board.run(), "--features"), "features")
        # Those of a frame after the clip may come, too.
        lines = [line for line in lines if json.loads(line)["frame"] < len(self.features)]
        expected = [line for frame, line in enumerate(self.features) if frame not in missing]
        problems = []
        if lines != expected:
            have = {json.loads(line)["frame"] for line in lines}
            want = set(range(len(self.features))) - set(missing)
            wrong = [json.loads(line)["frame"] for line in lines if line not in expected]
            problems.append(f"frames that are missing, too: {sorted(want - have)[:9]}; wrong or too many: {wrong[:9]}")
        log = fault_lines(board)
        if [line for _, line in log] != [line for _, line in said]:
            problems.append(f"the log says {log}, expected {said}")
        for (at, line), (begins, _) in zip(log, said, strict=False):
            if begins is not None and not begins <= at <= begins + 2:
                problems.append(f"{line!r} at frame {at:.2f}, expected within two frame times of {begins}")
        self.say(name, problems)

    def rests(self, name):
        """A slide begins after a long rest, and the same one follows soon. Of the first one, an answer is absent or not reliable;
        that of the second one is the host's.
        """
        slide = '[[slide]]\nspecimen = "Saw3"\nspeed = 150\ndirection = 90\n'
        scene = f"lead_in = 240\ngap = 70\n[sensor]\nsize = [{WIDTH}, {HEIGHT}]\n{2 * slide}"
        clip, frames = self.host.rendered(scene, "rest", HM01B0_READOUT_MS)
        board = self.board(frames, Hm01b0, elf=f"{self.elf}.rest")
        board.line.receive(request(FEATURES, 1))
        lines = self.host.of_line(board.run(), "--features")
        expected = self.host.of_file(clip, "--features", readout_ms=HM01B0_READOUT_MS)
        events, (first, second) = ([json.loads(line) for line in of_kind(some, "event")] for some in (lines, expected))
        answer = lambda event: [event[key] for key in ("frame", "speed", "direction", "reliable")]
        problems = [f"the log says {line}" for _, line in fault_lines(board)]
        if not events or answer(events[-1]) != answer(second) or any(event["reliable"] for event in events[:-1]):
            problems.append(f"events are {events}, expected the second of {[first, second]} after one that is not reliable")
        sent = {json.loads(line)["frame"] for line in of_kind(lines, "features")}
        begins = first["touch_frame"]
        if len(sent & set(range(begins - 12, begins - 7))) > 2:
            problems.append("the sensor does not rest")
        # The next frame after the first light may still come late.
        if not any({back, back + 1} <= sent for back in range(begins, begins + 8)):
            problems.append("the sensor is not back 7 frames after the touch")
        self.say(name, problems)

    def linear(self, name):
        """The package has no regulator that switches: the board runs on the linear one."""
        board = self.board(self.host.frames[:5])
        board.rcc.pwr.has_smps = False
        board.line.receive(request(FEATURES, 1))
        lines = of_kind(self.host.of_line(board.run(), "--features"), "features")
        self.say(name, [] if lines[:5] == self.features[:5] else [f"features are {lines}"])

    def slow_bus(self, name, sensor=Ov7725, fps=30, readout_ms=READOUT_MS):
        """The sensor's bus has 100 kHz: the core waits for three registers after each frame, and loses none."""
        clip, frames = self.host.rendered(SCENE.read_text(), f"a slow bus at {fps} frames per second", readout_ms, fps)
        board = self.board(frames[:12], sensor, elf=self.elf if fps == 30 else f"{self.elf}.{fps}")
        board.sensor.nominal = 480 * 30 // fps
        board.bus.clock, board.bus.byte_time = lambda: board.machine.now, 9 * CLOCK // 100_000
        begun = []
        board.camera.faults[2] = lambda: begun.append(board.bus.busy)
        board.camera.faults[10] = lambda: begun.append(board.bus.busy)
        board.line.receive(request(FEATURES, 1))
        lines = of_kind(self.host.of_line(board.run(), "--features"), "features")
        expected = of_kind(self.host.of_file(clip, "--features", readout_ms=readout_ms), "features")
        problems = [] if lines and lines == expected[: len(lines)] else ["features are not the host's"]
        if len(lines) != 12 * 30 // fps:
            problems.append(f"features are those of {len(lines)} frames")
        problems += [f"the log says {line}" for _, line in fault_lines(board)]
        # Three times an address, a register, an address and a value.
        if [after - before for before, after in zip(begun, begun[1:], strict=False)] != [8 * 12 * board.bus.byte_time]:
            problems.append(f"the bus ends at cycles {begun}, expected {8 * 12 * board.bus.byte_time} from one to the other")
        self.say(name, problems)

    def start(self, name, said, sensor=Ov7725, **how):
        """The sensor fails when it is first set up: the fault is reported, and then everything works."""
        board = self.board(self.host.frames[:5], sensor)
        for key, value in how.items():
            setattr(board.sensor, key, value)
        board.line.receive(request(FEATURES, 1))
        lines = of_kind(self.host.of_line(board.run(), "--features"), "features")
        # Those of a frame after the clip may come, too.
        problems = [] if lines[:5] == self.features[:5] else [f"features are {lines}"]
        log = [line.split(": ", 1)[1] for _, line in board.log.lines]
        if log != said:
            problems.append(f"the log says {log}, expected {said}")
        self.say(name, problems)

    def never(self, name, said, told, sensor=Ov7725, first=(), elf=None, **how):
        """The sensor cannot be used: this is reported, after `first`, and again to a host that connects later."""
        board = self.board([], sensor, elf=elf)
        for key, value in how.items():
            setattr(board.sensor, key, value)
        machine = board.machine
        machine.at(40 * FRAME, lambda: board.line.receive(request(HELLO)))
        # The next attempt to set it up ends about a second later.
        machine.run(lambda: machine.now > 80 * FRAME)
        log = [line.split(": ", 1)[1] for _, line in board.log.lines]
        expected = [*first, *said, *said]
        problems = [] if log == expected else [f"the log says {log}, expected {expected}"]
        self.host.of_line(board.line.sent)
        notes = re.findall(f"the board: the camera {told}\n", self.host.notes)
        if len(notes) != 2:
            problems.append(f"the host notes {self.host.notes!r}")
        self.say(name, problems)

    def late(self, name):
        """The host is told that there is no camera, then that it sends frames, and its rate only while it does."""
        board = self.board(self.host.frames[:90])
        board.sensor.present = False
        board.machine.at(50 * FRAME, lambda: plug_in(board))
        board.camera.faults[70] = lambda: unplug(board)
        board.machine.run(lambda: board.machine.now > 240 * FRAME)
        self.host.of_line(bytes(board.line.sent), "--status")
        notes = self.host.notes.split("\n")
        camera = [note.split("; ")[0].split(": the camera ")[-1] for note in notes if "the board: the camera" in note]
        gone = "does not answer: its bus is free"
        expected = [gone, "sends frames", "sends no pixels", gone]
        problems = [] if camera == expected else [f"the host is told {camera}, expected {expected}"]
        states = [note for note in notes if "the board: up for" in note]
        rates = [re.search(r", (no frames|[\d.]+ frames per second), ", state) for state in states]
        rates = [rate and rate[1] for rate in rates]
        steps = [rate for at, rate in enumerate(rates) if rate and rate not in rates[at - 1 : at]]
        if len(steps) != 3 or steps[::2] != ["no frames"] * 2 or not steps[1].startswith("30.0"):
            problems.append(f"the rates are {rates}")
        self.say(name, problems)

    def drift(self, name):
        """The rate changes by 4 % while frames are used: this is reported, and they are used again when it is right."""
        board = self.board(self.host.frames)
        board.camera.faults[30] = lambda: board.sensor.slips.update({0x2B: 32})
        board.camera.faults[70] = lambda: board.sensor.slips.clear()
        self.host.of_line(board.run())
        log = fault_lines(board)
        said = [line for _, line in log]
        problems = [] if said == [SENDS, BACK] else [f"the log says {log}"]
        if not problems and not 45 <= log[0][0] <= 92:
            problems.append(f"it is said at frame {log[0][0]:.1f}, expected within 60 frames of 30")
        another_rate = sends("frames at another rate", rate=r"2[89]\.\d\d")
        if not re.search("the board: the camera " + another_rate, self.host.notes):
            problems.append(f"the host notes {self.host.notes!r}")
        self.say(name, problems)

    def crash(self, name, how, why, frames=40, again=None):
        """The program fails: it restarts, reports the reason, and continues. It may be reset `again` some cycles after
        that, before the report is sent; then the report comes after the second restart.
        """
        board = self.board(self.host.frames[:40])
        machine = board.machine
        machine.correct_errors("crash_record")

        def fail():
            how(machine)
            if again:
                machine.at(machine.now + again, lambda: setattr(machine, "reset_wanted", True))

        board.camera.faults[20] = fail
        machine.run(lambda: board.camera.frame is not None and board.camera.frame > frames)
        self.host.of_line(bytes(board.line.sent))
        problems = []
        restarts = 2 if again else 1
        if not re.search(f"it started again because of: {why}; restart {restarts}", self.host.notes):
            problems.append(f"the host notes {self.host.notes!r}")
        log = [line for _, line in board.log.lines]
        if log not in ([SENSOR, LAST_RUN, SENSOR], [SENSOR, LAST_RUN, LAST_RUN, SENSOR]):
            problems.append(f"the log says {log}")
        if machine.losses:
            problems.append(f"the reset loses a part of the record, at {machine.losses[0]:#x}")
        # What was reported is not reported after the next reset.
        machine.reset_wanted, sent, until = True, len(board.line.sent), machine.now + 2 * FRAME
        machine.run(lambda: machine.now > until)
        self.host.of_line(bytes(board.line.sent[sent:]))
        if "started again" in self.host.notes:
            problems.append(f"the host is told again {self.host.notes!r}")
        self.say(name, problems)

    def quiet(self, name):
        """A debugger that asked the program to wait for it reads no log: everything else goes on."""
        # The faults fill the log's 256 bytes.
        board = self.board(self.host.frames[:180], faults=dict.fromkeys(range(5, 170, 2), "overrun"))
        board.log.forgotten = True
        board.line.receive(request(FEATURES, 1))
        lines = of_kind(self.host.of_line(board.run(), "--features"), "features")
        self.say(name, [] if lines[-1:] == self.features[179:180] else [f"the last features are {lines[-1:]}"])

    def own_clock(self, name):
        """The debugger gives no clock: the chip's own is used, and the host is told."""
        board = self.board(self.host.frames[:5])
        board.rcc.has_hse = False
        board.line.receive(request(FEATURES, 1))
        lines = of_kind(self.host.of_line(board.run(), "--features"), "features")
        problems = [] if lines == self.features[:5] else [f"features are {lines}"]
        if "wstac-fw on the chip's clock" not in self.host.notes:
            problems.append(f"the host notes {self.host.notes!r}")
        self.say(name, problems)

    def halted(self, name):
        """A debugger that halts the core does not wake the watchdog: the program has asked for that."""
        board = self.board(self.host.frames[:1])
        board.run()
        registers = {p.base: p for p in board.machine.peripherals}
        freezes = registers[0x5C00_1000].read(0x54) >> 18 & 1
        self.say(name, [] if freezes else ["the watchdog counts while the core is halted"])

    def pulls(self, name):
        """Every input of the camera interface is pulled down, so that a wire that is off does not float."""
        board = self.board(self.host.frames[:1])
        board.run()
        self.say(name, [f"{pin} is not pulled down" for pin in board.ports.floating()])

    def lights(self, name):
        """The light of events changes with each of them, and that of faults is lit from a fault to the next event."""
        board = self.board(self.host.frames, faults={40: "overrun"})
        seen, machine = [], board.machine

        def look():
            lit = board.ports.lit()
            if lit != seen[-1:] and [lit] != seen[-1:]:
                seen.append(lit)
            machine.at(machine.now + FRAME, look)

        machine.at(machine.now + 10 * FRAME, look)
        board.run()
        # No light, the fault, the first event, the second one.
        expected = [[False, False], [False, True], [True, False], [False, False]]
        self.say(name, [] if seen == expected else [f"events and faults are lit {seen}, expected {expected}"])

    def axi_reads(self, name):
        """Reads of the AXI SRAM are limited before the first one, after every reset. Without that, the model stops."""
        board = self.board(self.host.frames[:2])
        problems = []
        try:
            board.machine.run(lambda: board.camera.frame == 0)
            board.machine.reset_wanted, until = True, board.machine.now + FRAME
            board.machine.run(lambda: board.machine.now > until)
        except Stopped as error:
            problems.append(str(error))
        else:
            board = self.board(self.host.frames[:2])
            board.machine.limit_axi_reads = lambda: None
            try:
                board.run()
                problems.append("nothing is read before READ_ISS_OVERRIDE is set, or the model does not look")
            except Stopped as error:
                problems += [] if "before READ_ISS_OVERRIDE is set" in str(error) else [str(error)]
        self.say(name, problems)

    def out_of_reach(self, name):
        """The DMA takes a ring in the AXI SRAM, and none in the DTCM: then no frame is used, and the fault is
        reported."""
        board = self.board(self.host.frames[:5])
        write, places = board.dma.write, []

        def moved(offset, value):
            places.extend([value] if offset == M0AR else [])
            write(offset, DTCM + 0x1_0000 if offset == M0AR else value)

        board.dma.write = moved
        board.machine.run(lambda: board.machine.now > 60 * FRAME)
        log = {line.split(": ", 1)[1] for _, line in board.log.lines}
        problems = [] if log == {FOUND, SENDS} else [f"the log says {log}"]
        problems += [] if all(AXI <= place < AXI + AXI_SIZE for place in places) else [f"the ring is at {places}"]
        self.say(name, problems)

    def own_stack(self, name):
        """The stack is the program's, and not that of the bootloader."""
        board = self.board(self.host.frames[:2])
        board.machine.paint_stack()
        board.run()
        used = board.machine.deepest_stack()
        self.say(name, [] if used > 1000 else [f"{used} bytes of the program's stack are used"])



def sends(what, first=".*", lines=240, words=38400, rate=r"30\.0\d", address=0x21):
    """Returns the expression of what the host says of frames that are not 240 lines of 320 pixels and chroma at 30 per
    second."""
    numbers = (lines, words, rate), (240, 38400, r"30\.00")
    found, right = (f"{lines} lines, {words} words, {rate} per second" for lines, words, rate in numbers)
    return rf"at {address:#x} sends {what} \(found {found}; expected {right}\); help: check {first}"


def silent(why, first):
    """Returns the expression of what the host says of a sensor that does not answer."""
    return f"does not answer: {why}; help: check {first}, .*"


OVERRUN, LOST_SYNC = "overrun: a frame is lost", "lost sync: a frame is lost"
SILENT, GONE, BACK = "the sensor is silent", "no sensor answers", "the sensor sends frames"
FOUND, UNKNOWN = "sensor {}", "the sensor is {=u16:#06x}, which is not known"
FORGETS = "the sensor does not keep register {=u16:#04x}"
SENDS = "{=u32} lines, {=u32} words, {=u32} frames in 1000 seconds"
DIVIDED = "{=u32} times the rate: the clock is divided"
HELD = "the sensor held its bus"
CHROMA_FIRST = "chroma comes first, which is not as it was set: it is left out all the same"
SENSOR, LAST_RUN = f"info: {FOUND}", "error: the last run ended in a panic or a fault: the message says where"


def unplug(board):
    """The sensor's power fails."""
    board.sensor.present = False
    board.sensor.power_on()
    return "silent"


def unplug_in_frame(board, eighths):
    """The sensor's power fails after this part of a frame: no interrupt wakes the core but an alarm."""
    board.machine.at(board.machine.now + eighths * FRAME // 8, lambda: unplug(board))


def plug_in(board):
    """The power is back, and the sensor has forgotten its settings."""
    board.sensor.present = True


def hold(board):
    """The sensor holds the data line, as after a reset in the middle of a read."""
    board.sensor.holds = 4


def deafen(board):
    """The sensor does not answer any more, but sends frames."""
    board.sensor.deaf = True


def cure(board):
    """It answers again."""
    board.sensor.deaf = False


def brown_out(board):
    """The sensor restarts with its defaults: automatic exposure, another size, another rate."""
    board.sensor.power_on()


def storm(board):
    """For 25 ms, an interrupt comes as fast as it is served."""
    board.line.storm_until = board.machine.now + CLOCK // 40


def halt(board):
    """The core does nothing while three stripes arrive."""
    machine = board.machine
    machine.at(machine.now + FRAME // 2, lambda: machine.stall(FRAME // 5))


def halt_in_stripe(board, cycles):
    """The core stops some cycles after the twelfth stripe of a frame, while the next three arrive."""
    machine, line = board.machine, board.camera.line_time
    machine.at(machine.now + (8 + 12 * ROWS - 1) * line + cycles, lambda: machine.stall(3 * ROWS * line))


def halt_at_end(board, cycles):
    """The core stops some cycles after the last rows of a frame, until the next frame's second stripe has begun. Only
    the interrupts at the sync run in between.
    """
    machine, line, sync = board.machine, board.camera.line_time, board.machine.now + board.camera.period
    # 8 lines before the first row, and 240 rows; then the first one and a half stripes of the next frame.
    machine.at(machine.now + 247 * line + cycles, lambda: machine.stall(sync - machine.now))
    machine.at(sync + 800, lambda: machine.stall((8 + 3 * ROWS // 2) * line))


def main():
    if len(sys.argv) < 10 or len(sys.argv) % 3 != 1:
        sys.exit(__doc__)
    _, wstac, elf, openmv, weact, taking, to_send, *other = sys.argv
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        host = Host(wstac, folder)
        check = Check(host, elf)
        check.axi_reads("reads of the AXI SRAM")
        check.out_of_reach("a ring in the DTCM")
        for sensor, name in (
            (Ov7725, "OV7725"), (Ov7690, "OV7690"), (Ov7692, "OV7692"), (Ov7670, "OV7670"), (Hm0360, "HM0360"),
            (Hm01b0, "HM01B0"),
        ):
            check.plain(sensor, name)
        for fps in (15, 25, 60):
            rows, lines = (1, 329) if fps > 30 else (2, 480)
            check.rate(fps, Ov7725, 239 * rows * (576 if fps > 30 else 784) * 2 / 24_000, lines)
        for fps in (15, 25):
            check.rate(fps, Ov7670, 239 * 2 * 784 * 2 / 24_000, 480)
        for sensor, readout_ms, exposure in (
            (Ov2640, 239 * 2.5 * 1190 / 24_000, 630),
            (Gc2145, 239 * 482 / 6_000, 376),
            (Ov5640, 239 * 4 * 1896 / 56_000, 920),
            (Mt9m114, 239 * 862 / 12_000, 420),
        ):
            check.rate(15, sensor, readout_ms, exposure, count=24)
        for fps in (15, 60):
            check.rate(fps, Hm01b0, 239 * 376 * 4 / 24_000, 240 if fps > 30 else 480)
            check.rate(fps, Hm0360, 239 * 376 * 4 / 24_000, 240 if fps > 30 else 480)
        check.start("an HM0360 that is twice as fast", [FOUND, DIVIDED], Hm0360, halves=False)
        check.start("an HM01B0 with clocks before its pixels", [FOUND], Hm01b0, slips={0x3060: 0x09})
        for sensor in (Ov7690, Ov7692):
            check.rate(60, sensor, 239 * 776 * 2 / 24_000, 240, count=24)
        for at in range(0, len(other), 3):
            config, model, other_elf = other[at : at + 3]
            check.other(other_elf, config, model)
        check.models("models over the link", taking, to_send)
        check.samples()
        check.status("state of the board")
        check.clock("the board's clock")
        check.again("events that are acknowledged", acknowledged=True)
        check.again("events that are not acknowledged", acknowledged=False)
        check.picture("a picture at twice the speed of the line", 2)
        check.picture("a picture at 921,600 bits per second", 8)
        late = {frame: 150 * (frame - 20) for frame in range(24, 48, 2)}
        check.picture("a picture while the core is late", 4, late)
        check.calibrate("wstac calibrate")
        check.settings("settings")
        check.faulty("features", {}, (), [])
        check.slow_bus("a bus of 100 kHz")
        check.slow_bus("a bus of 100 kHz at 60 frames per second", Ov7690, 60, 239 * 776 * 2 / 24_000)
        check.faulty("overrun", {40: "overrun"}, [40], [(40, OVERRUN)])
        check.faulty("late core", {40: halt}, [40], [(40, OVERRUN)])
        # While the last rows are read, and after that.
        reading, idle = (lambda board, cycles=cycles: halt_at_end(board, cycles) for cycles in (300, 50_000))
        check.faulty("late in a frame's last rows", {40: reading}, [40, 41], [(40, OVERRUN)])
        check.faulty("late after them", {40: idle}, [], [])
        check.faulty("an interrupt storm", {40: storm}, [40], [(40, LOST_SYNC)])
        check.faulty("lost sync", {50: "lost sync"}, [50], [(50, LOST_SYNC)])
        check.faulty("sync inside a frame", {60: "sync inside"}, [60], [(60, LOST_SYNC)])
        check.faulty("silent for two frames", {70: "silent", 71: "silent"}, range(70, 85), [(70, SILENT), (None, BACK)])
        check.faulty("unplugged", {90: unplug, 100: plug_in}, range(90, 120), [(90, SILENT), (90, GONE), (None, BACK)])
        for eighths in (2, 5, 7):
            stop = lambda board, eighths=eighths: unplug_in_frame(board, eighths)
            name = f"unplugged after {eighths}/8 of a frame"
            check.faulty(name, {90: stop}, range(90, 999), [(90, SILENT), (90, GONE)])
        # While the program looks for an OV7690: twice in the identity, at the reset, and in the settings; in a write,
        # an address and a read.
        for at in (0, 4, 9, 12, 13, 14, 15):
            said = [FOUND] if at == 0 else [GONE, FOUND, BACK]
            check.start(f"no acknowledge at step {at}", said, nack_after=at)
        floats = silent("nothing pulls SDA and SCL up", "that it is connected")
        check.never("no sensor", [GONE], floats, present=False, pulls_up=False)
        is_free = silent("its bus is free", "the sensor's XCLK")
        check.never("no clock of the sensor", [GONE], is_free, is_on=lambda: False)
        for shorted, what, first in (
            ([SDA], "SDA is", "SDA for a short circuit"),
            ([SCL], "SCL is", "SCL for a short circuit"),
            ([SCL, SDA], "SDA and SCL are", "the camera's power"),
        ):
            pins, name = [pin for _, pin in shorted], f"{what} held low"
            check.never(name, [GONE], silent(name, first), shorted=pins, present=len(pins) == 1)
        check.late("a camera that comes late")
        other_sensor = lambda: Ov7725(0x21, {0x0A: 0x26, 0x0B: 0x56})
        unknown = "says it is 0x2656, which the firmware does not know"
        check.never("another sensor", [UNKNOWN], unknown, sensor=other_sensor)
        slower = r"says it is 0x2481 \(an MT9M114, which has at most 30 frames per second; .*"
        check.never("an MT9M114 at 60 frames per second", [UNKNOWN], slower, Mt9m114, elf=f"{check.elf}.60")
        kept = (
            r"does not keep what register 0x64 is set to \(address 0x21, found 0x1f, expected 0xfb\); help: check the "
            "sensor's type, the supply voltage, .*"
        )
        check.never("a setting that is not taken", [FORGETS], kept, stuck=0x64)
        # What only the frames show: the firmware reads back what it wrote.
        another, clock = "frames at another rate", "the sensor's clock, 24 MHz, then register 0x11"
        order = "bytes in another order, or with color"
        wires = "the wires HREF, VSYNC and PCLK and the number of data wires"
        for name, slips, first, told in (
            (
                "60 frames per second whatever the divider", {0x11: 0x00}, [DIVIDED],
                sends(another, clock, rate=r"60\.\d\d"),
            ),
            ("45 frames per second", {0x0D: 0x81}, [], sends(another, clock, rate=r"4[45]\.\d\d")),
            (
                "VGA", {0x65: 0x20}, [],
                sends("frames of another size", f"{wires}, then register 0x29", lines=480, words=153600),
            ),
            ("RGB", {0x12: 0x06}, [], sends(order, "the data wires and the sensor's type, then register 0x0c")),
        ):
            check.never(name, [SENDS], told, first=[FOUND, *first], slips=slips)
        slow = sends(another, clock, rate=r"22\.[45]\d", address=0x30)
        check.never("an OV2640 as OpenMV's driver counts", [SENDS], slow, SlowOv2640, first=[FOUND])
        check.start("60 frames per second", [FOUND, DIVIDED], slips={0x0D: 0xC1})
        check.start("chroma first", [FOUND, CHROMA_FIRST], slips={0x0C: 0x00})
        check.faulty("brown-out", {60: brown_out}, range(60, 74), [(60, FORGETS), (None, BACK)])
        check.drift("the rate changes by 4 %")
        check.start("data line held low", [HELD, FOUND], holds=5)
        check.faulty("data line held low for a while", {40: hold}, [], [(40, HELD)])
        check.faulty("frames without an answer", {40: deafen, 75: cure}, range(69, 91), [(69, GONE), (None, BACK)])
        hard_fault = r"hard fault at 0x30000100, called from 0x\w+, fault status 0x\w+"
        check.crash("hard fault", Machine.crash, hard_fault)
        check.crash("hard fault, and a reset before it is reported", Machine.crash, hard_fault, again=FRAME // 4)
        check.crash("panic", Machine.panic, r"panic at \S*/src/lib\.rs:\d+: explicit panic")
        unknown = "an interrupt without a handler: 3"
        check.crash("interrupt without a handler", lambda machine: machine.interrupt(3), unknown)
        hung = "the program hung, and the watchdog ended it"
        check.crash("the program hangs", lambda machine: machine.stall(150 * FRAME), hung, frames=180)
        check.quiet("a debugger that reads no log")
        check.own_clock("no clock from the debugger")
        check.halted("halted by a debugger")
        check.pulls("pulled inputs")
        check.lights("lights")
        words, found = cost(elf, host.frames)
        print(words)
        above = ((key, limit) for key, limit in BUDGET.items() if found[key] > limit)
        over = [f"{found[key]:,.0f} of {key}, above the budget of {limit:,}" for key, limit in above]
        check.say("budget", over)
        check.rests("a slide after a rest")
        failures = check.failures + check_openmv(host, openmv) + check_weact(host, weact) + check_u575(host, elf) + check_nicla(host, f"{elf}.nicla")
    print(f"{failures} failed; {time.monotonic() - start:.0f} s")
    sys.exit(1 if failures else 0)


def check_openmv(host, elf):
    """Runs the cases that depend on the board for an OpenMV Cam H7, whose bootloader starts the program. Returns the
    number of failures.
    """
    print("OpenMV Cam H7:")
    check = Check(host, elf, OPENMV)
    check_board(check)
    check.plain(Mt9m114, "its MT9M114")
    newer = Check(host, elf, OPENMV, Mt9m114)
    # It answers later after a reset.
    newer.faulty("its MT9M114, silent for two frames", {70: "silent", 71: "silent"}, range(70, 89), [(70, SILENT), (None, BACK)])
    check.own_stack("stack")
    check.picture("a picture at 921,600 bits per second", 8)
    return check.failures + newer.failures


def check_weact(host, elf):
    """Runs the cases that depend on the board for a WeAct MiniSTM32H743, with each sensor for its socket.
    Returns the number of failures.
    """
    print("WeAct MiniSTM32H743:")
    check = Check(host, elf, WEACT)
    check_board(check)
    for sensor in (Ov7690, Ov7692, Ov7670, Ov2640, Gc2145, Ov5640, Hm0360, Hm01b0):
        check.plain(sensor, sensor.__name__)
    return check.failures


def check_u575(host, elf):
    """Runs the cases that depend on the board for a Nucleo-U575ZI-Q, at both of its clocks. Returns the number of failures."""
    print("Nucleo-U575ZI-Q:")
    check = Check(host, f"{elf}.u575.72", NUCLEO_U575)
    check_board(check)
    for sensor in (Ov7670, Hm0360, Hm01b0):
        check.plain(sensor, sensor.__name__)
    check.settings("settings")
    check.linear("no regulator that switches")
    slow = Check(host, f"{elf}.u575.24", NUCLEO_U575_SLOW, Hm01b0)
    slow.plain(Hm01b0, "24 MHz")
    slow.settings("settings at 24 MHz")
    words, _ = cost(slow.elf, host.frames, Hm01b0, NUCLEO_U575_SLOW)
    print(words)
    return check.failures + slow.failures


def check_nicla(host, elf):
    """Runs the cases that depend on the board for an Arduino Nicla Vision, whose bootloader starts the program. Returns the
    number of failures.
    """
    print("Arduino Nicla Vision:")
    check = Check(host, elf, NICLA)
    check_board(check)
    check.plain(Gc2145, "its GC2145")
    check.settings("settings")
    check.own_stack("stack")
    return check.failures


def check_board(check):
    """Runs the cases that depend on any board."""
    if check.wiring.chip is None:
        check.axi_reads("reads of the AXI SRAM")
    check.plain(Ov7725, "events")
    check.faulty("features", {}, (), [])
    check.faulty("lost sync", {50: "lost sync"}, [50], [(50, LOST_SYNC)])
    check.faulty("silent for two frames", {70: "silent", 71: "silent"}, range(70, 85), [(70, SILENT), (None, BACK)])
    # The board has resistors.
    check.never("no sensor", [GONE], silent("its bus is free", "the sensor's XCLK"), present=False)
    check.start("data line held low", [HELD, FOUND], holds=5)
    hard_fault = r"hard fault at 0x30000100, called from 0x\w+, fault status 0x\w+"
    check.crash("hard fault", Machine.crash, hard_fault)
    check.own_clock("no clock from the crystal")
    check.pulls("pulled inputs")
    check.lights("lights")


if __name__ == "__main__":
    main()

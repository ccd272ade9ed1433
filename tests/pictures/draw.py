"""Draws the pictures of the README and the book from what the program prints: the sensor, one slide from frames to answer, a slip, the
screens of wstac view and wstac doctor, a figure of wstac plot, and the overlay of wstac calibrate.

draw.py WSTAC FOLDER           writes them
draw.py WSTAC FOLDER --check   compares what they say with those in the folder
"""

import base64
import html
import json
import math
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import zlib

from terminal import picture as as_picture
from terminal import screen

SCENE = "scene:Saw3@150,90deg"
HELD = pathlib.Path(__file__).parents[1] / "firmware/held.toml"
# The frames that are shown, and how long one of them and the answer stay.
FIRST, LAST, STEP = 32, 70, 2
SECONDS, HOLD = 0.2, 3.2
FONT = "font-family='Helvetica, Arial, sans-serif'"
INK, CALM, GREEN, PAPER = "#1f2328", "#59636e", "#1a9f3c", "#ffffff"
ROWS_AND_COLUMNS = [f"{axis}{number}" for axis in "rc" for number in range(1, 6)]


def text(x, y, content, size=13, anchor="start", fill=INK, weight="normal"):
    return f"<text x='{x}' y='{y}' {FONT} font-size='{size}' text-anchor='{anchor}' fill='{fill}' font-weight='{weight}'>{html.escape(content)}</text>"


def svg(width, height, title, parts):
    card = f"<rect width='{width}' height='{height}' rx='8' fill='{PAPER}'/>"
    head = f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' viewBox='0 0 {width} {height}' role='img'>"
    return "\n".join([head, f"<title>{html.escape(title)}</title>", card, *parts, "</svg>"]) + "\n"


def png(pixels):
    """Returns a picture of 8 bits of green as PNG."""
    chunk = lambda name, data: struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    head = struct.pack(">IIBBBBB", len(pixels[0]), len(pixels), 8, 3, 0, 0, 0)
    # A dark picture with a green glow, which is brighter than in the frame so that it is seen.
    palette = bytes(part for light in range(256) for part in (light // 5, min(255, 18 + 3 * light), light // 3))
    lines = b"".join(b"\0" + bytes(line) for line in pixels)
    parts = [(b"IHDR", head), (b"PLTE", palette), (b"IDAT", zlib.compress(lines, 9)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts)


class Run:
    """What a scene of this size gives: its frames, the taxels in them, and the records."""

    def __init__(self, wstac, scene, width, height):
        run = lambda *arguments: subprocess.run([wstac, *arguments], check=True, capture_output=True).stdout
        with tempfile.TemporaryDirectory() as folder:
            raw = pathlib.Path(folder) / "frames.raw"
            run("scene", "render", scene, "-o", str(raw))
            data = raw.read_bytes()
        self.width, self.height = width, height
        self.frames = [data[at : at + width * height] for at in range(0, len(data), width * height)]
        # The paper layout (docs/SPEC.md, section 1).
        side = min(width, height)
        axis = lambda size: [((size - side) // 2 + (15 + 80 * number) * side // 400, side // 8) for number in range(5)]
        self.columns, self.rows = [[(at, at + taxel) for at, taxel in axis(size)] for size in (width, height)]
        self.lines = [json.loads(line) for line in run("run", scene, "--json", "--features").splitlines()]

    def of(self, kind):
        """Returns the records of a kind."""
        return [line for line in self.lines if line["kind"] == kind]

    def taxels(self, frame):
        """Returns the mean light of every taxel, row by row."""
        pixels = self.frames[frame]
        means = []
        for top, bottom in self.rows:
            for left, right in self.columns:
                total = sum(sum(pixels[y * self.width + left : y * self.width + right]) for y in range(top, bottom))
                means.append(total / ((bottom - top) * (right - left)))
        return means

    def picture(self, frame):
        """Returns the picture around the taxels, every sixth pixel of it."""
        pixels, border = self.frames[frame], 27
        ys = range(self.rows[0][0] - border, self.rows[-1][1] + border, 6)
        xs = range(self.columns[0][0] - border, self.columns[-1][1] + border, 6)
        return [[pixels[y * self.width + x] if 0 <= y < self.height and 0 <= x < self.width else 0 for x in xs] for y in ys]


def arrow(x, y):
    return f"<path d='M{x} {y}h20m-7 -6l7 6l-7 6' stroke='{CALM}' stroke-width='2' fill='none'/>"


def film_of(count, seconds):
    """Returns what makes a film of an attribute that has so many values, each for so many seconds; the last one stays longer."""
    total = count * seconds + HOLD
    times = ";".join(f"{number * seconds / total:.4f}" for number in range(count))
    return lambda name, values: (
        f"<animate attributeName='{name}' calcMode='discrete' dur='{total:.1f}s' repeatCount='indefinite' "
        f"keyTimes='{times}' values='{';'.join(values)}'/>"
    )


def taxels(x, y, lights, still, film):
    """Returns 25 squares whose light is that of each frame in turn."""
    peak = max(max(light) for light in lights)
    for number in range(25):
        opacities = [f"{0.06 + 0.94 * math.sqrt(light[number] / peak):.2f}" for light in lights]
        place = f"x='{x + number % 5 * 37}' y='{y + number // 5 * 37}' width='34' height='34' rx='4'"
        yield f"<rect {place} fill='{GREEN}' fill-opacity='{opacities[still]}'>{film('fill-opacity', opacities)}</rect>"


def slip(wstac):
    """Draws how a part that is pressed on and held slips: the light of the whiskers, and its sum over time."""
    run = Run(wstac, f"scene:{HELD}", 400, 400)
    (found,) = run.of("slip")
    first, last = found["held_since_frame"] - 6, found["frame"] + 14
    film = film_of(last - first, 0.1)
    lights = [run.taxels(frame) for frame in range(first, last)]
    sums = [math.log(sum(light)) for light in lights]
    x = lambda frame: 260 + 640 * (frame - first) / (last - first - 1)
    y = lambda value: 222 - 150 * (value - min(sums)) / (max(sums) - min(sums))
    points = " ".join(f"{x(first + number):.1f},{y(value):.1f}" for number, value in enumerate(sums))
    heads = [(20, "25 whiskers"), (260, "their light over time"), (x(found["held_since_frame"]), "press"), (x(found["onset_frame"]) - 130, "hold")]
    parts = [text(at, 34 + 26 * (number > 1), head, 15, weight="bold" if number < 2 else "normal") for number, (at, head) in enumerate(heads)]
    parts += taxels(20, 50, lights, found["frame"] - first, film)
    parts.append(f"<polyline points='{points}' fill='none' stroke='{GREEN}' stroke-width='2'/>")
    # What has not happened yet is covered.
    covers = [f"{x(frame) + 2:.1f}" for frame in range(first, last)]
    parts.append(f"<rect x='{covers[-1]}' y='64' width='680' height='166' fill='{PAPER}'>{film('x', covers)}</rect>")
    parts.append(f"<rect x='904' y='64' width='700' height='166' fill='{PAPER}'/>")
    shown = ["1" if frame >= found["frame"] else "0" for frame in range(first, last)]
    at = x(found["frame"])
    mark = f"<path d='M{at:.1f} 70V228' stroke='{INK}' stroke-dasharray='4 3'/>" + text(at - 6, 60, "slip", 15, "end", weight="bold")
    parts.append(f"<g>{film('opacity', shown)}{mark}</g>")
    parts.append(text(20, 258, "a part is pressed on, held for 1 s, and slips at 60 mm/s", 12, fill=CALM))
    parts.append(text(900, 258, f"known at frame {found['frame']}, onset at frame {found['onset_frame']}; three times slower", 12, "end", CALM))
    return svg(920, 274, "The light of a part that is pressed on, held, and slips", parts)


def slide(wstac):
    """Draws one slide: frames, taxels, features and the answer, as a film that repeats."""
    shown = Run(wstac, SCENE, 1280, 720)
    frames = list(range(FIRST, LAST, STEP))
    film, features = film_of(len(frames), SECONDS), [line["f"] for line in shown.of("features")]
    parts = []
    heads = [(20, "camera frame"), (250, "25 taxel sums"), (480, "10 features"), (720, "answer")]
    parts += [text(x, 34, head, 15, weight="bold") for x, head in heads]
    parts += [arrow(x, 142) for x in (215, 445, 688)]

    # Every frame is a picture that is seen in its time; the last one stays.
    for number, frame in enumerate(frames):
        data = base64.b64encode(png(shown.picture(frame))).decode()
        values = ["1" if other == number else "0" for other in range(len(frames))]
        still = 1 if number == len(frames) // 2 else 0
        parts.append(f"<image x='20' y='50' width='184' height='184' opacity='{still}' href='data:image/png;base64,{data}'>{film('opacity', values)}</image>")

    parts += taxels(250, 50, [shown.taxels(frame) for frame in frames], len(frames) // 2, film)

    low, high = min(map(min, features)), max(map(max, features))
    for number, name in enumerate(ROWS_AND_COLUMNS):
        bottom = 66 + number * 18.4
        point = lambda k, value, bottom=bottom: f"{506 + (k - FIRST) * 168 / (LAST - FIRST):.1f},{bottom - 15 * (value - low) / (high - low):.1f}"
        line = " ".join(point(frame, features[frame][number]) for frame in range(FIRST, LAST))
        parts.append(text(480, bottom - 2, name, 11, fill=CALM))
        parts.append(f"<polyline points='{line}' fill='none' stroke='{GREEN}' stroke-width='1.5'/>")
    # What has not happened yet is covered.
    covers = [f"{506 + (frame - FIRST) * 168 / (LAST - FIRST):.1f}" for frame in frames[:-1]] + ["676"]
    parts.append(f"<rect x='676' y='48' width='172' height='190' fill='{PAPER}'>{film('x', covers)}</rect>")
    parts.append(f"<rect x='676' y='44' width='220' height='200' fill='{PAPER}'/>")
    parts.append(arrow(688, 142))

    (event,) = shown.of("event")
    texture = event["texture"]
    direction = "upward" if abs(event["direction"]["deg"] - 90) < 10 else ""
    answer = [
        (event["contact"], 20),
        (f"{event['speed']['mm_s']:.1f} ± {event['speed']['sd']:.1f} mm/s", 17),
        (f"{event['direction']['deg']:.1f} ± {event['direction']['sd']:.1f}° {direction}".strip(), 17),
        (f"{texture['specimen']}: saw teeth of {texture['depth_mm']:.0f} mm", 15),
        (f"probability {texture['confidence']:.3f}", 13),
    ]
    hidden = ["0"] * (len(frames) - 1) + ["1"]
    lines = "".join(text(720, 90 + number * 30, content, size) for number, (content, size) in enumerate(answer))
    parts.append(f"<g>{film('opacity', hidden)}{lines}</g>")
    parts.append(text(20, 258, f"wstac run {SCENE}", 12, fill=CALM))
    parts.append(text(940, 258, f"frames {FIRST} to {LAST - 1} of 140, three times slower", 12, "end", CALM))
    truth = "a simulated slide of a saw-shaped specimen at 150 mm/s, upward"
    return svg(960, 274, f"From camera frames to an answer: {truth}", parts)


def sensor():
    """Draws what the sensor is, from the side and from behind."""
    parts = [text(20, 34, "from the side", 15, weight="bold"), text(640, 34, "what the camera sees", 15, weight="bold")]
    teeth = " ".join(f"{60 + 32 * number},{64 if number % 2 else 84}" for number in range(12))
    parts.append(f"<polygon points='60,52 {teeth} 412,52' fill='#c9ced6'/>")
    parts.append(f"<path d='M430 66h46m-8 -7l8 7l-8 7' stroke='{INK}' stroke-width='2' fill='none'/>")
    parts.append(text(430, 52, "slides", 13))
    parts.append(f"<rect x='60' y='148' width='352' height='34' rx='4' fill='#e8e4dc' stroke='{CALM}'/>")
    for number in range(5):
        x, lean = 92 + 72 * number, (0, 10, 16, 6, 0)[number]
        parts.append(f"<path d='M{x - 5} 150L{x + lean - 3} 90h6L{x + 5} 150z' fill='#8d959f'/>")
        if lean:
            parts.append(f"<circle cx='{x}' cy='156' r='{6 + lean / 3:.1f}' fill='{GREEN}' fill-opacity='{0.3 + lean / 24:.2f}'/>")
    parts.append(f"<path d='M236 250L120 186M236 250L352 186' stroke='{CALM}' stroke-dasharray='4 4'/>")
    parts.append(f"<rect x='206' y='244' width='60' height='36' rx='4' fill='{INK}'/><circle cx='236' cy='246' r='10' fill='{CALM}'/>")
    for x, y, content in (
        (430, 108, "5 × 5 whiskers"),
        (430, 154, "base of a whisker: glows"),
        (430, 172, "green while it bends"),
        (430, 192, "elastomer"),
        (280, 268, "camera, 30 frames per second"),
    ):
        parts.append(text(x, y, content, 13))
    parts.append(f"<rect x='640' y='50' width='230' height='230' rx='4' fill='#101418'/>")
    for number in range(25):
        x, y = 662 + number % 5 * 46, 72 + number // 5 * 46
        light = (0.05, 0.45, 0.9, 0.3, 0.05)[number % 5] * (0.8, 0.95, 1, 0.95, 0.8)[number // 5]
        parts.append(f"<circle cx='{x}' cy='{y}' r='11' fill='#35e065' fill-opacity='{light:.2f}'/>")
        parts.append(f"<rect x='{x - 16}' y='{y - 16}' width='32' height='32' fill='none' stroke='#59636e'/>")
    for x, y, content in (
        (886, 76, "taxels: the squares"),
        (886, 94, "around the bases;"),
        (886, 112, "their light is summed"),
        (886, 160, "r1 to r5: rows"),
        (886, 178, "c1 to c5: columns"),
    ):
        parts.append(text(x, y, content, 13))
    return svg(1060, 300, "The sensor: a surface bends whiskers, whose bases glow, and a camera sees the 25 bases from behind", parts)


def view(wstac):
    """The screen of wstac view while something slides, and its event is there."""
    lines = screen([wstac, "view", SCENE], 120, 36, r"events +1", [("Space", "PAUSED")])
    return as_picture("The screen of wstac view: picture, taxels, traces and motion", lines, 120)


def doctor(wstac):
    """What wstac doctor prints."""
    command = [wstac, "doctor", SCENE]
    lines = ["$ wstac doctor " + SCENE, *screen(command, 100, 24, "Nothing to change")]
    while not lines[-1].strip():
        lines.pop()
    return as_picture("What wstac doctor prints of a sensor", lines, 100)


def plot(wstac):
    """The figure of one event."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "plot.svg"
        subprocess.run([wstac, "plot", SCENE, "-o", path], check=True, capture_output=True)
        return path.read_text()


def calibrate(wstac):
    """The overlay of a calibration, as PNG."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "calibrate.png"
        subprocess.run([wstac, "calibrate", SCENE, "-o", path.with_suffix(".toml"), "--overlay", path, "--size", "640x360"], check=True, capture_output=True)
        return path.read_bytes()


def says(picture):
    """Returns the texts of a picture. Pixels and lines may differ in their last digits between processors."""
    return re.findall(r"<(?:text|title)[^>]*>([^<]*)<", picture)


def labels(picture):
    """Returns the words of a screen. Its numbers are those of the moment that it was taken."""
    return {word for said in says(picture) for word in re.findall("[A-Za-z]{2,}", said)}


# Each picture, what draws it, and what of it is compared.
PICTURES = {
    "sensor.svg": (lambda _: sensor(), says),
    "slide.svg": (slide, says),
    "slip.svg": (slip, says),
    "view.svg": (view, labels),
    "doctor.svg": (doctor, labels),
    "plot.svg": (plot, says),
    "calibrate.png": (calibrate, bytes),
}


def main():
    wstac, folder, check = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3:] == ["--check"]
    for name, (draw, compared) in PICTURES.items():
        path, picture = folder / name, draw(wstac)
        content = picture if isinstance(picture, bytes) else picture.encode()
        if not check:
            path.write_bytes(content)
        else:
            kept = path.read_bytes()
            before, now = (compared(part if isinstance(picture, bytes) else part.decode()) for part in (kept, content))
            if before != now:
                shown = "other pixels" if isinstance(picture, bytes) else f"{before}, expected {now}"
                sys.exit(f"{path}: says {shown}; ci/pages pictures writes it")
        print(f"{path}: {len(content):,} bytes")


if __name__ == "__main__":
    main()

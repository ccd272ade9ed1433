"""Checks that a slide whose frames are partly missing has the right speed or none that is reliable, in every container.

    table.py WSTAC [SEEDS [CONTAINER…]]

Each row is a container at a rate: the slide as it is, then with 5 to 30 % of its frames removed at random and in runs, SEEDS
times. Every frame that is left keeps its time. "Wrong" is a reliable speed that is off by more than 2 %.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

X264 = ("-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "12", "-g", "15")
MPEG4 = ("-c:v", "mpeg4", "-q:v", "2")
MJPEG = ("-c:v", "mjpeg", "-q:v", "2")
FLV1 = ("-c:v", "flv", "-q:v", "2")
WMV = ("-c:v", "wmv2", "-q:v", "2")
VPX = ("-c:v", "libvpx", "-b:v", "4M", "-deadline", "realtime", "-cpu-used", "5")
MPEG2 = ("-c:v", "mpeg2video", "-q:v", "2")
# A name, the rates, and how it is made. The last tells whether a file has the times of its frames: without, nothing shows what is
# missing, and only the whole slide is judged.
CONTAINERS: list[tuple[str, tuple[str, ...], tuple[str, ...], bool]] = [
    ("mp4", ("30", "25", "30000/1001", "60", "15"), X264, True),
    ("frag.mp4", ("30",), (*X264, "-movflags", "frag_keyframe+empty_moov"), True),
    ("b.mp4", ("30", "50"), (*X264, "-bf", "3"), True),
    ("hevc.mp4", ("30",), ("-c:v", "libx265", "-preset", "ultrafast", "-x265-params", "log-level=none", "-crf", "8"), True),
    ("m4v", ("30",), MPEG4, True),
    ("mov", ("30", "24", "120"), X264, True),
    ("jpeg.mov", ("30",), MJPEG, True),
    ("mkv", ("30", "24000/1001", "90", "15"), X264, True),
    ("ffv1.mkv", ("30",), ("-c:v", "ffv1", "-pix_fmt", "gray"), True),
    ("webm", ("30", "60"), VPX, True),
    ("avi", ("30", "25", "30000/1001"), MJPEG, True),
    ("h264.avi", ("30",), X264, True),
    ("ts", ("30", "50"), X264, True),
    ("m2ts", ("30",), X264, True),
    ("mts", ("25",), X264, True),
    ("mpg", ("30", "25"), MPEG2, True),
    ("mpeg", ("30",), ("-c:v", "mpeg1video", "-q:v", "2"), True),
    ("vob", ("25",), MPEG2, True),
    ("flv", ("30", "25"), FLV1, True),
    ("h264.flv", ("30",), X264, True),
    ("ogv", ("30",), ("-c:v", "libtheora", "-q:v", "10"), True),
    ("3gp", ("30",), X264, True),
    ("wmv", ("30", "25"), WMV, True),
    ("asf", ("30",), WMV, True),
    ("nut", ("30",), MPEG4, True),
    ("gif", ("25", "50", "20"), (), True),
    ("png", ("30",), (), True),
    ("jpg", ("30", "60"), MJPEG, True),
    ("s.png", ("25", "15"), (), True),
    ("ns.png", ("60",), (), True),
    ("apng", ("30",), ("-f", "apng"), True),
    ("mxf", ("25",), MPEG2, False),
    ("h264", ("25", "30"), X264, False),
    ("hevc", ("30",), ("-c:v", "libx265", "-preset", "ultrafast", "-x265-params", "log-level=none", "-crf", "8"), False),
    ("mjpeg", ("30",), MJPEG, False),
    ("y4m", ("30",), ("-pix_fmt", "gray", "-strict", "-1"), False),
]
# ffmpeg's encoder of Theora leaves out most frames that are like the one before, so that no such file is whole.
NEVER_WHOLE = ("ogv",)


def kept(frames: int, share: float, is_in_runs: bool, chance: random.Random) -> list[int]:
    """Returns the numbers of the frames that are left."""
    gone: set[int] = set()
    while len(gone) < share * frames:
        at = chance.randrange(frames)
        gone.update(range(at, min(frames, at + (chance.randint(2, 12) if is_in_runs else 1))))
    return [number for number in range(frames) if number not in gone]


def make(slide: Path, rate: str, frames: int, numbers: list[int], name: str, options: tuple[str, ...], to: Path) -> Path:
    """Makes a file, or a folder of pictures, of these frames."""
    numerator, _, denominator = rate.partition("/")
    step = int(denominator or 1) / int(numerator)
    gone = sorted(set(range(frames)) - set(numbers))
    # An expression has some hundred terms at most. Times stay what they are from filter to filter.
    parts = ["+".join(f"between(t,{(number - 0.5) * step:.4f},{(number + 0.5) * step:.4f})" for number in gone[at : at + 30]) for at in range(0, len(gone), 30)]
    chosen = ",".join(f"select='not({part})'" for part in parts) or "null"
    ending = name.rpartition(".")[2]
    command = ["ffmpeg", "-v", "error", "-nostdin", "-y", "-i", slide, "-vf", chosen, "-fps_mode", "passthrough"]
    file = to / f"a.{ending}"
    if ending in ("png", "jpg"):
        file = to / name.replace(".", "_")
        file.mkdir()
        subprocess.run([*command, *options, file / f"%d.{ending}"], check=True)
        for place, number in reversed(list(enumerate(numbers, 1))):
            seconds = number * step
            new = {"s.png": f"t{9.9 + seconds:.4f}", "ns.png": f"{1764100000000000000 + round(1e9 * seconds)}"}.get(name, f"f{number + 1:04}")
            (file / f"{place}.{ending}").rename(file / f"{new}.{ending}")
        return file
    subprocess.run([*command, *options, file], check=True)
    return file


def events(wstac: str, file: Path, rate: str) -> tuple[list[dict], str]:
    """Returns the events of a file. A rate that its names cannot tell is given."""
    given = ["--fps", rate] if file.name in ("png", "jpg") or file.suffix == ".mjpeg" else []
    done = subprocess.run([wstac, "run", file, "--readout", "0", "--json", *given], check=False, capture_output=True, text=True)
    return [record for record in map(json.loads, done.stdout.splitlines()) if record["kind"] == "event"], done.stderr


def main() -> None:
    wstac, seeds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 1
    failures = rows = 0
    with tempfile.TemporaryDirectory() as name:
        at = Path(name)
        slides: dict[str, tuple[Path, int]] = {}
        for container, rates, options, has_times in CONTAINERS:
            for rate in rates if container in (sys.argv[3:] or [container]) else ():
                if rate not in slides:
                    slide = at / f"{rate.replace('/', '_')}.y4m"
                    scene = at / "small.toml"
                    scene.write_text('specimen = "Saw3"\nspeed = 150\ndirection = 30\n[sensor]\nsize = [320, 240]\nfps = "' + rate + '"\n')
                    subprocess.run([wstac, "scene", "render", scene, "-o", slide], check=True, capture_output=True)
                    slides[rate] = (slide, slide.read_bytes().count(b"FRAME\n"))
                slide, frames = slides[rate]
                found: Counter[str] = Counter()
                worst = 0.0
                for share, is_in_runs in [(0.0, False)] + [(share, runs) for share in (0.05, 0.1, 0.2, 0.3) for runs in (False, True)] * seeds:
                    rows += 1
                    chance = random.Random(f"{container} {rate} {share} {is_in_runs} {rows}")
                    with tempfile.TemporaryDirectory(dir=at) as folder:
                        numbers = kept(frames, share, is_in_runs, chance)
                        file = make(slide, rate, frames, numbers, container, options, Path(folder))
                        of_file, notes = events(wstac, file, rate)
                    reliable = [event for event in of_file if event["reliable"] and event["speed"]]
                    off = max((abs(event["speed"]["mm_s"] / 150 - 1) for event in reliable), default=0.0)
                    worst = max(worst, off)
                    is_whole = share == 0 and container not in NEVER_WHOLE
                    right = off <= 0.02 and (not is_whole or len(reliable) == len(of_file) == 1)
                    found["right" if reliable and right else "not reliable" if right else "wrong"] += 1
                    if not right and (has_times or share == 0):
                        failures += 1
                        print(f"FAILED: {container} at {rate}, {share:.0%} missing{' in runs' * is_in_runs}: {of_file}; {notes}")
                counts = ", ".join(f"{count} {word}" for word, count in sorted(found.items()))
                said = "" if has_times else ", without times"
                print(f"{container} at {rate}{said}: {counts}; at most {100 * worst:.1f} % off", flush=True)
    sys.exit(f"{failures} failed" if failures else None)


if __name__ == "__main__":
    main()

"""Checks that a slide gives the same event on every route that people have, through a real ffmpeg.

    check.py WSTAC

Speed and direction of the event are those of the simulated slide, by the default law and by the published one. Files whose
frames come unevenly give no reliable event, and each kind of pixel keeps its black.
"""

from __future__ import annotations

import json
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

SLIDE = "Saw3@150,90deg,seed=7"
X264 = ("-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "16", "-bf", "3")
# As a camera application would write it: near-lossless.
H264 = ("-c:v", "libx264", "-preset", "veryfast", "-crf", "8")
# Every second frame of the touch is missing.
HALF = ("-vf", "select='not(between(n,44,78)*mod(n,2))'", "-fps_mode", "passthrough")
UNEVEN = ("-fps_mode", "passthrough", "-enc_time_base")


def ffmpeg(*arguments: str | Path) -> None:
    subprocess.run(["ffmpeg", "-v", "error", "-nostdin", "-y", *arguments], check=True)


class Clips:
    """Files of slides in a folder, and what the command finds in them."""

    def __init__(self, wstac: str, folder: Path) -> None:
        self.wstac = wstac
        self.at = folder
        self.failures = 0

    def verdict(self, right: bool, good: str, bad: str) -> None:
        print(f"ok: {good}" if right else f"FAILED: {bad}", flush=True)
        self.failures += not right

    def quiet(self, *arguments: str | Path) -> None:
        subprocess.run([self.wstac, *arguments], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def run(self, *arguments: str | Path, **variables: str) -> tuple[list[dict], str]:
        """Returns the records of `wstac run`, and its notes. The command may fail, if not all frames are there."""
        command = [self.wstac, "run", *arguments, "--readout", "0", "--json"]
        done = subprocess.run(command, check=False, capture_output=True, text=True, env={**os.environ, **variables})
        return [json.loads(line) for line in done.stdout.splitlines()], done.stderr

    def answer(self, *arguments: str | Path) -> tuple[tuple[float, float] | None, str]:
        """Returns speed and direction of the only event, or `None`, and the notes."""
        records, notes = self.run(*arguments)
        events = [record for record in records if record["kind"] == "event"]
        if len(events) != 1 or not events[0]["speed"] or not events[0]["direction"]:
            return None, notes
        return (events[0]["speed"]["mm_s"], events[0]["direction"]["deg"]), notes

    def routes(self, slide: str) -> None:
        """Compares the answer of every route with that of the simulated slide, within 1 % and 1 degree."""
        published = ("--config", self.at / "published.toml")
        laws: dict[str, tuple[str | Path, ...]] = {"default": (), "published": published}
        expected = {law: self.answer(f"scene:{slide}", *options)[0] for law, options in laws.items()}
        with tempfile.TemporaryDirectory(dir=self.at) as name:
            for route, source, options in self.made(slide, Path(name)):
                # What a file holds does not depend on the law: one route has both.
                for law, more in laws.items() if route == "mp4" else [("default", ())]:
                    found, notes = self.answer(source, *options, *more)
                    of = f"{slide}, {route}, {law} law: {found}"
                    last = notes.strip().rpartition("\n")[2]
                    self.verdict(near(found, expected[law]), f"{of} (directly: {expected[law]})", f"{of}, expected {expected[law]} within 1 %; {last}")

    def made(self, slide: str, at: Path) -> list[tuple[str, Path, tuple[str, ...]]]:
        """Makes a slide's files: 8 bits, YCbCr 4:2:0, with the colors of television or of a computer."""
        self.quiet("scene", "render", slide, "-o", at / "slide.y4m", "--force")
        self.quiet("run", f"scene:{slide}", "--json", "--save-raw", at / "slide.gray")

        def encode(*arguments: str | Path) -> None:
            ffmpeg("-f", "rawvideo", "-pixel_format", "gray", "-video_size", "1280x720", "-framerate", "30", "-i", at / "slide.gray", *arguments)

        encode(*H264, "-pix_fmt", "yuv420p", at / "plain.mp4")
        encode(*H264, "-vf", "scale=out_range=full", "-color_range", "pc", "-pix_fmt", "yuv420p", at / "full.mkv")
        encode(*H264, "-vf", "scale=out_color_matrix=bt709", "-colorspace", "bt709", "-pix_fmt", "yuv420p", at / "television.mov")
        encode("-c:v", "mjpeg", "-q:v", "1", "-pix_fmt", "yuvj422p", at / "camera.avi")
        for folder in ("pictures", "photos"):
            (at / folder).mkdir()
        encode(at / "pictures/%d.png")
        encode("-c:v", "mjpeg", "-q:v", "1", "-pix_fmt", "yuvj420p", at / "photos/%d.jpg")
        ffmpeg("-i", at / "plain.mp4", "-f", "yuv4mpegpipe", at / "piped.y4m")
        self.quiet("scene", "render", slide, "-o", at / "own.mp4")
        return [
            ("Y4M", at / "slide.y4m", ()),
            ("PNG files", at / "pictures", ("--fps", "30")),
            ("JPEG files", at / "photos", ("--fps", "30")),
            ("mp4", at / "plain.mp4", ()),
            ("mp4 of wstac scene render", at / "own.mp4", ()),
            ("mkv of full range", at / "full.mkv", ()),
            ("mov of BT.709", at / "television.mov", ()),
            ("avi of Motion JPEG", at / "camera.avi", ()),
            ("mp4, through ffmpeg", at / "piped.y4m", ()),
        ]

    def make(self, *arguments: str, to: str) -> Path:
        """Makes the small slide as another file."""
        ffmpeg("-i", self.at / "small.y4m", *arguments, self.at / to)
        return self.at / to

    def judged(self, source: Path, reliable: bool, text: str = "", **variables: str) -> str:
        """Checks whether the only event is reliable, right if it is, and that the notes have the text. Returns the notes."""
        records, notes = self.run(source, **variables)
        events = [record for record in records if record["kind"] == "event"]
        speed = (events[0]["speed"] or {}).get("mm_s") if len(events) == 1 else None
        right = len(events) == 1 and events[0]["reliable"] is reliable and text in notes
        right = right and (not reliable or (speed is not None and 147 < speed < 151))
        self.verdict(right, f"{source.name}: reliable {reliable}, {speed} mm/s", f'{source.name}: expected reliable {reliable} and "{text}": {events}; {notes}')
        return notes

    def gaps(self) -> None:
        """Files whose frames come unevenly."""
        motion_jpeg = ("-c:v", "mjpeg", "-q:v", "2")
        for name in ("half.mp4", "half.mkv", "half.ts", "half.avi"):
            file = self.make(*HALF, *(motion_jpeg if name == "half.avi" else X264), to=name)
            notes = self.judged(file, False, "17 frames are missing, by time stamps")
            said = any(name in line and "1 event is not reliable for it" in line for line in notes.splitlines())
            self.verdict(said, f"{name}: the event is named", notes)
        # Exposures of one and a half frames, and a gap of whole frames before the touch.
        slow = self.make("-vf", "settb=1/1000,setpts='if(lt(N,44),N,44+(N-44)*1.5)*1000/30'", *UNEVEN, "1:1000", *X264, to="slow.mp4")
        self.judged(slow, False, "unevenly")
        # Times that are up to a fifth of a frame off matter to a slide as fast as this one.
        self.judged(self.make("-vf", "settb=1/1000,setpts='(N+0.2*sin(2.4*N))*1000/30'", *UNEVEN, "1:1000", *X264, to="jitter.mkv"), False)
        self.quiet("record", slow, "-o", self.at / "slow.mcap")
        self.judged(self.at / "slow.mcap", False)
        self.judged(self.make("-vf", "select='not(between(n,27,30))'", "-fps_mode", "passthrough", *X264, to="early.mp4"), True, "4 frames are missing")

    def pictures(self) -> None:
        """Pictures whose names have numbers, times, dates, and one stray name; every second one of a part is missing."""
        gap = self.at / "gap"
        gap.mkdir()
        self.make("-start_number", "1", to="gap/%d.png")
        self.judged(gap, True, "PNG files")
        for number in range(46, 79, 2):
            (gap / f"{number}.png").unlink()
        self.judged(gap, False, "gap: 17 frames are missing, by the numbers in their names")
        for kind in ("index", "date", "stray"):
            (self.at / kind).mkdir()
            for file in gap.iterdir():
                number = int(file.stem)
                ms = 59200 + number * 100 // 3
                name = {
                    "index": f"frame{number:05}_17641000{ms // 1000:02}.{ms % 1000:03}",
                    "date": f"2025-11-25_12-{ms // 60000:02}-{ms // 1000 % 60:02}-{ms % 1000:03}",
                    "stray": str(number),
                }[kind]
                os.link(file, self.at / kind / f"{name}.png")
        shutil.copy(gap / "1.png", self.at / "stray/background.png")
        self.judged(self.at / "index", False, "index: 17 frames are missing, by the times in their names")
        self.judged(self.at / "date", False, "date: 17 frames are missing, by the times in their names")
        self.judged(self.at / "stray", False, "stray: 17 frames are missing and 1 frame comes unevenly")

    def even(self) -> None:
        """What is even: rounded time stamps, B-frames in the order of their times, an edit list, a rate that is a little off."""
        even = self.make(*X264, "-g", "10", to="even.mp4")
        files = [
            even,
            self.make(*X264, to="even.mkv"),
            self.make("-c:v", "libvpx", "-b:v", "4M", to="even.webm"),
            *(self.make(*X264, to=f"even.{kind}") for kind in ("ts", "avi", "h264")),
            self.make("-c:v", "mpeg2video", "-q:v", "2", to="even.mpg"),
            self.make("-vf", "settb=1/90000,setpts=N/29.8/TB", *UNEVEN, "1:90000", *X264, to="off.mp4"),
            self.at / "cut.mp4",
        ]
        ffmpeg("-ss", "0.2", "-i", even, "-c", "copy", self.at / "cut.mp4")
        for file in files:
            self.judged(file, True)
        self.judged(even, True, AV_LOG_FORCE_COLOR="1")
        # A rate that nobody states.
        self.judged(self.make("-c:v", "mjpeg", "-q:v", "2", "-f", "mpjpeg", to="parts.mjpg"), True, "(assumed: state another with --fps)")
        self.judged(self.make("-c:v", "mjpeg", "-q:v", "2", to="raw.mjpeg"), True, "30:1 frames per second (assumed: state another with --fps)")

    def tracks(self) -> None:
        """A film of two tracks, and Motion JPEG that ffmpeg spoils: a byte stands before each marker."""
        film = self.at / "tracks.mkv"
        other = ("-f", "lavfi", "-i", "testsrc=size=320x240:rate=30:duration=4")
        ffmpeg("-i", self.at / "small.y4m", *other, "-map", "0", "-map", "1", *X264, film)
        self.judged(film, True, "the first of 2 video tracks (another: ")
        expected: dict[str, list[dict]] = {}
        for name, jpeg in (("clean", "422-restart"), ("byte", "422-restart+byte")):
            (self.at / name).mkdir()
            for number in range(30):
                shutil.copy(Path(__file__).parent.parent / f"jpeg/{jpeg}.jpg", self.at / name / f"{number}.jpg")
            for kind in ("avi", "mkv", "mov"):
                ffmpeg("-framerate", "30", "-i", self.at / name / "%d.jpg", "-c", "copy", self.at / f"{name}.{kind}")
                found, notes = self.run(self.at / f"{name}.{kind}", "--features")
                self.verdict(found == expected.setdefault(kind, found) and len(found) > 30, f"{name}.{kind} is as clean.{kind}", f"{found[-1]}: {notes}")

    def damaged(self) -> None:
        """Files with flipped bits: no reliable speed is wrong, and key frames end doubt. A cut file is as reliable as a whole one."""
        doubted = "events are not reliable until a later key frame"
        # Only the film of pictures that are coded alone has key frames that end doubt. Motion JPEG is decoded without ffmpeg.
        for kind, options, word, ends in (
            ("mp4", X264, doubted, False),
            ("mpg", ("-c:v", "mpeg2video", "-q:v", "2", "-g", "1"), doubted, True),
            ("avi", ("-c:v", "mjpeg", "-q:v", "2"), "others count as lost", False),
        ):
            whole = self.make(*options, to=f"whole.{kind}").read_bytes()
            said, ended, wrong = 0, 0, []
            for seed in range(8):
                chance, damaged = random.Random(seed), bytearray(whole)
                for _ in range(3):
                    damaged[chance.randrange(len(whole) // 4, len(whole) * 3 // 4)] ^= 1 << chance.randrange(8)
                file = self.at / f"damaged.{kind}"
                file.write_bytes(damaged)
                records, _ = self.run(file)
                events = [record for record in records if record["kind"] == "event" and record["reliable"]]
                wrong += [event["speed"] for event in events if abs(event["speed"]["mm_s"] / 149 - 1) > 0.02]
                said += any(word in record.get("message", "") for record in records)
                ended += any(record.get("fault") == "even" for record in records)
            found = f"{said} of 8 damaged .{kind} files say \"{word}\", in {ended} doubt ends"
            self.verdict(said > 1 and (ended > 1 if ends else not ended) and not wrong, found, f"{found}; wrong and reliable: {wrong}")
        # A picture long before the touch whose second half cannot be decoded costs nothing.
        *first, early, rest = self.make("-c:v", "mjpeg", "-q:v", "2", to="early.avi").read_bytes().split(b"00dc", 10)
        half = len(early) // 2
        early = early[:half] + b"\xaa" * (len(early) - half)
        (self.at / "early.avi").write_bytes(b"00dc".join([*first, early, rest]))
        self.judged(self.at / "early.avi", True, "1 frame lost: corrupt JPEG picture")
        # An error of the file that ffmpeg reports about pictures that it copies, six seconds before the touch.
        long = self.make("-vf", "tpad=start=200:start_mode=clone", "-c:v", "mjpeg", "-q:v", "2", "-cluster_time_limit", "500", to="long.mkv")
        *first, rest = long.read_bytes().split(cluster := b"\x1f\x43\xb6\x75", 3)
        long.write_bytes(cluster.join(first)[:-40] + bytes(48) + rest[4:])
        self.judged(long, True, "4 frames lost: missing in the file")
        # A file that was cut, also between key frames.
        self.make(*X264, "-g", "10", to="keys.mp4")
        ffmpeg("-ss", "0.2", "-i", self.at / "keys.mp4", "-c", "copy", self.at / "trimmed.ts")
        self.judged(self.at / "trimmed.ts", True)
        packets = (self.at / "trimmed.ts").read_bytes()
        (self.at / "headless.ts").write_bytes(packets[len(packets) // 20 // 188 * 188 :])
        self.judged(self.at / "headless.ts", True)

    def dark(self) -> None:
        """The darkest hundredths of the scale, where a wrong range hides the slide."""
        dim = self.make("-vf", "lutyuv=y=val*0.05", "-pix_fmt", "gray", "-strict", "-1", "-f", "yuv4mpegpipe", to="dim.y4m")
        expected = self.run(dim, "--features")[0]

        def same(name: str, *options: str, without: tuple[str, ...] = ("matrix", "range")) -> None:
            """Compares the features of a file, or of a folder's files, with those of the Y4M. The notes have none of the words."""
            to = self.at / name
            source = to.parent if "%" in name else to
            to.parent.mkdir(exist_ok=True)
            ffmpeg("-i", dim, *options, to)
            found, notes = self.run(source, "--features")
            why = darkness(expected, found)
            noted = any(word in notes for word in without)
            self.verdict(not why and not noted, f"{name} is as dark as it was", f"{name}: {why} {notes}")

        for pixels in ("gbrp", "bgr0", "gbrp10le", "gbrp16le", "gray", "gray10le", "gray16le"):
            same(f"{pixels}.mkv", "-c:v", "ffv1", "-pix_fmt", pixels)
        same("png.mov", "-c:v", "png", "-pix_fmt", "rgb24")
        same("png16.mov", "-c:v", "png", "-pix_fmt", "rgb48be")
        same("vp9.webm", "-c:v", "libvpx-vp9", "-lossless", "1", "-pix_fmt", "gbrp")
        for pixels in ("yuv420p", "yuv440p", "yuv420p10le", "yuv422p10le", "yuv444p12le"):
            full = ("-vf", f"scale=out_range=full,format={pixels}", "-c:v", "ffv1", "-color_range", "pc")
            same(f"{pixels}.mkv", *full, without=("range is stated",))
        limited = {
            "yuv420p10le": "scale=out_range=limited,format=yuv420p10le",
            "gray": "lutyuv=y=16+val*219/255",
            "gray10le": "format=gray16le,lutyuv=y=4096+val*56064/65535",
        }
        for pixels, filters in limited.items():
            same(f"{pixels}_limited.mkv", "-vf", filters, "-pix_fmt", pixels, "-c:v", "ffv1", "-color_range", "tv", without=("range is stated",))
        same("png8/%d.png")
        same("png16/%d.png", "-pix_fmt", "gray16be")
        jpeg = ("-c:v", "mjpeg", "-qmin", "1", "-q:v", "1", "-pix_fmt", "yuvj422p")
        same("jpeg/%d.jpg", *jpeg)
        same("jpeg.avi", *jpeg, without=("range is stated",))

    def says(self, text: str, source: Path, path: Path | None = None) -> None:
        """Checks that the command fails with this text, perhaps with another PATH."""
        variables = {**os.environ, **({"PATH": str(path)} if path else {})}
        done = subprocess.run([self.wstac, "run", source], check=False, capture_output=True, text=True, env=variables)
        self.verdict(done.returncode != 0 and text in done.stderr, text, f"{done.stderr}, expected an error: {text}")

    def refused(self) -> None:
        """What is no video, a rate that cannot be, no picture, and a machine without ffmpeg."""
        nothing, sound = self.at / "a.mp4", self.at / "b.mkv"
        nothing.write_text("nothing\n")
        self.says(f"{nothing}: ffmpeg cannot read it: ", nothing)
        nothing.write_bytes(b"")
        self.says(", so no frame can be read\n", nothing)
        begun = self.make(*X264, "-movflags", "+faststart", to="begun.mp4")
        begun.write_bytes(begun.read_bytes().split(b"mdat")[0] + b"mdat" + bytes(99))
        self.says(f"{begun}: no frame can be decoded: ", begun)
        absurd = self.make("-vf", "settb=1/90000,setpts=N", *UNEVEN, "1:90000", *X264, "-video_track_timescale", "90000", to="absurd.mp4")
        self.says("frames per second, expected 0.5 to 1000; state the rate with --fps", absurd)
        ffmpeg("-f", "lavfi", "-i", "sine=duration=0.1", sound)
        listed = self.at / "list.mp4"
        listed.write_text(f"ffconcat version 1.0\nfile {absurd.name}\n")
        self.says(f"{listed}: is a list of other files", listed)
        self.says(f"{sound}: has no picture, expected a video", sound)
        spoiled = self.at / "spoiled.avi"
        # ffmpeg 5 to 7 write it, and decode none of it.
        ffmpeg("-f", "lavfi", "-i", "color=duration=0.3:size=160x120:rate=30", "-c:v", "tiff", "-pix_fmt", "rgb48le", spoiled)
        self.says(f"{spoiled}: ", spoiled)
        self.says(f"{sound}: a video needs ffmpeg, which is not installed", sound, self.at)


def near(found: tuple[float, float] | None, expected: tuple[float, float] | None) -> bool:
    """Tells whether a speed is within 1 % and a direction within 1 degree."""
    if found is None or expected is None:
        return False
    turn = abs(found[1] - expected[1])
    return 0.99 * expected[0] < found[0] < 1.01 * expected[0] and min(turn, 360 - turn) <= 1


def darkness(expected: list[dict], found: list[dict]) -> str | None:
    """Returns how features differ by more than one level of a taxel, or the slides that are not one, or `None`."""
    features = [[record["f"] for record in records if record["kind"] == "features"] for records in (expected, found)]
    slides = [sum(record.get("contact") == "slide" for record in records) for records in (expected, found)]
    if [len(one) for one in features] != [len(features[0])] * 2 or not features[0]:
        return f"{len(features[1])} frames with features, expected {len(features[0])}"
    # The sum of five taxels, as a fraction of the scale of one.
    off = max(abs(math.exp(a) - math.exp(b)) for one, other in zip(*features, strict=True) for a, b in zip(one, other, strict=True))
    return f"off by {off * 255 / 5:.2f} levels, slides {slides}" if off * 255 > 5 or slides != [1, 1] else None


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        clips = Clips(sys.argv[1], Path(name))
        (clips.at / "published.toml").write_text('[speed]\nlaw = "published"\n')
        clips.routes(SLIDE)
        # A small slide of 150 mm/s, in files whose frames come unevenly or evenly, of other pixels, and without a rate.
        (clips.at / "small.toml").write_text('specimen = "Saw3"\nspeed = 150\ndirection = 30\n[sensor]\nsize = [320, 240]\n')
        clips.quiet("scene", "render", clips.at / "small.toml", "-o", clips.at / "small.y4m")
        for part in (clips.gaps, clips.pictures, clips.even, clips.tracks, clips.damaged, clips.dark, clips.refused):
            part()
    sys.exit(f"{clips.failures} failed" if clips.failures else None)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Checks the C interfaces: every warning is an error, programs run at their edges and on streams, and results equal
those of `wstac run`.

    check.py WSTAC PREFIX           PREFIX: where ci/build libwstac has installed, and ci/build libwstac-fw for this machine and for a Cortex-M4F of
                                    either ABI
    check.py WSTAC PREFIX --base    of a Cortex-M4F, only the ABI that passes numbers in floating-point registers
"""

import datetime
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import kconfiglib
from line import LossyLine

ROOT = Path(__file__).resolve().parents[2]
TESTS = ROOT / "tests/capi"
EXAMPLES = ROOT / "wstac-fw/capi/examples"
BOARD = EXAMPLES / "mps2-an386"
CAMERA = EXAMPLES / "stm32h743"
# A board gets its arguments as one line, which it splits at spaces. So the model is copied to where the programs run.
MODEL = "svm.wsm"
MODEL_FILE = ROOT / "wstac-host/models/svm.wsm"
STRICT = ["-std=c11", "-pedantic", "-Wall", "-Wextra", "-Werror", "-g"]
SANITIZED = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
# A table that is made once and kept is not a leak.
VALGRIND = ["valgrind", "--quiet", "--leak-check=full", "--errors-for-leak-kinds=definite,indirect,possible", "--error-exitcode=9"]
ARM = "-mcpu=cortex-m4 -mthumb -O2 -ffunction-sections -fdata-sections".split()
# The floating-point ABIs of a Cortex-M4F, and the library that each links. Programs of `soft` run with the unit switched off.
ABIS = {
    "hard": ("thumbv7em-none-eabihf", ["-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]),
    "softfp": ("thumbv7em-none-eabi", ["-mfpu=fpv4-sp-d16", "-mfloat-abi=softfp"]),
    "soft": ("thumbv7em-none-eabi", ["-mfloat-abi=soft"]),
}
LINK = ["--specs=rdimon.specs", "-nostartfiles", "-T", BOARD / "board.ld", "-Wl,--gc-sections", "-Wl,--no-warn-rwx-segments"]
ON_BOARD = ["GREY", "RGBP", "YUYV"]
# The keys of [speed].
LAWS = {"published": 'law = "published"', "coherence": 'estimator = "coherence"', "edges": 'estimator = "edges"'}
QEMU = "qemu-system-arm -M mps2-an386 -nographic -monitor none -serial none -kernel".split()
# The formats of the firmware library, by the names that wstac gives them. YUYV and UYVY are also there with green
# computed once per taxel.
FORMATS = "GREY Y10 Y12 Y16 RGB3 BGR3 XB24 RX24 RGBP RGGB GRBG RG10 BA10 RG12 BA12 YUYV UYVY NV12 YU12".split()
LINEAR = ["YUYV", "UYVY"]
PLANAR = ["NV12", "YU12"]
SIZE = (100, 80)
# The budget of a call's stack on a Cortex-M4F, in bytes. docs/C.md has the same numbers, and what was measured.
PAGE = ROOT / "docs/C.md"
STACK = {"init": 5120, "push": 1024, "motion": 2048, "motion_by_edges": 1024, "speed": 384, "direction": 640, "sample": 256, "model_init": 640, "classify": 1024, "link_event": 1536, "link_receive": 128}
SLIDES = """
seed = 5
gap = 100
[sensor]
size = [400, 400]
"""
SLIDE = """
[[touch]]
kind = "slide"
specimen = "{}"
speed = {}
direction = {}
"""
# Not slides: they have neither speed nor direction.
OTHERS = """
[[touch]]
kind = "press"
[[touch]]
kind = "poke"
whisker = [3, 3]
overlap = 4
approach = 2000
"""
# A configuration with the published law.
PUBLISHED = "published.toml"
BALL, HELD, BOARDS = "ball.toml", "held.toml", "boards.toml"


def fail(message):
    sys.exit(f"check.py: {message}")


def run(command, text=True, **more):
    """Returns what a command prints. Exits if the command fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=text, check=False, timeout=1200, **more)
    if done.returncode:
        fail(f"{' '.join(map(str, command))[:300]} ended with {done.returncode}: {done.stderr[-2000:]}{done.stdout[-500:]}")
    return done.stdout


class Wstac:
    """Runs `wstac run` on sources."""

    def __init__(self, command, folder):
        self.command, self.folder = command, folder

    def run(self, source, *arguments, model="builtin:svm"):
        lines = run([self.command, "run", source, "--json", "--model", model, *arguments], cwd=self.folder)
        return [json.loads(line) for line in lines.splitlines()]

    def record(self):
        """Records several slides, one of them too slow for the published law and one too fast, a press and a poke. Saves the
        frames, too.
        """
        slides = [("Saw3", 150, 90), ("Tri2", 45, 0), ("Fla0", 180, 270), ("Sin4", 120, 215), ("Saw3", 800, 10)]
        (self.folder / "slides.toml").write_text(SLIDES + "".join(SLIDE.format(*slide) for slide in slides) + OTHERS)
        # The firmware's library has the estimator of boards.
        boards = (ROOT / "wstac-fw/wstac.toml").read_text()
        (self.folder / BOARDS).write_text(boards)
        (self.folder / "global.toml").write_text(f"{boards}[sensor]\nreadout_ms = 0\n")
        (self.folder / PUBLISHED).write_text('[speed]\nlaw = "published"\n')
        (self.folder / BALL).write_text('shape = "ball"\ndiameter = 15\nspeed = 100\ndirection = 30\n[sensor]\nsize = [200, 200]\n')
        (self.folder / HELD).write_text(SLIDES + SLIDE.format("Sin2", 60, 270) + "hold = 2\n")
        run([self.command, "record", "scene:slides.toml", "-o", "slides.mcap", "--config", BOARDS], cwd=self.folder)
        self.run("slides.mcap", "--save-raw", "slides.raw")
        both = ["cam:left=scene:Saw3@150", "cam:right=scene:Tri3@120"]
        run([self.command, "record", *both, "-o", "both.mcap"], cwd=self.folder)


def line(event, is_firmware=False):
    """Returns an event as the examples print it; that of the firmware has no standard deviations, and what is not reliable, too."""
    speed, direction = (event[name] if is_firmware or event["reliable"] else None for name in ("speed", "direction"))
    texture = event["texture"]
    speed = "-" if speed is None else f"{speed['mm_s']:.1f}" if is_firmware else f"{speed['mm_s']:.2f}±{speed['sd']:.2f}"
    direction = "-" if direction is None else f"{direction['deg']:.1f}" + ("" if is_firmware else f"±{direction['sd']:.2f}")
    return f"frame={event['frame']} speed={speed} direction={direction} texture={(texture and texture['specimen']) or '-'}"


def record_of(line):
    """Returns what tests/capi/records.c should print for an event or the end of a contact."""
    if line["kind"] != "event":
        return line
    speed, direction, texture = line["speed"] or {}, line["direction"] or {}, line["texture"] or {}
    place, width = line.get("place_mm", {}), line.get("width_mm", {})
    why, at_most = line.get("why", {}), line.get("speed_at_most", {})
    signed = {name: -1 if line.get(name) is None else line[name] for name in ("duration_frames", "touch_frame", "end_frame")}
    return {
        **{name: line[name] for name in ("kind", "frame", "time_ns", "completed_ns", "frames_filled", "reliable")},
        **signed,
        **{name: line.get(name) for name in ("contact", "completed_s", "stamp")},
        "touch_s": line.get("time_s"),
        "speed_mm_s": speed.get("mm_s"),
        "speed_sd_mm_s": speed.get("sd"),
        "speed_extrapolated": speed.get("extrapolated", False),
        "speed_at_most_mm_s": at_most.get("mm_s"),
        "direction_deg": direction.get("deg"),
        "direction_sd_deg": direction.get("sd"),
        "direction_confidence": direction.get("confidence"),
        "why_no_speed": why.get("speed"),
        "why_no_direction": why.get("direction"),
        "why_not_reliable": why.get("reliable"),
        "why_texture": why.get("texture"),
        "basis": line.get("basis"),
        **{"place_mm": place.get("value"), "place_sd_mm": place.get("sd"), "width_mm": width.get("value"), "width_sd_mm": width.get("sd")},
        "contacts": line.get("contacts", -1),
        "acceleration_mm_s2": line.get("acceleration", {}).get("mm_s2"),
        "acceleration_sd_mm_s2": line.get("acceleration", {}).get("sd"),
        "period_mm": line.get("period_mm", {}).get("value"),
        "period_sd_mm": line.get("period_mm", {}).get("sd"),
        **{name: texture.get(name) for name in ("specimen", "pattern", "depth_mm", "confidence")},
        "known": {None: -1, False: 0, True: 1}[texture.get("known")],
        "other": texture.get("class"),
        "sample": [units(line["sample"][feature][frame]) for frame in range(70) for feature in range(10)],
    }


def nearest(lines):
    """Returns the lines of a firmware example, with speeds to one decimal as in a record."""
    return re.sub(r"speed=([\d.]+)", lambda found: f"speed={float(found[1]):.1f}", lines)


def units(number):
    """Returns a feature in units of 1/2048."""
    scaled = number * 2048
    if scaled != int(scaled):
        fail(f"{number} is no multiple of 1/2048")
    return int(scaled)


def firmware_lines(records):
    """Returns what tests/capi/firmware.c should print for these records of the published law. Speeds are compared separately."""
    lines, speeds = [], []
    for record in records:
        if record["kind"] == "features":
            lines.append("features " + " ".join(str(units(f)) for f in record["f"]))
        if record["kind"] == "event":
            speed, at_most, direction = record["speed"], record.get("speed_at_most"), record["direction"]
            speeds += [speed["mm_s"] if speed else 0, at_most["mm_s"] if at_most else 0]
            duration = record["duration_frames"]
            numbers = [record["frame"], -1 if duration is None else duration, bool(speed and speed["extrapolated"])]
            numbers += [-1 if direction["deg"] is None else direction["deg"], direction["confidence"]]
            numbers += [record["frames_filled"], record["reliable"]]
            sample = [units(record["sample"][k][t]) for t in range(70) for k in range(10)]
            lines.append(("event", [float(number) for number in numbers], record["texture"]["specimen"], sample))
    return lines, speeds


def motion_line(by_coherence, by_edges):
    """Returns the words of the program's line about the motion of an event: those of two records. Numbers are in lists."""
    words = [-1 if by_coherence[name] is None else by_coherence[name] for name in ("touch_frame", "end_frame")]
    for record in (by_coherence, by_edges):
        speed, direction = record["speed"] or {"mm_s": 0, "sd": 0}, record["direction"] or {"deg": -1, "sd": 0}
        words += [record["contact"], [speed["mm_s"], speed["sd"], direction["deg"], direction["sd"]], record["reliable"]]
    return words


def parsed_motion(text):
    """Returns the same words from the program's line."""
    word = text.split()[1:]
    words = [int(number) for number in word[:2]]
    for at in (2, 8):
        words += [word[at], [float(number) for number in word[at + 1 : at + 5]], word[at + 5] == "1"]
    return words


def same_motion(found, expected, what):
    """Compares the words of two lines. Numbers of a record are rounded."""
    plain = lambda words: [word for word in words if not isinstance(word, list)]
    same(plain(found), plain(expected), what)
    for index in (3, 6):
        # A speed and its deviation have four digits or more; angles and their deviations two decimals.
        for number, want, off in zip(found[index], expected[index], (None, None, 0.0056, 0.0056), strict=True):
            if abs(number - want) > (off or max(6e-4 * want, 6e-4)):
                fail(f"{what}: motion {found}, expected {expected}")


def parsed(output):
    """Returns the same kinds of lines from the program's output, and the words of the lines about motions."""
    lines, speeds, motions = [], [], []
    for text in output.splitlines():
        if text.startswith("motion "):
            motions.append(parsed_motion(text))
            continue
        if not text.startswith("event "):
            lines.append(text)
            continue
        word = text.split()
        speeds += [float(word[3]), float(word[4])]
        confidence = round(int(word[7]) / 32768, 4)
        numbers = [float(word[1]), float(word[2]), float(word[5]), float(word[6]), confidence, float(word[8]), float(word[9])]
        lines.append(("event", numbers, word[10], [int(number) for number in word[11:]]))
    return lines, speeds, motions


class Programs:
    """Builds C programs for this machine, with and without sanitizers, and for the board."""

    # What programs of the board are built for; the second has no floating-point unit.
    cores = ("hard", "soft")
    nm = "arm-none-eabi-nm"
    formats = (*FORMATS, *(f"{name}-linear" for name in LINEAR))

    def __init__(self, folder, prefix):
        self.folder, self.prefix = folder, prefix
        self.environment = os.environ | {"LD_LIBRARY_PATH": str(prefix / "lib"), "PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
        self.machine = re.search(r"^host: (.*)$", run(["rustc", "-vV"]), re.MULTILINE)[1]

    def library(self, target):
        return self.prefix / "lib" / target / "libwstac_fw.a"

    def build_host(self, source):
        flags = shlex.split(run(["pkg-config", "--cflags", "--libs", "wstac"], env=self.environment))
        return self.build(source, [*flags, "-lm", "-pthread"])

    def build_firmware(self, source):
        return self.build(source, ["-I", self.prefix / "include", self.library(self.machine), "-lm"])

    def build_board(self, source, abi="hard"):
        elf = self.folder / f"{source.stem}-{abi}.elf"
        target, flags = ABIS[abi]
        command = ["arm-none-eabi-gcc", *STRICT, *ARM, *flags, "-I", self.prefix / "include", *LINK]
        run([*command, source, BOARD / "startup.c", self.library(target), "-lm", "-o", elf])
        return elf

    def build(self, source, more):
        """Returns the program, and the program with sanitizers."""
        plain, sanitized = self.folder / source.stem, self.folder / f"{source.stem}-sanitized"
        run(["gcc", *STRICT, "-O2", source, *more, "-o", plain])
        run(["gcc", *STRICT, "-O1", *SANITIZED, source, *more, "-o", sanitized])
        return plain, sanitized

    def run(self, *command):
        return run(command, cwd=self.folder, env=self.environment)

    def run_bytes(self, *command):
        """Returns the bytes that a program writes."""
        return run(command, text=False, cwd=self.folder, env=self.environment)

    def on_board_bytes(self, elf, *arguments):
        """Returns the bytes that a program of the board writes to the host's standard output."""
        named = ",".join(f"arg={argument}" for argument in [elf.stem, *arguments])
        return self.run_bytes(*QEMU, elf, "-semihosting-config", f"enable=on,target=native,{named}")

    def on_board(self, elf, *arguments):
        return self.on_board_bytes(elf, *arguments).decode()


def same(found, expected, what):
    if found != expected:
        fail(f"{what}: found\n{str(found)[:2000]}\nexpected\n{str(expected)[:2000]}")


def check_headers(prefix):
    """Compiles both headers alone, together, and as C++, for this machine and for the board."""
    warnings = ["-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wundef", "-Wcast-align", "-Wshadow", "-Werror"]
    texts = ['#include "wstac.h"\n', '#include "wstac_fw.h"\n', '#include "wstac.h"\n#include "wstac_fw.h"\n']
    compilers = [
        *(["gcc", "-x", "c", f"-std={standard}", "-Wstrict-prototypes"] for standard in ("c99", "c2x")),
        *(["g++", "-x", "c++", f"-std={standard}"] for standard in ("c++11", "c++20")),
        ["arm-none-eabi-gcc", "-x", "c", "-std=c99", *ARM],
    ]
    for text in texts:
        for compiler in compilers:
            run([*compiler, *warnings, "-fsyntax-only", "-I", prefix / "include", "-"], input=text)
    print(f"headers: alone and together, by {len(compilers)} compilers and standards")


def macros(text, prefix):
    """Returns the macros of a C text with their values."""
    lines = run(["gcc", "-dM", "-E", "-I", prefix / "include", "-"], input=text).splitlines()
    return {parts[1].partition("(")[0]: parts[2] if len(parts) > 2 else "" for parts in (line.split(" ", 2) for line in lines)}


def check_cpp(programs, wstac):
    """Builds the example in C++ without exceptions. It stops at the slips that `wstac run` prints, and says what is wrong."""
    warnings = ["-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wold-style-cast", "-Werror"]
    source, include, library = ROOT / "wstac-c/examples/slip_stop.cpp", programs.prefix / "include", programs.prefix / "lib"
    slips = [record for record in wstac.run(f"scene:{HELD}") if record["kind"] == "slip"]
    expected = "".join(f"frame {slip['frame']}: slip since frame {slip['onset_frame']}, {slip['frame'] - slip['onset_frame']} frames ago\n  stop\n" for slip in slips)
    same(bool(slips), True, "slips of a held part")
    for standard in ("c++11", "c++20"):
        program = programs.folder / f"slip_stop {standard}"
        link = ["-L", library, f"-Wl,-rpath,{library}", "-lwstac"]
        run(["g++", f"-std={standard}", "-fno-exceptions", *warnings, "-I", include, source, "-o", program, *link])
        same(programs.run(program, f"scene:{HELD}"), expected, f"slips by {standard}")
        done = subprocess.run([program, "nothing.mcap"], capture_output=True, text=True, check=False)
        same((done.returncode, "nothing.mcap" in done.stderr), (1, True), f"a source that is not there: {done.stderr!r}")
    # Moved sensors close once, and a moved-from one refuses.
    moved = programs.folder / "moved.cpp"
    moved.write_text(MOVED)
    program = programs.folder / "moved"
    sanitized = ["-std=c++11", "-fno-exceptions", "-fsanitize=address,undefined", *warnings]
    run(["g++", *sanitized, "-I", include, moved, "-o", program, "-L", library, f"-Wl,-rpath,{library}", "-lwstac"])
    same(programs.run(program), "140 frames, 1 event, moved\n", "a sensor that is moved")
    # A source that has nothing for a while is read to its end.
    video = subprocess.run([wstac.command, "scene", "render", "Saw3@150,90deg", "-o", "-"], capture_output=True, check=True).stdout
    with subprocess.Popen(["timeout", "60", program, "-"], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as paused:
        paused.stdin.write(video[: len(video) // 2])
        paused.stdin.flush()
        first = paused.stdout.readline()
        rest = paused.communicate(video[len(video) // 2 :])[0]
    said = (first + rest).decode().splitlines()
    same((said[0], said[-1]), ("waiting", "140 frames, 1 event, moved"), "a source that pauses")
    print(f"C++: {len(slips)} {'slip' if len(slips) == 1 else 'slips'} by two standards without exceptions, and a sensor that is moved")


MOVED = """
#include <cstdio>
#include <wstac.hpp>
int main(int argc, char **argv)
{
    wstac::Sensor first = wstac::Sensor::open(argc > 1 ? argv[1] : "scene:Saw3@150,90deg");
    wstac::Sensor second(static_cast<wstac::Sensor &&>(first));
    first = wstac::Sensor::open("scene:Saw3@0");
    unsigned events = 0, frames = 0;
    const bool is_read = second.each([&](const WstacRecord &record) noexcept {
        if (record.kind == WSTAC_KIND_WAITING) {
            std::puts("waiting");
            std::fflush(stdout);
        }
        events += record.kind == WSTAC_KIND_EVENT;
        frames = record.kind == WSTAC_KIND_END ? static_cast<unsigned>(record.frame) : frames;
        return true;
    });
    wstac::Sensor third(static_cast<wstac::Sensor &&>(second));
    WstacRecord record = WstacRecord();
    const bool refuses = !first && !second.next(record) && second.status() == WSTAC_STATUS_NULL;
    WstacFrames of_frames = WstacFrames();
    of_frames.width = of_frames.height = 400;
    of_frames.format = "GREY";
    const bool is_whole = static_cast<bool>(third);
    wstac::Sensor pushed = wstac::Sensor::of_frames(of_frames);
    third = static_cast<wstac::Sensor &&>(pushed);
    // It waits for frames, so nothing comes.
    const bool returns = third.each([](const WstacRecord &) noexcept { return true; });
    std::printf("%u frames, %u event, %s\\n", frames, events, is_read && refuses && is_whole && returns ? "moved" : "wrong");
}
"""
# What a header defines: types, constants of enumerations, variables and functions.
DEFINED = [
    r"\b(?:struct|enum)\s+(\w+)",
    r"^typedef [^{};]*?(\w+);",
    r"^}\s*(\w+);",
    r"^\s+(\w+) = ",
    r"^extern const [^;]*?(\w+);",
    r"(\w+)\(",
]


def check_names(prefix, machine):
    """Checks that both headers define only names with their prefix, and that the static libraries give only such. Names
    that begin with two underscores, _R or _ZN belong to compilers.
    """
    standard = "#include <stdbool.h>\n#include <stddef.h>\n#include <stdint.h>\n"
    types = '#include "wstac_types.h"\n'
    headers = (
        ("wstac_types.h", standard, "WSTAC_(?!FW_)", "Wstac(?!Fw)", 8),
        ("wstac.h", types, "WSTAC_(?!FW_)", "Wstac(?!Fw)", 40),
        ("wstac_fw.h", types, "WSTAC_FW_", "WstacFw", 40),
    )
    for header, before, upper, camel, least in headers:
        plain = macros(before, prefix)
        given = {name for name in macros(f'#include "{header}"\n', prefix) if name not in plain}
        text = re.sub(r"//[^\n]*|/\*.*?\*/|#[^\n]*", "", (prefix / "include" / header).read_text(), flags=re.DOTALL)
        for pattern in DEFINED:
            given |= set(re.findall(pattern, text, re.MULTILINE))
        allowed = rf"({upper}|{upper.lower()}|{camel})\w*|{Path(header).stem.upper()}_H"
        wrong = sorted(name for name in given if not re.fullmatch(allowed, name))
        if wrong or len(given) < least:
            fail(f"{header}: {len(given)} names, of which {wrong} have no prefix")
    for target in (machine, *{target for target, _ in ABIS.values()}):
        symbols = run(["readelf", "--syms", "--wide", prefix / "lib" / target / "libwstac_fw.a"])
        # Weak ones give way to those of a program, and C has no name with a dot.
        names = set(re.findall(r" GLOBAL +\w+ +(?!UND)\w+ (\w+)$", symbols, re.MULTILINE))
        wrong = sorted(name for name in names if not re.match(r"wstac_fw_|WSTAC_FW_|__|_R|_ZN", name))
        if wrong or "wstac_fw_init" not in names:
            fail(f"libwstac_fw.a of {target}: {wrong[:20]} of {len(names)} names have no prefix")
    print("names: one prefix for each header and library")


def check_version(prefix):
    """Checks that both headers and their files for CMake and pkg-config have the version of the libraries."""
    version = re.search(r'^version = "(.*)"$', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]
    parts = [int(part) for part in version.split(".")]
    for header, name in (("wstac.h", "WSTAC_VERSION"), ("wstac_fw.h", "WSTAC_FW_VERSION")):
        given = macros(f'#include "{header}"\n', prefix)
        # Those of wstac_fw.h are names of wstac_types.h.
        given = {name: given.get(value, value) for name, value in given.items()}
        same(given[f"{name}_TEXT"], f'"{version}"', f"{name}_TEXT")
        same([int(given[f"{name}_{part}"]) for part in ("MAJOR", "MINOR", "PATCH")], parts, f"parts of {name}")
        same(int(given[name]), parts[0] << 16 | parts[1] << 8 | parts[2], name)
    same(f'set(PACKAGE_VERSION "{version}")' in (prefix / "lib/cmake/wstac/wstacConfigVersion.cmake").read_text(), True, "version for CMake")


def check_exports(prefix):
    """Checks that the host library exports only its own names."""
    given = run(["nm", "-D", "--defined-only", prefix / "lib/libwstac.so"]).split()[2::3]
    header = (prefix / "include/wstac.h").read_text()
    same(sorted(given), sorted(set(re.findall(r"\b(wstac_\w+)\(", header))), "names that libwstac.so gives")
    print(f"names: {len(given)} of the host library")


def check_symbols(programs, elf):
    """Checks that no panic is in a program that calls all functions of the firmware library."""
    names = run([programs.nm, elf])
    declared = set(re.findall(r"\b(wstac_fw_\w+)\(", (programs.prefix / "include/wstac_fw.h").read_text()))
    missing = [name for name in declared if f" {name}\n" not in names]
    panics = [name for name in names.splitlines() if re.search(r"panic|unwrap_failed|rust_begin_unwind", name)]
    if missing or panics:
        fail(f"{elf.name}: misses {missing}, expected all calls; has {panics}, expected no panic")
    print(f"calls: {len(declared)} of the firmware library in {elf.name}, and no panic with these")


def configure(source, build, *arguments):
    """Configures a project with CMake. Returns its exit code and its words."""
    command = ["cmake", "-S", source, "-B", build, "-DCMAKE_BUILD_TYPE=Release", *arguments]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False, timeout=300)
    return done.returncode, done.stdout + done.stderr


def check_cmake(programs, wstac):
    """Builds the examples with find_package, for this machine and for all floating-point ABIs of the board. Their output
    is the same everywhere. Then tries what has to be refused.
    """
    found = f"-DCMAKE_PREFIX_PATH={programs.prefix}"
    folder, fw, host = programs.folder / "with cmake", EXAMPLES, ROOT / "wstac-c/examples"
    toolchain = f"-DCMAKE_TOOLCHAIN_FILE={BOARD / 'toolchain.cmake'}"

    def build(source, name, *arguments):
        code, said = configure(source, folder / name, found, *arguments)
        if code:
            fail(f"cmake of {name}: {said[-2000:]}")
        run(["cmake", "--build", folder / name])
        return folder / name

    expected = "".join(line(record) + "\n" for record in wstac.run("slides.mcap", model="builtin") if record["kind"] == "event")
    same(programs.run(build(host, "host") / "events", "slides.mcap"), expected, "events.c of the host by CMake")
    arguments = ["slides.raw", 400, 400, MODEL]
    machine = build(fw, "machine")
    events, sent = programs.run(machine / "events", *arguments), programs.run_bytes(machine / "link", *arguments)
    touches = [example_line(record) + "\n" for record in wstac.run("slides.mcap") if record["kind"] in ("event", "contact_end")]
    same(nearest(events), "".join(touches), "events.c of the firmware by CMake")
    for abi in ABIS:
        board = build(fw, abi, toolchain, f"-DFLOAT_ABI={abi}")
        has_unit = "Tag_FP_arch" in run(["arm-none-eabi-readelf", "-A", board / "link.elf"])
        passes_in_unit = "Tag_ABI_VFP_args" in run(["arm-none-eabi-readelf", "-A", board / "link.elf"])
        same((has_unit, passes_in_unit), (abi != "soft", abi == "hard"), f"floating-point ABI of {abi}")
        same(programs.on_board(board / "events.elf", *arguments), events, f"events.c on the board, {abi}")
        same(programs.on_board_bytes(board / "link.elf", *arguments), sent, f"link.c on the board, {abi}")
    refused = [
        (host, [found, toolchain], "libwstac.so is for the host"),
        (fw, ["-DCMAKE_PREFIX_PATH=/nowhere"], "wstacConfig.cmake"),
        (fw, [found, toolchain, "-DCMAKE_C_FLAGS=-mcpu=cortex-m3 -mthumb"], "ci/build libwstac-fw installs it for thumbv7m-none-eabi"),
        (fw, [found, "-Dwstac_TARGET=riscv32imc-unknown-none-elf"], "for riscv32imc-unknown-none-elf"),
    ]
    for version, taken in (("0.3", True), ("0.3.0", True), ("0.3.1", False), ("0.2", False), ("1", False)):
        project = programs.folder / f"version {version}"
        project.mkdir()
        lines = ["cmake_minimum_required(VERSION 3.16)", "project(p C)", f"find_package(wstac {version} REQUIRED)", ""]
        (project / "CMakeLists.txt").write_text("\n".join(lines))
        if taken:
            same(configure(project, project / "build", found)[0], 0, f"find_package(wstac {version})")
        else:
            refused.append((project, [found], "compatible"))
    for number, (source, more, words) in enumerate(refused):
        code, said = configure(source, folder / f"refused {number}", *more)
        if code == 0 or words not in " ".join(said.split()):
            fail(f"cmake of {source.name} with {more} says {said[-1500:]!r}, expected a refusal with {words!r}")
    print(f"CMake: examples of this machine and of {len(ABIS)} floating-point ABIs give the same; {len(refused)} refusals")


# Zephyr's symbols of a processor, and the target that the module chooses.
ZEPHYR = {
    ("CPU_CORTEX_M0PLUS",): "thumbv6m-none-eabi",
    ("CPU_CORTEX_M4", "FPU"): "thumbv7em-none-eabi",
    ("CPU_CORTEX_M7", "FPU", "FP_HARDABI"): "thumbv7em-none-eabihf",
    ("CPU_CORTEX_M55", "FPU", "FP_HARDABI"): "thumbv8m.main-none-eabihf",
    ("ARCH_POSIX", "64BIT"): "x86_64-unknown-linux-gnu",
    ("RISCV",): "",
}
# These are not Zephyr's functions. They do what Zephyr's do with a library, so that the module is tried where Zephyr is not.
ZEPHYR_STUB = """
cmake_minimum_required(VERSION 3.20)
project(program C)
add_library(zephyr_interface INTERFACE)
function(zephyr_include_directories)
    target_include_directories(zephyr_interface INTERFACE ${ARGV})
endfunction()
function(zephyr_link_libraries)
    target_link_libraries(zephyr_interface INTERFACE ${ARGV})
endfunction()
add_subdirectory("${MODULE}/zephyr" wstac)
add_executable(program "${EXAMPLES}/events.c" "${EXAMPLES}/mps2-an386/startup.c")
target_link_options(program PRIVATE --specs=rdimon.specs -nostartfiles -T "${EXAMPLES}/mps2-an386/board.ld")
target_link_libraries(program PRIVATE zephyr_interface m)
"""


def check_zephyr(programs):
    """Tries the Zephyr module: the target that its Kconfig chooses, and its CMakeLists.txt with stubs of Zephyr's functions."""
    folder = programs.folder / "zephyr program"
    folder.mkdir()
    module = (programs.prefix / "zephyr/module.yml").read_text()
    same(module, "name: wstac\nbuild:\n  cmake: zephyr\n  kconfig: zephyr/Kconfig\n", "module.yml")
    for symbols, target in ZEPHYR.items():
        stub = "".join(f"config {symbol}\n\tbool\n\tdefault y\n" for symbol in symbols)
        (folder / "Kconfig").write_text(f'{stub}source "{programs.prefix}/zephyr/Kconfig"\n')
        tree = kconfiglib.Kconfig(str(folder / "Kconfig"), warn=False)
        same(tree.syms["WSTAC_TARGET"].str_value, "", "the module's target without CONFIG_WSTAC")
        tree.syms["WSTAC"].set_value("y")
        same(tree.syms["WSTAC_TARGET"].str_value, target, f"the module's target for {symbols}")
    (folder / "CMakeLists.txt").write_text(ZEPHYR_STUB)
    given = [f"-DMODULE={programs.prefix}", f"-DEXAMPLES={EXAMPLES}", "-DCONFIG_WSTAC=y"]
    given.append(f"-DCMAKE_TOOLCHAIN_FILE={BOARD / 'toolchain.cmake'}")
    code, said = configure(folder, folder / "build", *given, "-DCONFIG_WSTAC_TARGET=thumbv7em-none-eabihf")
    if code:
        fail(f"cmake of the Zephyr module: {said[-2000:]}")
    run(["cmake", "--build", folder / "build"])
    events = programs.on_board(folder / "build/program", "slides.raw", 400, 400, MODEL)
    same("contact=slide" in events, True, "events of the Zephyr module's program")
    code, said = configure(folder, folder / "refused", *given, "-DCONFIG_WSTAC_TARGET=")
    if code == 0 or "ci/build libwstac-fw installs it for CONFIG_WSTAC_TARGET" not in said:
        fail(f"the Zephyr module without a library says {said[-1000:]!r}")
    print(f"Zephyr module: {len(ZEPHYR)} choices of Kconfig, and a program with stubs of Zephyr's functions")


def build_camera(programs):
    """Builds the example of the STM32H743 with a model of ST's HAL: for this machine with sanitizers, and for the board."""
    model, include = TESTS / "stm32h743", programs.prefix / "include"
    settings = {"WIDTH": "400u", "HEIGHT": "400u", "FORMAT": "WSTAC_FW_GREY", "PIXEL_BYTES": "1u", "READOUT_MS": "0.0f"}
    settings = [f"-DWSTAC_CAMERA_{name}={value}" for name, value in settings.items()]
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-g", "-I", model, "-I", include, "-I", CAMERA]
    # As it is, for a camera of 640 x 480 with YUYV, and for a Cortex-M7.
    m7 = "-mcpu=cortex-m7 -mthumb -mfpu=fpv5-d16 -mfloat-abi=hard -O2 -c".split()
    run(["arm-none-eabi-gcc", *strict, *m7, CAMERA / "wstac_camera.c", "-o", programs.folder / "m7.o"])
    built = []
    target, flags = ABIS["hard"]
    # The model gives the DMA an address of 32 bits.
    machine = ("camera", ["gcc", "-O1", *SANITIZED, "-no-pie", "-fno-pie"], programs.library(programs.machine), [])
    board = ("camera.elf", ["arm-none-eabi-gcc", *ARM, *flags], programs.library(target), [*LINK, BOARD / "startup.c"])
    for name, compiler, library, link in (machine, board):
        run([*compiler, *strict, *settings, "-c", CAMERA / "wstac_camera.c", "-o", programs.folder / f"{name}.o"])
        more = [*STRICT, "-D_DEFAULT_SOURCE", *settings, "-I", model, "-I", include, "-I", CAMERA]
        run([*compiler, *more, model / "hal.c", programs.folder / f"{name}.o", *link, library, "-lm", "-o", programs.folder / name])
        built.append(programs.folder / name)
    return built


# Fields of records that are times.
TIMES = ("time_ns", "completed_ns", "time_s", "completed_s", "stamp", "stamp_within_ms", "clock")


def monitored(wstac, port, **more):
    """Returns the records and the notes of `wstac monitor`."""
    done = subprocess.run([wstac.command, "monitor", port, "--json", "--status"], capture_output=True, check=False, timeout=300, **more)
    records = [json.loads(text) for text in done.stdout.splitlines()]
    check_stamps(records)
    return records, done.stderr.decode()


def check_stamps(records):
    """Checks that wall-clock times are as far from each other as times of the monotonic clock. They are cut to whole
    milliseconds, and somebody may slew the wall clock meanwhile.
    """
    stamped = [record for record in records if record.get("stamp") is not None]
    apart = [1000 * datetime.datetime.fromisoformat(record["stamp"]).timestamp() - record["time_ns"] / 1e6 for record in stamped]
    if apart and max(apart) - min(apart) > 20:
        fail(f"stamps of a board do not go with its times: {stamped}")


def over_lossy_line(command, wstac, folder):
    """Runs a board's program in real time. Returns the records and notes of `wstac monitor`, and the line between them."""
    command = [str(part) for part in command]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=folder, bufsize=0) as board:
        line = LossyLine(board)
        passing = threading.Thread(target=line.run)
        passing.start()
        records, notes = monitored(wstac, line.port)
        passing.join()
        board.stdin.close()
        same(board.wait(60), 0, "exit code of the board's program")
    return records, notes, line


def check_camera(programs, wstac):
    """Runs the example of the STM32H743: `wstac monitor` prints what `wstac run` prints, over a line that loses events
    and acknowledgments, too. Faults of the camera lose their frames and no other.
    """
    camera, elf = build_camera(programs)
    expected = [as_a_board(record) for record in wstac.run("slides.mcap") if record["kind"] in ("event", "contact_end")]
    arguments = ["slides.raw", 400, 400, MODEL]
    sent = programs.run_bytes(camera, *arguments)
    records, notes = monitored(wstac, "-", input=sent)
    same(records[:-1], expected, "the events of wstac_camera.c")
    if "stm32h743 with HAL" not in notes or "lost" in notes or "damaged" in notes:
        fail(f"wstac monitor says {notes!r} of wstac_camera.c")
    same(programs.on_board_bytes(elf, *arguments), sent, "the bytes of wstac_camera.c on the board")

    # A board gives an event up after 4 s of its time. A machine under load may be that late: then the clock runs slower.
    for speed in (4, 2, 1):
        # Noise ends the reception before the first event.
        records, notes, line = over_lossy_line([camera, *arguments, speed, "noise=90"], wstac, programs.folder)
        if "events lost" not in notes and "event lost" not in notes:
            break
    # An event that was lost at first comes behind the end of its touch.
    in_order = lambda found: sorted(found, key=lambda record: (record.get("event_frame", record["frame"]), record["kind"] == "contact_end"))
    # Live, times are those of the board's clock.
    timeless = lambda found: [{name: value for name, value in record.items() if name not in TIMES} for record in found]
    same(in_order(timeless(records[:-1])), timeless(expected), f"the events of wstac_camera.c over a line that loses events; notes are {notes}")
    same(timeless(records[:-1]) != timeless(expected), True, "events that are lost at first come later")
    events = sum(record["kind"] == "event" for record in expected)
    if len(line.sent) != events or min(line.sent.values()) < 3 or len(line.acknowledged) != events:
        fail(f"{events} events: sent {line.sent}, acknowledged {line.acknowledged}, {notes!r}")

    # Frames without a touch.
    lossy = ["short=15", "short=16", "overrun=20", "missing=25", "missing=26", "late=140"]
    faults = [*lossy, "long=30"]
    records, notes = monitored(wstac, "-", input=programs.run_bytes(camera, *arguments, *faults))
    lost = sum(int(found) for found in re.findall(r"(\d+) frames? lost by the board", notes))
    if lost != len(lossy) or "2 overruns" not in notes:
        fail(f"wstac_camera.c with {faults}: {lost} frames lost, {notes!r}")
    same(records[-1]["frames"] >= expected[-1]["frame"], True, "frames behind faults")
    frames = lambda found: [(record["kind"], record["frame"], record.get("contact")) for record in found]
    same(frames(records[:-1]), frames(expected), f"events of wstac_camera.c with {faults}")
    print(
        f"STM32H743's example: {len(expected)} records as wstac run, also with each event and acknowledgment lost once; "
        f"{lost} frames lost by {len(faults)} faults"
    )


def check_host(programs):
    plain, sanitized = programs.build_host(TESTS / "host.c")
    for how in ([sanitized], [*VALGRIND, plain]):
        said = programs.run(*how, "slides.mcap", "slides.raw", 400, 400, "GREY")
    print(f"host library: {said}", end="")


def check_page(programs):
    """Checks that the program on the crate's page prints what the page says."""
    page = (ROOT / "wstac-c/README.md").read_text()
    program, printed = re.search(r"```c\n(.*?)```\n\nThis prints `(.*?)`", page, re.DOTALL).groups()
    source = programs.folder / "page.c"
    source.write_text("#include <stdio.h>\n#include <wstac.h>\nint main(void)\n{\n" + program + "return status != WSTAC_STATUS_OK;\n}\n")
    _, sanitized = programs.build_host(source)
    same(programs.run(sanitized), printed + "\n", "the program of wstac-c/README.md")


def check_host_records(programs, wstac):
    """Checks every field of events and ends of contacts by both laws."""
    _, sanitized = programs.build_host(TESTS / "records.c")
    for law, more in (("arrival times", []), ("the published law", [PUBLISHED])):
        lines = wstac.run("slides.mcap", "--samples", *(["--config", *more] if more else []))
        expected = [record_of(line) for line in lines if line["kind"] in ("event", "contact_end")]
        found = [json.loads(text) for text in programs.run(sanitized, "slides.mcap", *more).splitlines()]
        same(found, expected, f"records by {law}")
        events = [record for record in expected if record["kind"] == "event"]
        ends = [record["event_frame"] for record in expected if record["kind"] == "contact_end"]
        kinds = sorted({str(event["contact"]) for event in events})
        # All that a law gives is there to be compared.
        same(kinds, ["None"] if more else ["poke", "press", "slide", "unclear"], f"kinds of touch by {law}")
        same(ends, [] if more else [event["frame"] for event in events], f"ends of contacts by {law}")
        print(f"host library, {law}: every field of {len(events)} events and {len(ends)} ends of contacts")
    # What 25 taxels tell of a narrow object.
    source = f"scene:{BALL}"
    expected = [record_of(line) for line in wstac.run(source, "--samples") if line["kind"] in ("event", "contact_end")]
    found = [json.loads(text) for text in programs.run(sanitized, source).splitlines()]
    same(found, expected, "records by a wave")
    known = [event["width_mm"] and event["place_sd_mm"] and event["basis"] for event in expected if event["kind"] == "event"]
    same((known, expected[0]["contacts"]), (["outline"], 1), "what a wave tells of a ball")
    lines = wstac.run(f"scene:{HELD}", "--samples")
    found = [json.loads(text) for text in programs.run(sanitized, f"scene:{HELD}").splitlines()]
    same(found, [record_of(line) for line in lines if line["kind"] in ("event", "contact_end", "slip")], "records of a slip")
    same([record["onset_frame"] for record in found if record["kind"] == "slip"], [105], "the onset of a slip")


def example_line(record):
    """Returns an event, or the end of a touch, as the firmware example prints it."""
    if record["kind"] == "contact_end":
        return f"frame={record['frame']} end of the touch of event {record['event_frame']}"
    frame, answers = line(record, True).split(" ", 1)
    return f"{frame} contact={record['contact']} {answers}"


def as_a_board(record):
    """Returns a record of `wstac run` without what the link of a board does not say: at which speeds its model holds."""
    why = dict(record.get("why", {}))
    if record.get("texture") is not None:
        why.pop("texture", None)
    rest = {key: value for key, value in record.items() if key != "why"}
    return {**rest, "why": why} if why else rest


def check_link(programs, wstac):
    """Checks that `wstac monitor` prints what a program with the firmware library sends, as `wstac run` prints it. The
    program is C99, C++11 and -Wconversion clean.
    """
    source = EXAMPLES / "link.c"
    include = ["-I", programs.prefix / "include"]
    for language in (["gcc", "-x", "c", "-std=c99"], ["g++", "-x", "c++", "-std=c++11"]):
        run([*language, "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-fsyntax-only", *include, source])
    _, sanitized = programs.build_firmware(source)
    records = wstac.run("slides.mcap")
    expected = [as_a_board(record) for record in records if record["kind"] in ("event", "contact_end", "end")]
    reasons = [record["why"]["reliable"] for record in expected if "reliable" in record.get("why", {})]
    same(reasons, ["too fast to tell a slide from a press"], "the reasons that the link has to carry")
    arguments = ["slides.raw", 400, 400, MODEL]
    found, said = monitored(wstac, "-", input=programs.run_bytes(sanitized, *arguments))
    same(found, expected, "the events of link.c")
    for words in ("link.c 1.0: 400x400 Gray at 30 frames per second", "chip 000000030000000200000001", "model of", "0 overruns"):
        if words not in said:
            fail(f"wstac monitor says {said!r}, expected {words!r}")
    if "lost" in said or "damaged" in said:
        fail(f"wstac monitor says {said!r}")
    print(f"link: {len(found)} records of link.c as wstac run prints them")


def check_firmware(programs, wstac):
    """Checks every format: features, samples and answers equal those of `wstac run` bit for bit, and speeds equal what
    it prints. Three formats are checked by every law, and on the board with and without its floating-point unit:
    tests/firmware checks the others there.
    """
    source = TESTS / "firmware.c"
    plain, sanitized = programs.build_firmware(source)
    elves = [programs.build_board(source, core) for core in programs.cores]
    for elf in elves:
        check_symbols(programs, elf)
    width, height = SIZE
    for number, name in enumerate(programs.formats):
        fourcc, _, linear = name.partition("-")
        raw, records, on_board = f"{name}.raw", {}, name in ON_BOARD
        for law, key in LAWS.items() if on_board else [("published", LAWS["published"])]:
            (programs.folder / "law.toml").write_text(f"[speed]\n{key}\n" + ('[green]\nyuv = "linear"\n' if linear else ""))
            asked = ["--format", fourcc, "--size", f"{width}x{height}", "--config", "law.toml"]
            more = ["--features", "--samples", "--save-raw", raw] if law == "published" else []
            records[law] = wstac.run("scene:Saw3@150,90deg", *asked, *more)
        lines, speeds = firmware_lines(records["published"])
        events = {law: [record for record in records[law] if record["kind"] == "event"] for law in records}
        motions = [motion_line(*pair) for pair in zip(events["coherence"], events["edges"], strict=True)] if on_board else None
        if not events["published"] or on_board and motions[0][2] != "slide":
            fail(f"{name}: no slide")
        frame_bytes = (programs.folder / raw).stat().st_size // records["published"][-1]["frames"]
        rows = 0 if fourcc in PLANAR else 1 + number % 9
        arguments = [name, raw, width, height, MODEL, rows, frame_bytes]
        outputs = [programs.run(sanitized, *arguments)]
        if on_board:
            outputs += [programs.on_board(elf, *arguments) for elf in elves]
            for core, output in zip(programs.cores, outputs[1:], strict=True):
                same(output, outputs[1], f"{name} on the board, {core}")
        if number == 0:
            outputs.append(programs.run(*VALGRIND, plain, *arguments))
        for output in outputs:
            found, found_speeds, found_motions = parsed(output)
            same(found, lines, name)
            if any(abs(a - b) > 0.0501 for a, b in zip(found_speeds, speeds, strict=True)):
                fail(f"{name}: speeds are {found_speeds}, expected {speeds}")
            for found_motion, motion in zip(found_motions, motions, strict=True) if on_board else ():
                same_motion(found_motion, motion, name)
    print(
        f"firmware library: {len(programs.formats)} formats to the bit, with sanitizers; {len(ON_BOARD)} on the board "
        f"({', '.join(programs.cores)}); GREY in valgrind"
    )


def measured(programs, core, frames):
    """Returns the stack and the instructions of each call on a board, as the maximum over frames of 400 x 400."""
    said = programs.on_board(programs.build_board(TESTS / "stack.c", core), frames, 400, 400, MODEL)
    rows = [line.split() for line in said.splitlines()]
    same([call for call, *_ in rows], list(STACK), "calls that are measured")
    return {call: (int(stack), int(instructions)) for call, stack, instructions in rows}


def check_stack(programs):
    taken = {call: stack for call, (stack, _) in measured(programs, "hard", "slides.raw").items()}
    over = {call: taken[call] for call in STACK if taken[call] > STACK[call]}
    if over:
        fail(f"stack: {over} bytes, expected at most {STACK}")
    print(f"stack on the board, in bytes: {', '.join(f'{call} {taken[call]}' for call in taken)}")
    rows = re.findall(r"^\| `wstac_fw_(\w+?)(?:_stripe)?`[^|]*\| ([\d,]+) \| ([\d,]+) \|$", PAGE.read_text(), re.MULTILINE)
    page = {call: [int(number.replace(",", "")) for number in numbers] for call, *numbers in rows}
    same({call: most for call, (_, most) in page.items()}, STACK, f"limits in {PAGE.name}")
    apart = [call for call, (published, _) in page.items() if abs(taken[call] - published) > 0.02 * published]
    if apart:
        # The limits decide, because another C compiler or checkout path gives other numbers.
        print(f"note: {PAGE.name} is more than 2 % off what was measured of {', '.join(apart)}")


# The programs of size.c by the rows of the page's table.
SIZES = {
    "flash: GREY in stripes, motion by coherence": ["FORMAT=WSTAC_FW_GREY", "LAW=motion_by_coherence"],
    "the same with YUYV, exact": ["FORMAT=WSTAC_FW_YUYV", "LAW=motion_by_coherence"],
    "the same with GREY, trigger set": ["FORMAT=WSTAC_FW_GREY", "LAW=motion_by_coherence", "TRIGGER"],
    "the same with GREY and a model of any kind (without its file)": ["FORMAT=WSTAC_FW_GREY", "LAW=motion_by_coherence", "MODEL"],
    "flash: GREY in stripes, motion by edges": ["FORMAT=WSTAC_FW_GREY", "LAW=motion_by_edges"],
    "flash: GREY in stripes, speed and direction as published": ["FORMAT=WSTAC_FW_GREY", "LAW=as_published"],
}


def check_sizes(programs):
    """Checks the flash of the smallest programs on a Cortex-M4F against the page: at most a tenth more."""
    target, flags = ABIS["hard"]
    page = dict(re.findall(r"^\| ((?:flash|the same)[^|]*?) \| ([\d,]+) bytes \|", PAGE.read_text(), re.MULTILINE))
    same(list(page), list(SIZES), f"rows of {PAGE.name} about flash")
    sizes = {}
    for number, (row, defined) in enumerate(SIZES.items()):
        elf = programs.folder / f"size{number}.elf"
        command = ["arm-none-eabi-gcc", *STRICT, *ARM, "-Os", *flags, *(f"-D{name}" for name in defined), "-I", programs.prefix / "include"]
        link = ["-nostartfiles", "-Wl,-e,main", "-Wl,--gc-sections", "-Wl,--no-warn-rwx-segments"]
        run([*command, TESTS / "size.c", programs.library(target), *link, "-o", elf])
        text, data = run(["arm-none-eabi-size", elf]).splitlines()[1].split()[:2]
        sizes[row] = int(text) + int(data)
    published = {row: int(size.replace(",", "")) for row, size in page.items()}
    over = {row: size for row, size in sizes.items() if size > 1.1 * published[row]}
    if over:
        fail(f"flash: {over} bytes, {PAGE.name} has {published}")
    print(f"flash on the board, in bytes: {', '.join(map(str, sizes.values()))}")
    if any(abs(size - published[row]) > 0.02 * published[row] for row, size in sizes.items()):
        print(f"note: {PAGE.name} is more than 2 % off")


def main():
    match sys.argv[1:]:
        case [command, prefix, *rest] if rest in ([], ["--base"]):
            command, prefix = Path(command).resolve(), Path(prefix).resolve()
        case _:
            sys.exit(__doc__)
    if rest:
        del ABIS["softfp"], ABIS["soft"]
        Programs.cores = ("hard",)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(MODEL_FILE, folder / MODEL)
        wstac, programs = Wstac(command, folder), Programs(folder, prefix)
        check_headers(prefix)
        check_names(prefix, programs.machine)
        check_version(prefix)
        check_exports(prefix)
        wstac.record()
        with ThreadPoolExecutor() as pool:
            # It waits for a clock, mostly.
            camera = pool.submit(check_camera, programs, wstac)
            check_cmake(programs, wstac)
            check_zephyr(programs)
            check_host(programs)
            check_page(programs)
            check_host_records(programs, wstac)
            check_cpp(programs, wstac)
            check_link(programs, wstac)
            check_firmware(programs, wstac)
            check_stack(programs)
            check_sizes(programs)
            camera.result()


if __name__ == "__main__":
    main()

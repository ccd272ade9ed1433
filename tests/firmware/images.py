"""Checks that only the code that an application uses is linked. Measures the examples of wstac-fw, and lists the files
that their code comes from.
"""

import re
import subprocess
import sys

import boards
from boards import BOARDS

MODELS = {"linear_svm": ("linear_svm", "dot"), "forest": ("forest",), "boosted": ("boosted",)}
TREES = ("trees", "descent", "walk")
# Files of wstac-core, or a crate, that an image must not contain.
ABSENT = {
    "features": ("paper/trigger", "paper/baseline_policy", "paper/baseline", "paper/sample", "paper/speed", "paper/direction", "touch/motion/", "exp", "texture", "paper/early", "model/", "wire/", "libm"),
    "trigger": ("paper/baseline_policy", "paper/speed", "paper/direction", "exp", "texture", "paper/early", "model/", "wire/", "libm"),
    "speed": ("paper/baseline_policy", "paper/direction", "texture", "paper/early", "model/", "wire/"),
    "direction": ("paper/baseline_policy", "texture", "paper/early", "model/", "wire/", "touch/motion/"),
    "edges": ("paper/baseline_policy", "paper/speed", "paper/direction", "texture", "paper/early", "model/", "wire/", "touch/motion/shape", "touch/motion/shift", "touch/motion/live/"),
    "motion": ("paper/baseline_policy", "paper/speed", "paper/direction", "texture", "paper/early", "model/", "wire/", "touch/motion/live/"),
    "live": ("paper/baseline_policy", "paper/speed", "paper/direction", "exp", "texture", "paper/early", "model/", "wire/", "touch/motion/axis", "touch/motion/shape", "touch/motion/shift"),
} | {
    name: ("paper/baseline_policy", "paper/speed", "paper/direction", "exp", "paper/early", "wire/", "libm")
    + tuple(f"model/{part}" for other, parts in MODELS.items() if other != name for part in parts)
    + (tuple(f"model/{part}" for part in TREES) if name == "linear_svm" else ())
    for name in MODELS
}
# Files that it must contain, so that an absence has a meaning.
PRESENT = {"features": "taxels", "trigger": "paper/trigger", "speed": "paper/speed", "direction": "paper/direction", "edges": "touch/motion/edges", "motion": "touch/motion/shift", "live": "touch/motion/live/track"} | {
    name: f"model/{name}" for name in MODELS
}


def sources(elf):
    """Returns the files of wstac-core, without `.rs`, that an ELF's code comes from, inlined or not; and `libm`."""
    sections = subprocess.check_output(["arm-none-eabi-objdump", "-h", elf], text=True)
    _, length, start = re.search(r"\.text\s+(\w+)\s+(\w+)", sections).group(0).split()
    start, length = int(start, 16), int(length, 16)
    places = "\n".join(hex(at) for at in range(start, start + length, 2))
    command = ["arm-none-eabi-addr2line", "-i", "-e", elf]
    lines = subprocess.run(command, input=places, capture_output=True, text=True, check=True).stdout
    found = set(re.findall(r"wstac-core/(?:\./)?src/([\w/]+)\.rs", lines))
    return found | ({"libm"} if re.search(r"/libm-\d", lines) else set())


def unknown():
    """Returns names of `ABSENT` and `PRESENT` that are no file or folder of wstac-core. With outdated names, the check
    would see nothing.
    """
    names = {part for parts in ABSENT.values() for part in parts} | set(PRESENT.values())
    core = boards.ROOT / "wstac-core/src"
    return sorted(name for name in names - {"libm"} if not (core / name).is_dir() and not (core / f"{name}.rs").is_file())


def measure(target, numbers):
    """Adds the flash of every image to the numbers of the target's boards. Exits if an image contains what it should
    not.
    """
    programs = boards.build(target, "--examples") / "examples"
    for name, absent in ABSENT.items():
        elf = programs / name
        held = sources(elf)
        if PRESENT[name] not in held:
            sys.exit(f"{target}: the image {name} has no code of {PRESENT[name]}: the check sees too little")
        wrong = sorted(file for file in held if any(file == part or file.startswith(part) for part in absent if part[-1] == "/" or file == part))
        if wrong:
            sys.exit(f"{target}: the image {name} holds code of {', '.join(wrong)}, which it does not ask for")
        for board in BOARDS:
            if board.target == target:
                numbers[board.core][f"image {name}"] = boards.sizes(elf).flash
    print(f"{target}: no image of {len(ABSENT)} holds what it does not ask for", flush=True)

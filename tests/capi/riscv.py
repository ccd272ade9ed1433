#!/usr/bin/env python3
"""Checks the firmware library on RISC-V, in QEMU, and the package for ESP32 chips, whose camera is a stub.

    riscv.py WSTAC PREFIX ESP32    PREFIX: where ci/build libwstac-fw has installed for this machine and for CORES; ESP32: what
                                   ci/build esp32 has written
"""

import re
import shutil
import sys
import tempfile
from pathlib import Path

import check
from check import BOARDS, EXAMPLES, MODEL, MODEL_FILE, ON_BOARD, ROOT, SANITIZED, STRICT, TESTS, Wstac, configure, fail, run, same

STUBS = TESTS / "esp32"
# The libraries by what the core has: multiplication and 16-bit instructions; atomics; floating point.
CORES = {
    "imc": ("riscv32imc-unknown-none-elf", ["-march=rv32imc", "-mabi=ilp32"]),
    "imac": ("riscv32imac-unknown-none-elf", ["-march=rv32imac", "-mabi=ilp32"]),
    "imafc": ("riscv32imafc-unknown-none-elf", ["-march=rv32imafc", "-mabi=ilp32f"]),
}
CHIPS = {"esp32c2": "imc", "esp32c3": "imc", "esp32c5": "imac", "esp32c6": "imac", "esp32h2": "imac", "esp32p4": "imafc"}
# The C library reads files byte by byte, which takes longer than all else.
SLIDE = "scene:Saw3@150,90deg"
GCC = "riscv64-unknown-elf-gcc"
COMPILE = ["-O2", "-ffunction-sections", "-fdata-sections"]
MEMORY = {"__flash": "0x80000000", "__flash_size": "0x400000", "__ram": "0x80400000", "__ram_size": "0x400000", "__stack_size": "0x8000"}
# picolibc's files and arguments are the host's. The C library's own argument 0 comes before them.
HOSTED = ["--specs=picolibc.specs", "--oslib=semihost", "--crt0=semihost", *(f"-Wl,--defsym={name}={value}" for name, value in MEMORY.items())]
# The table of docs/C.md, in bytes of stack and instructions, and what may be more: another compiler gives other numbers.
TABLE = re.compile(r"^\| `wstac_fw_(\w+)`, stack \| ([\d,]+) \| ([\d,]+) \| ([\d,]+) \| ([\d,]+) \|$", re.MULTILINE)
MORE = 1.1


class Riscv(check.Programs):
    """Builds C programs for this machine, with and without sanitizers, and for QEMU's board `virt`."""

    cores = tuple(CORES)
    nm = "riscv64-unknown-elf-nm"
    formats = tuple(ON_BOARD)
    # Whether the emulator counts instructions, which takes longer.
    counted = False

    def build_board(self, source, core="imac", *more):
        elf = self.folder / f"{source.stem}-{core}.elf"
        target, flags = CORES[core]
        command = [GCC, *STRICT, *COMPILE, *flags, *HOSTED, "-I", self.prefix / "include"]
        run([*command, source, *more, self.library(target), "-lm", "-o", elf])
        return elf

    def on_board_bytes(self, elf, *arguments):
        named = ",".join(f"arg={argument}" for argument in arguments)
        # Only what every core of the program has: an instruction of another one is a fault, after which QEMU would run for ever.
        letters = {"a": "imac" in elf.stem or "imafc" in elf.stem, "f": "imafc" in elf.stem, "d": False, "v": False}
        cpu = "rv32," + ",".join(f"{letter}={'true' if has else 'false'}" for letter, has in letters.items())
        machine = f"timeout 300 qemu-system-riscv32 -M virt -m 16M -bios none -nographic -monitor none -serial none -cpu {cpu}".split()
        if self.counted:
            machine += ["-icount", "shift=0"]
        machine += ["-chardev", "stdio,id=out", "-semihosting-config", f"enable=on,target=native,chardev=out,{named}"]
        said = self.run_bytes(*machine, "-kernel", elf)
        # Its standard error goes there, too.
        return re.sub(rb"^\d+ expectations\r?\n", b"", said, flags=re.MULTILINE)


def check_cmake(programs):
    """Checks that find_package takes the library of the compiler's core, and refuses a floating-point ABI without one."""
    project = programs.folder / "riscv project"
    project.mkdir()
    (project / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(p C)\nfind_package(wstac REQUIRED COMPONENTS fw)\n"
        "get_target_property(archive wstac::fw IMPORTED_LOCATION)\nmessage(STATUS \"archive ${archive}\")\n"
    )
    given = [f"-DCMAKE_PREFIX_PATH={programs.prefix}", "-DCMAKE_SYSTEM_NAME=Generic", f"-DCMAKE_C_COMPILER={GCC}"]
    given.append("-DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY")
    for core, (target, flags) in CORES.items():
        code, said = configure(project, project / core, *given, f"-DCMAKE_C_FLAGS={' '.join(flags)}")
        same((code, f"lib/{target}/libwstac_fw.a" in said), (0, True), f"the library that CMake finds for {core}: {said[-1500:]}")
    code, said = configure(project, project / "double", *given, "-DCMAKE_C_FLAGS=-march=rv32imafdc -mabi=ilp32d")
    same((code != 0, "the compiler's target is unknown" in said), (True, True), f"an ABI without a library: {said[-1500:]}")
    print(f"CMake: the library of {len(CORES)} cores, and a refusal")


def check_costs(programs, wstac):
    """Checks stack and instructions of every call against the page's table, for frames of 400 x 400."""
    wstac.run(SLIDE, "--size", "400x400", "--format", "GREY", "--save-raw", "one.raw")
    programs.counted = True
    taken = {core: check.measured(programs, core, "one.raw") for core in CORES}
    programs.counted = False
    page = {call: [int(number.replace(",", "")) for number in numbers] for call, *numbers in TABLE.findall(check.PAGE.read_text())}
    for call in next(iter(taken.values())):
        print(f"RISC-V {call}: " + "; ".join(f"{core} {taken[core][call][0]} bytes, {taken[core][call][1]} instructions" for core in CORES))
    rows = {"push_frame": "push", "motion": "motion"}
    same(sorted(page), sorted(rows), f"rows of {check.PAGE.name} about RISC-V")
    for row, call in rows.items():
        found = [taken["imac"][call][0], taken["imafc"][call][0], taken["imac"][call][1], taken["imafc"][call][1]]
        if any(now > MORE * then for now, then in zip(found, page[row], strict=True)):
            fail(f"{call}: {found}, {check.PAGE.name} has {page[row]}")
    over = {core: call for core in CORES for call, (stack, _) in taken[core].items() if stack > check.STACK[call]}
    same(over, {}, "calls with more stack than a Cortex-M4F may have")


def check_sizes(programs):
    sizes = {}
    for core, (target, flags) in CORES.items():
        elf = programs.folder / f"size-{core}.elf"
        defined = ["-DFORMAT=WSTAC_FW_GREY", "-DLAW=motion_by_coherence"]
        command = [GCC, *STRICT, *COMPILE, "-Os", *flags, "--specs=picolibc.specs", *defined, "-I", programs.prefix / "include"]
        link = ["-nostartfiles", "-Wl,-e,main", "-Wl,--undefined=main", *HOSTED[3:]]
        run([*command, TESTS / "size.c", programs.library(target), *link, "-o", elf])
        text, data = run(["riscv64-unknown-elf-size", elf]).splitlines()[1].split()[:2]
        sizes[core] = int(text) + int(data)
    print(f"RISC-V flash, in bytes: {', '.join(f'{core} {size}' for core, size in sizes.items())}")
    published = re.search(r"^\| flash, motion by coherence \| ([\d,]+) \| ([\d,]+) \|", check.PAGE.read_text(), re.MULTILINE)
    for core, number in zip(("imac", "imafc"), published.groups(), strict=True):
        if sizes[core] > MORE * int(number.replace(",", "")):
            fail(f"flash: {sizes}, {check.PAGE.name} has {number}")


def example(programs, package, name, core=None):
    """Builds an example of the package with the stubs, for a core or for this machine with sanitizers. Returns the program."""
    example_source = package / "examples" / name
    include = ["-I", STUBS, "-I", package / "src"]
    if core is None:
        compilers, library, link = ["gcc", "-O1", *SANITIZED], programs.library(programs.machine), []
    else:
        chip = next(chip for chip, of in CHIPS.items() if of == core)
        compilers, library, link = [GCC, *COMPILE, *CORES[core][1]], package / "src" / chip / "libwstac_fw.a", HOSTED
    sources = [STUBS / "camera.c", package / "src/wstac_esp32.c"]
    sources += [STUBS / "arduino.cpp", example_source] if example_source.suffix == ".ino" else [example_source]
    objects = []
    for source in sources:
        objects.append(programs.folder / f"{source.stem}-{core}.o")
        cpp = source.suffix in (".ino", ".cpp")
        language = ["-x", "c++", "-std=c++17", "-fno-exceptions", "-fno-rtti"] if cpp else ["-x", "c", "-std=gnu11"]
        if source.suffix == ".ino":
            language += ["-include", STUBS / "Arduino.h"]
        specs = [] if core is None else HOSTED[:1]
        run([*compilers, *specs, *language, "-Wall", "-Wextra", "-Werror", *include, "-c", source, "-o", objects[-1]])
    program = programs.folder / f"{Path(name).stem}-{core}.elf"
    run([*compilers, *objects, *link, library, "-lm", "-o", program])
    return program


def events_of(said):
    return [line for line in said.splitlines() if line.startswith("frame=")]


# These are not ESP-IDF's functions. They do what those do with a component, so that it is tried where ESP-IDF is not.
IDF_STUB = """
cmake_minimum_required(VERSION 3.16)
project(program C)
set(COMPONENT_LIB component)
function(idf_component_register)
    cmake_parse_arguments(_ "" "" "SRCS;INCLUDE_DIRS" ${ARGN})
    add_library(component STATIC ${__SRCS})
    target_include_directories(component PUBLIC ${__INCLUDE_DIRS})
endfunction()
function(add_prebuilt_library name path)
    add_library(${name} STATIC IMPORTED GLOBAL)
    set_property(TARGET ${name} PROPERTY IMPORTED_LOCATION "${path}")
endfunction()
add_subdirectory("${PACKAGE}" wstac)
add_executable(program-imafc "${PACKAGE}/examples/idf/main/main.c" "${STUBS}/camera.c")
target_include_directories(program-imafc PRIVATE "${STUBS}")
target_link_libraries(program-imafc PRIVATE component m)
"""


def check_component(programs, package, expected):
    """Builds the component's example for an ESP32-P4 with stubs of ESP-IDF's functions, and tries a chip without an archive."""
    folder = programs.folder / "idf"
    folder.mkdir()
    (folder / "CMakeLists.txt").write_text(IDF_STUB)
    given = [f"-DPACKAGE={package}", f"-DSTUBS={STUBS}", f"-DCMAKE_C_COMPILER={GCC}", "-DCMAKE_SYSTEM_NAME=Generic"]
    given += ["-DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY", f"-DCMAKE_C_FLAGS={' '.join([*CORES['imafc'][1], *HOSTED])}"]
    code, said = configure(folder, folder / "build", *given, "-DIDF_TARGET=esp32p4")
    same(code, 0, f"cmake of the component: {said[-1500:]}")
    run(["cmake", "--build", folder / "build"])
    same(events_of(programs.on_board(folder / "build/program-imafc", "qvga.raw")), expected, "events of the component's example")
    code, said = configure(folder, folder / "refused", *given, "-DIDF_TARGET=esp32s3")
    same((code != 0, "src/esp32s3/libwstac_fw.a is not there" in " ".join(said.split())), (True, True), f"an ESP32-S3: {said[-1500:]}")


def check_esp32(programs, wstac, package):
    """Runs the examples of the package with a simulated slide: their events are those of `wstac run`. Faults of the camera lose their
    frames and no other.
    """
    for chip, core in CHIPS.items():
        archive = (package / "src" / chip / "libwstac_fw.a").read_bytes()
        same(archive == programs.library(CORES[core][0]).read_bytes(), True, f"the archive of {chip}")
    left = [file for file in package.rglob("*") if file.suffix in (".yml", ".properties") and "@version@" in file.read_text()]
    same(left, [], "files without a version")
    wstac.run("scene:slides.toml", "--size", "320x240", "--format", "GREY", "--save-raw", "qvga.raw")
    # Of a clip, as of a camera, the readout is not known.
    raw, size = (programs.folder / "qvga.raw").read_bytes(), 320 * 240
    frames = b"".join(b"FRAME\n" + raw[at : at + size] for at in range(0, len(raw), size))
    (programs.folder / "qvga.y4m").write_bytes(b"YUV4MPEG2 W320 H240 F30:1 Cmono XCOLORRANGE=FULL\n" + frames)
    records = wstac.run("qvga.y4m", "--config", BOARDS)
    expected = []
    for record in records:
        if record["kind"] in ("event", "contact_end"):
            line = check.example_line(record).removesuffix(" texture=-")
            line = re.sub(r" texture=\w+$", "", line).replace(" speed=- direction=-", "")
            expected.append(line if record["kind"] != "event" or record["reliable"] else f"{line} not reliable")
    same(any("contact=slide" in line for line in expected), True, "slides of the scene")
    for name in ("idf/main/main.c", "Events/Events.ino"):
        here = example(programs, package, name)
        same(events_of(programs.run(here, "qvga.raw")), expected, f"events of {name}")
        for core in CORES:
            board = example(programs, package, name, core)
            same(events_of(programs.on_board(board, "qvga.raw")), expected, f"events of {name} on {core}")
    check_component(programs, package, expected)
    # Frames without a touch.
    faults = {"none": "no frame for 4 s", "short": "too few or too many", "long": "too few or too many"}
    faults |= {"format": "another pixel format", "size": "another width or height", "back": "is not behind that", "reset": "is not behind that"}
    faults |= {"missing": "lost frames"}
    kinds = lambda lines: [re.sub(r" (speed|direction)=\S+| not reliable", "", line) for line in lines]
    here = example(programs, package, "idf/main/main.c")
    for fault, words in faults.items():
        said = programs.run(here, "qvga.raw", 33333, f"{fault}=15")
        same((words in said, "\nlost frames: 1, surplus frames: 0\n" in f"\n{said}"), (True, True), f"what is said of {fault}: {said}")
        same(kinds(events_of(said)), kinds(expected), f"events with {fault}")
    frames = records[-1]["frames"]
    for period, pattern, share in ((40000, r"lost frames: (\d+)", 0.2), (16667, r"surplus frames: (\d+)", 0.5)):
        counts = [int(count) for count in re.findall(pattern, programs.run(here, "qvga.raw", period))]
        if not counts or abs(counts[-1] - share * frames) > 0.1 * share * frames + 2:
            fail(f"a frame in {period} µs: {counts[-1:]}, expected {share * frames:.0f} of {frames}")
    print(f"ESP32: two examples on {len(CORES)} cores print the {len(expected)} lines of wstac run; {len(faults)} faults, 2 other rates")


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    command, prefix, package = (Path(argument).resolve() for argument in sys.argv[1:])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(MODEL_FILE, folder / MODEL)
        wstac, programs = Wstac(command, folder), Riscv(folder, prefix)
        wstac.record()
        check_cmake(programs)
        wstac.run("scene:slides.toml", "--size", "100x80", "--format", "GREY", "--save-raw", "small.raw")
        arguments = ["small.raw", 100, 80, MODEL]
        events = programs.run(programs.build_firmware(EXAMPLES / "events.c")[1], *arguments)
        for core in CORES:
            same(programs.on_board(programs.build_board(EXAMPLES / "events.c", core), *arguments), events, f"events.c on {core}")
        print(f"events.c: {len(events.splitlines())} lines on {len(CORES)} cores as on this machine")
        check.check_firmware(programs, wstac)
        check_costs(programs, wstac)
        check_sizes(programs)
        check_esp32(programs, wstac, package / "wstac")


if __name__ == "__main__":
    main()

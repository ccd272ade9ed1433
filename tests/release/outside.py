"""Builds packages outside of the workspace, each in an empty folder, of the blocks of docs/PROGRAMS.md: its Cargo.toml and programs.

    outside.py    needs no network once crates are there
"""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path

from common import ROOT, TARGET, fail, folder, run, say

PAGE = "docs/PROGRAMS.md"
BLOCK = re.compile(r"^```(toml|rust)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# The page's program prints this.
EVENT = "150.2 ± 1.6 mm/s, 90.1°"


def package(at: Path, dependencies: str, programs: list[str]) -> Path:
    """Makes a package beside a link to this repository, and returns its folder."""
    made = at / "package"
    (made / "src/bin").mkdir(parents=True)
    (at / "wstac").symlink_to(ROOT)
    (made / "Cargo.toml").write_text(f'[package]\nname = "outside"\nedition = "2024"\n\n{dependencies}')
    # The versions that everything else is tested with.
    (made / "Cargo.lock").write_bytes((ROOT / "Cargo.lock").read_bytes())
    (made / "src/bin/my.wsm").write_bytes((ROOT / "wstac-host/models/forest.wsm").read_bytes())
    for number, program in enumerate(programs):
        (made / f"src/bin/program{number}.rs").write_text(program if "fn main" in program else f"{program}\nfn main() {{}}\n")
    return made


def main() -> None:
    blocks = BLOCK.findall((ROOT / PAGE).read_text(encoding="utf-8"))
    manifests, programs = ([text for kind, text in blocks if kind == wanted] for wanted in ("toml", "rust"))
    if len(manifests) != 2 or len(programs) < 2:
        fail(f"{PAGE} has {len(manifests)} blocks of toml and {len(programs)} of rust, expected 2, and 2 or more")
    # No C is compiled, and no libclang is found.
    alone = {**os.environ, "CC": "false", "CXX": "false", "LIBCLANG_PATH": "/none", "CARGO_TARGET_DIR": str(TARGET / "outside")}
    for manifest, *command in ((manifests[0], "run", "--bin", "program0"), (manifests[1], "check")):
        with folder(Path(tempfile.gettempdir()), "outside-") as at:
            made = package(at, manifest, programs)
            printed = run("cargo", *command, "--quiet", "--offline", cwd=made, env=alone, why=f"a package of {PAGE} does not build")
            if command[0] == "run" and EVENT not in printed:
                fail(f'the program of {PAGE} prints, expected "{EVENT}…":\n{printed}')
        say(f"outside: cargo {' '.join(command)} with {manifest.splitlines()[1].split('#')[0].strip()}")


if __name__ == "__main__":
    main()

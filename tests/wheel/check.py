"""Checks the Python package as a user gets it: the wheel in an environment that has nothing else, compared with the golden
vectors and with the command; the examples of its documents, and its types.

    check.py WSTAC WHEEL FOLDER    the command, the wheel, and a folder for the environment
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TESTS = ROOT / "tests/wheel"
PACKAGE = ROOT / "wstac-python"


def main() -> None:
    wstac, wheel, folder = (Path(argument).resolve() for argument in sys.argv[1:])
    print(f"wheel: {wheel.name}, {wheel.stat().st_size} bytes", flush=True)
    tools = folder / "venv/bin"
    python = tools / "python"
    subprocess.run([sys.executable, "-m", "venv", "--clear", folder / "venv"], check=True)
    # Nothing but the wheel and what it asks for, and the tools of these tests.
    pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, wheel, "-r", TESTS / "requirements-test.txt"], check=True)
    # From elsewhere, so that the package is the installed one.
    empty = folder / "empty"
    empty.mkdir(exist_ok=True)
    # pyright looks for packages by the first Python of the path.
    variables = {**os.environ, "WSTAC": str(wstac), "PYTHONDONTWRITEBYTECODE": "1", "PATH": f"{tools}:{os.environ['PATH']}"}

    def run(*command: str | Path, **options: object) -> subprocess.CompletedProcess:
        return subprocess.run(command, check=True, cwd=empty, env=variables, **options)

    pytest = (python, "-m", "pytest", "-q", "-p", "no:cacheprovider")
    mypy = (python, "-m", "mypy", "--strict", "--cache-dir", folder / "mypy")
    # A signal that is ignored here would be ignored by Python, too.
    run("env", "--default-signal=INT", *pytest, TESTS)
    # Where MuJoCo is not installed, its module cannot be imported: ci/long mujoco tests it.
    run(*pytest, "--doctest-modules", "--doctest-ignore-import-errors", "--pyargs", "wstac")
    run(*pytest, "--doctest-glob=README.md", PACKAGE / "README.md")
    run(*mypy, "-p", "wstac")
    run(*mypy, *sorted((PACKAGE / "examples").glob("*.py")))
    run(python, "-m", "mypy.stubtest", "wstac._wstac")
    # Every public name has types, by the other checker of types that editors use.
    typed = subprocess.run(["pyright", "--verifytypes", "wstac", "--ignoreexternal"], check=False, cwd=empty, env=variables, stdout=subprocess.PIPE, text=True)
    complete = [line for line in typed.stdout.splitlines() if "completeness" in line]
    if typed.returncode or not complete:
        sys.exit(typed.stdout)
    print("\n".join(complete))
    print("wheel: as the command, to the bit")


if __name__ == "__main__":
    main()

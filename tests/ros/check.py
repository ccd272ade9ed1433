"""Builds wstac_msgs and wstac_ros with colcon, and checks the node with a real rclpy in a network of its own.

    check.py DISTRIBUTION WHEEL BOARD_BYTES NODE FOLDER    jazzy or kilted, the wheel, a program that plays a board, wstac-node, and
                                                           a folder for the workspace

The Python that runs it has the packages of tests/ros/DISTRIBUTION.txt.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TESTS = ROOT / "tests/ros"
# The folder in which the wheels were built.
BUILT_IN = "/opt/python/cp311-cp311"


def main() -> None:
    distribution, *paths = sys.argv[1:]
    wheel, board, node, folder = (Path(path).resolve() for path in paths)
    prefix = Path(sys.prefix)
    for path in (folder, prefix):
        if " " in str(path):
            sys.exit(f'check.py: "{path}" has a blank, which the scripts of colcon do not take: use a path without one')
    for file in (prefix / "share").glob("**/*.cmake"):
        text = file.read_text(encoding="utf-8")
        if BUILT_IN in text:
            file.write_text(text.replace(BUILT_IN, sys.prefix), encoding="utf-8")
    pip = (sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps", "--force-reinstall")
    subprocess.run([*pip, wheel], check=True)
    subprocess.run([*pip, "--require-hashes", "-r", TESTS / "cyclone.txt"], check=True)
    source = folder / "src"
    folder.mkdir(parents=True, exist_ok=True)
    source.unlink(missing_ok=True)
    source.symlink_to(ROOT / "wstac-ros")
    # Nothing of this machine's own ROS, and not the mark of the wheels that libraries are found: each Python finds them anew.
    foreign = ("AMENT_", "COLCON_", "ROS_", "RMW_", "PYTHON", "_ROS_WHEELS_")
    plain = {name: value for name, value in os.environ.items() if not name.startswith(foreign)}
    variables = plain | {
        "PATH": f"{prefix / 'bin'}:{os.environ['PATH']}",
        "LD_LIBRARY_PATH": str(prefix / "lib"),
        "AMENT_PREFIX_PATH": str(prefix),
        "CMAKE_PREFIX_PATH": str(prefix),
        "ROS_DISTRO": distribution,
        # Without it, colcon has make wait until a busy machine is idle.
        "MAKEFLAGS": f"-j{os.cpu_count()}",
        "PYTHONDONTWRITEBYTECODE": "1",
        # Logs of nodes are kept here, and not at home.
        "ROS_HOME": str(folder / "home"),
    }
    # The last build is kept: what has not changed is not built again.
    build = ("colcon", "build", "--event-handlers", "console_direct-", "--cmake-args", f"-DPython3_EXECUTABLE={sys.executable}")
    built = subprocess.run(build, check=False, cwd=folder, env=variables, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if built.returncode:
        sys.exit(f"check.py: colcon build has failed\n{built.stdout}")
    print("\n".join(line for line in built.stdout.splitlines() if line.startswith(("Finished", "Summary"))), flush=True)
    # Discovery by multicast stays on this machine.
    heard = '. install/setup.sh && ip link set lo up && exec "$@"'
    network = ("unshare", "--net") if os.geteuid() == 0 else ("unshare", "--map-root-user", "--net")
    command = (*network, "sh", "-c", heard, "sh", sys.executable, TESTS / "heard.py", board, node)
    subprocess.run(command, check=True, cwd=folder, env=variables)
    print(f"ros: {distribution}: passed", flush=True)


if __name__ == "__main__":
    main()

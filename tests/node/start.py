#!/usr/bin/env python3
"""Checks that a wstac-node which somebody else has built starts, says where it listens, publishes what `wstac run` prints of a
scene, and ends without an error.

    start.py WSTAC COMMAND...    the program wstac, and how wstac-node is begun: alone, in a root of its own, or in an emulator
"""

import sys
import time

from common import PATIENCE, Listener, Programs, fail, free_port, of_kind, run_main, same, until

SOURCE = "scene:Saw3@150,90deg"


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    programs = Programs(sys.argv[1], sys.argv[2:], None)
    expected = programs.run(SOURCE)
    endpoint, begun = f"tcp/127.0.0.1:{free_port()}", time.monotonic()
    with programs.node(f"left={SOURCE}", "--listen", endpoint) as node:
        ready = time.monotonic() - begun
        if endpoint not in node.said():
            fail(f"the node says {node.said()!r}, expected {endpoint}")
        listener = Listener(endpoint)
        same(node.wait(PATIENCE), 0, f"exit code of a node that says {node.said()!r}")
        until(lambda: listener.lines("wstac/left/end"), "the end")
    count, heard = 0, {kind: of_kind(listener.lines(f"wstac/left/{kind}"), kind) for kind in ("features", "motion", "event", "contact_end", "end")}
    for kind, found in heard.items():
        wanted = of_kind(expected, kind)
        if kind == "features":
            # Those of before the listener came are not heard.
            wanted = [record for record in wanted if record["frame"] >= found[0]["frame"]]
        same(found, wanted, kind)
        count += len(found)
    same((len(heard["event"]), len(heard["end"])), (1, 1), "events and ends")
    listener.close()
    print(f"ready after {1000 * ready:.0f} ms; {count} records as wstac run, with an event of {heard['event'][0]['speed']['mm_s']} mm/s; exit code 0")


if __name__ == "__main__":
    run_main(main)

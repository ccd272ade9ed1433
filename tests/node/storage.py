#!/usr/bin/env python3
"""Checks wstac-node with Zenoh's storage plugin in a router: what was published last is there for who asks, also after the
node has ended.

    storage.py WSTAC NODE ROUTER    the programs; ROUTER is that of tests/node/storage
"""

import contextlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from common import PATIENCE, Listener, Programs, fail, free_port, of_kind, run_main, same, until

NAMES = ("left", "right")


@contextlib.contextmanager
def storing_router(command, port, folder):
    """Starts a router that stores what is published under wstac/."""
    storages = {"sensors": {"key_expr": "wstac/**", "volume": {"id": "memory"}}}
    config = {
        "mode": "router", "listen": {"endpoints": [f"tcp/127.0.0.1:{port}"]}, "scouting": {"multicast": {"enabled": False}},
        "plugins": {"storage-manager": {"storages": storages}},
    }
    file = folder / "router.json5"
    file.write_text(json.dumps(config))
    with subprocess.Popen([command, file], stdout=subprocess.PIPE, text=True) as router:
        try:
            same(router.stdout.readline(), "ready\n", "what the router says")
            yield
        finally:
            router.kill()


def check(programs, command):
    port = free_port()
    endpoint = f"tcp/127.0.0.1:{port}"
    sources = {name: programs.scene(name, seed) for name, seed in zip(NAMES, (1, 2), strict=True)}
    with storing_router(command, port, programs.folder):
        heard = Listener(endpoint)
        given = [f"{name}={source}" for name, source in sources.items()]
        with programs.node(*given, "--connect", endpoint) as node:
            until(lambda: all(len(heard.lines(f"wstac/{name}/event")) == 3 for name in NAMES), "three events of each sensor")
            kept = {name: heard.kept_events(name) for name in NAMES}
            same(node.wait(PATIENCE), 0, "exit code")
        until(lambda: all(heard.lines(f"wstac/{name}/end") for name in NAMES), "the ends")
        late = Listener(endpoint)

        def stored(keys):
            replies = [reply.ok for reply in late.session.get(keys, timeout=PATIENCE)]
            return {str(sample.key_expr): (json.loads(sample.payload.to_bytes()), str(sample.encoding), sample.attachment) for sample in replies}

        for name in NAMES:
            expected = {key: heard.lines(key)[-1] for key in heard.messages if key.startswith(f"wstac/{name}/")}
            until(lambda: {key: found[0] for key, found in stored(f"wstac/{name}/*").items()} == expected, f"what was published last of {name}", 10)
            same({encoding for _, encoding, _ in stored(f"wstac/{name}/*").values()}, {"application/json"}, "encodings")
            events = of_kind(programs.run(sources[name]), "event")
            # The node answered for all of its events, and the storage keeps the last one.
            same([event for _, (event) in sorted((int(key.rsplit("/", 1)[1]), of_kind([event], "event")[0]) for key, event in kept[name].items())], events, f"events of {name} that the node kept")
            same(of_kind([stored(f"wstac/{name}/event")[f"wstac/{name}/event"][0]], "event"), events[-1:], f"event of {name} in the storage")
            same(stored(f"wstac/{name}/event/*"), {}, "events with numbers after the node has ended")
            if not {f"wstac/{name}/{kind}" for kind in ("event", "contact_end", "motion", "features", "taxels", "state", "end")} <= expected.keys():
                fail(f"keys of {name}: {sorted(expected)}")
        heard.close(), late.close()
    print(f"Zenoh's storage plugin keeps what {len(NAMES)} sensors have published last, and the node answers for its events")


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    wstac, node, command = (Path(argument).resolve() for argument in sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        check(Programs(wstac, node, Path(folder)), command)


if __name__ == "__main__":
    run_main(main)

"""Checks the settings of TLS that the page shows, with certificates that its commands make."""

import re
import subprocess
import sys
import textwrap
import time

import zenoh

from common import PATIENCE, fail, free_port, same, until

ROUTER = "import sys, time, zenoh; s = zenoh.open(zenoh.Config.from_file(sys.argv[1])); time.sleep(1e6)"


def check_tls(programs):
    """A router with TLS passes on what the node publishes, to those alone who have a certificate."""
    page = programs.page.read_text()
    blocks = [textwrap.dedent(block) for block in re.findall(r"(?:^    .*\n)+", page, re.MULTILINE)]
    commands = next(block for block in blocks if block.startswith("openssl req"))
    folder, plain, secret = programs.folder / "tls", free_port(), free_port()
    folder.mkdir()
    subprocess.run(["bash", "-e", "-c", commands.replace("ROUTER", "localhost")], cwd=folder, check=True, capture_output=True)
    for name, start in (("router", '{\n  mode: "router"'), ("client", '{\n  mode: "client"')):
        text = next(block for block in blocks if block.startswith(start))
        text = re.sub(r'"(\w+\.(?:pem|key))"', lambda found: f'"{folder / found[1]}"', text)
        text = text.replace("127.0.0.1:7447", f"127.0.0.1:{plain}").replace("0.0.0.0:7448", f"127.0.0.1:{secret}")
        (folder / f"{name}.json5").write_text(text.replace("ROUTER:7448", f"localhost:{secret}"))
    router = subprocess.Popen([sys.executable, "-c", ROUTER, folder / "router.json5"])
    try:
        with programs.node(programs.scene("sensor", 11), "--connect", f"tcp/127.0.0.1:{plain}"):
            client = opened(zenoh.Config.from_file(folder / "client.json5"))
            heard = []
            subscriber = client.declare_subscriber("wstac/sensor/features", heard.append)
            until(lambda: len(heard) > 10, "features by TLS")
            client.close()
            del subscriber
            # Without a certificate, and with one of another authority.
            text = (folder / "client.json5").read_text()
            without = re.sub(r"connect_certificate.*\n.*enable_mtls: true", "enable_mtls: false", text)
            same(without == text, False, "settings without a certificate")
            for settings in (without, text):
                if settings == text:
                    subprocess.run(["bash", "-e", "-c", commands.replace("ROUTER", "localhost")], cwd=folder, check=True, capture_output=True)
                try:
                    stranger = zenoh.open(zenoh.Config.from_json5(settings))
                except zenoh.ZError:
                    continue
                # TLS 1.3 refuses after the client has sent its part.
                found = []
                stranger.declare_subscriber("wstac/sensor/features", found.append)
                time.sleep(1)
                same(found, [], "features for a client without a right certificate")
                stranger.close()
    finally:
        router.kill(), router.wait()
    print("TLS: a router passes features on to a client with a certificate, and to no other one")


def opened(config):
    """Opens a session as soon as the router is there."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            if time.monotonic() > end:
                fail(f"no connection by TLS: {error}")
            time.sleep(0.2)

"""Look at a scene in the browser: turn it, drag the light, choose methods, see wrong pixels.

The page is served to this machine alone, at an address with a token that is new each time; another
machine reaches it only where `--host` says so. What the page shows is asked for by requests without
a memory, see `lixel.lab.viewer.server`, so that programs may ask as well.
"""

from __future__ import annotations

import argparse
import webbrowser
from contextlib import suppress

from ..options import SCENE_HELP, add_view, natural, view_of
from ..report import status
from .server import Server
from .views import Viewer


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel view`."""
    parser.add_argument("scene", metavar="FILE", help=SCENE_HELP)
    add_view(parser)
    group = parser.add_argument_group("page")
    group.add_argument("--port", type=natural, default=0, metavar="N", help="default: a free one")
    group.add_argument(
        "--host", default="127.0.0.1", metavar="ADDRESS",
        help="whom to listen to; default: this machine alone, 127.0.0.1",
    )  # fmt: skip
    group.add_argument(
        "--no-browser", action="store_true", help="print the address, and open no browser"
    )


def run(options: argparse.Namespace) -> None:
    """Serve until Ctrl-C."""
    viewer = Viewer(options.scene, *view_of(options), up=options.up)
    with Server(viewer, options.host, options.port) as server:
        print(server.address, flush=True)
        status("Ctrl-C ends it")
        if not options.no_browser:
            webbrowser.open(server.address)
        with suppress(KeyboardInterrupt):
            server.serve_forever()

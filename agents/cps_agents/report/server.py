"""Showing a folder in the browser, by a server for this machine only."""

from __future__ import annotations

import webbrowser
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from cps_agents.console import err

HOST = "127.0.0.1"


class Quiet(SimpleHTTPRequestHandler):
    """Serves files without a line for each."""

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


def serve(folder: Path, port: int = 0) -> None:
    """Serve a folder until Ctrl-C, on a free port unless one is given, and open it in a browser if there is one."""
    with ThreadingHTTPServer((HOST, port), partial(Quiet, directory=str(folder))) as server:
        address = f"http://{HOST}:{server.server_address[1]}/"
        if not webbrowser.open(address):
            err().print("No browser was found on this machine: open the address below in one.")
        err().print(f"Serving {folder} at {address}. Press Ctrl-C to stop.", soft_wrap=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            err().print("Stopped.")

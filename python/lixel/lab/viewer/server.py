"""The page of `lixel view` over HTTP, and what it asks for.

Every request needs the token, as ``?token=`` or as ``Authorization: Bearer``. ``view`` is JSON, see
`lixel.lab.viewer.views.Viewer`.

===================  ==================================================================
``GET /``            the page
``GET /scene``       JSON: cameras, lights, methods to choose from, the view to begin with
``GET /frame?view=`` a JPEG picture; the header ``X-Lixel`` is JSON with times and errors
``GET /map?view=``   JSON: shadow map, importance map, lines of the warp's grid, the call
===================  ==================================================================

A view that is refused is answered by status 400 and JSON with its ``error``.
"""

from __future__ import annotations

import hmac
import json
import secrets
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from ..._core import DeviceError
from .views import Viewer


class Server(ThreadingHTTPServer):
    """Serves one viewer at one address with a new token."""

    daemon_threads = True

    def __init__(self, viewer: Viewer, host: str = "127.0.0.1", port: int = 0) -> None:
        super().__init__((host, port), _Handler)
        self.viewer = viewer
        self.token = secrets.token_urlsafe(24)

    @property
    def address(self) -> str:
        """That of the page, with the token."""
        host, port = str(self.server_address[0]), self.server_address[1]
        return f"http://{host}:{port}/?token={self.token}"


class _Handler(BaseHTTPRequestHandler):
    server: Server
    protocol_version = "HTTP/1.1"  # one connection for many frames

    def do_GET(self) -> None:
        parts = urlsplit(self.path)
        query = {name: values[-1] for name, values in parse_qs(parts.query).items()}
        bearer = self.headers.get("Authorization", "").removeprefix("Bearer ")
        given = query.get("token", bearer).encode()
        if not hmac.compare_digest(given, self.server.token.encode()):
            self._send_json({"error": "the token is missing or wrong"}, HTTPStatus.FORBIDDEN)
            return
        try:
            self._answer(parts.path, query)
        except (ValueError, TypeError, KeyError, DeviceError) as error:
            words = " ".join(str(error).split())
            self._send_json({"error": words}, HTTPStatus.BAD_REQUEST)

    def _answer(self, path: str, query: Mapping[str, str]) -> None:
        viewer = self.server.viewer
        match path:
            case "/":
                self._send_page()
            case "/scene":
                self._send_json(viewer.scene_record())
            case "/frame":
                picture, numbers = viewer.frame(json.loads(query["view"]))
                self._send(picture, "image/jpeg", {"X-Lixel": json.dumps(numbers)})
            case "/map":
                self._send_json(viewer.map(json.loads(query["view"])))
            case _:
                self._send_json({"error": f"there is no {path}"}, HTTPStatus.NOT_FOUND)

    def _send_page(self) -> None:
        nonce = secrets.token_urlsafe(12)
        page = Path(__file__).with_name("page.html").read_text(encoding="utf-8")
        policy = (
            f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'unsafe-inline'; "
            "img-src data: blob:; connect-src 'self'; frame-ancestors 'none'"
        )
        content = page.replace("NONCE", nonce).encode()
        self._send(content, "text/html; charset=utf-8", {"Content-Security-Policy": policy})

    def _send_json(self, content: object, status: HTTPStatus = HTTPStatus.OK) -> None:
        self._send(json.dumps(content).encode(), "application/json", {}, status)

    def _send(
        self,
        content: bytes,
        kind: str,
        headers: Mapping[str, str],
        status: HTTPStatus = HTTPStatus.OK,
    ) -> None:
        self.send_response(status)
        for name, value in {
            "Content-Type": kind,
            "Content-Length": str(len(content)),
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            **headers,
        }.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_: Any) -> None:
        """Nothing: frames are many, and lines would hold the token."""

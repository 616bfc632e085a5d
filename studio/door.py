"""Who may come in: only pages of this server, and only with its token.

viser answers anybody who reaches its port, also a page of another site in the user's own browser. Its server is one of
the websockets package, which asks `process_request` before anything is sent; ours stands before viser's.
"""

from __future__ import annotations

import http
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import SplitResult, parse_qs, parse_qsl, urlsplit

import websockets.asyncio.server
from websockets import Headers
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

LOOPBACK = "127.0.0.1"
MISTAKEN = b"400: expected what the page itself sends\n"
HOSTS = (LOOPBACK, "localhost")
REFUSED = b"403: open the address that mirrorgaze studio printed, with its token\n"

SAME_ORIGIN = ("same-origin", "none")
"""What browsers say of a request that one of our own pages sends, and of an address that was typed."""

Listener = Callable[[Mapping[str, str]], None]
Answer = Callable[[ServerConnection, Request], Response | None]


@dataclass(frozen=True)
class Door:
    """What a request must show: the token, in the address or in the cookie that the first page sets.

    Attributes
    ----------
    token : str
        Random, of this run.
    heard : dict
        What our own pages may tell besides asking for files: who takes the values of an address, by its path.
    """

    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    heard: dict[str, Listener] = field(default_factory=dict)

    def address(self, port: int) -> str:
        """Address of the page, with the token."""
        return f"http://{LOOPBACK}:{port}/?token={self.token}"

    def admits(self, request: Request) -> bool:
        """Whether a request comes from our own page, or from who has its address.

        Another site's page may send requests here, and its name may be made to lead here: it is told by its origin, and
        by the host that it asks for.
        """
        host = request.headers.get("Host", "")
        if urlsplit(f"//{host}").hostname not in HOSTS:
            return False
        origin = request.headers.get("Origin")
        if origin is not None and origin != f"http://{host}":
            return False
        shown = (*parse_qs(urlsplit(request.path).query).get("token", ()), self._cookie(request, host))
        return any(secrets.compare_digest(each.encode(), self.token.encode()) for each in shown)

    def before(self, answer: Answer) -> Answer:
        """What answers requests, behind this door."""

        def guarded(connection: ServerConnection, request: Request) -> Response | None:
            if not self.admits(request):
                return _refusal()
            told = urlsplit(request.path)
            if told.path in self.heard:
                return self._hear(request, told)
            response = answer(connection, request)
            if response is not None:
                self._remember(response, request.headers["Host"])
            return response

        return guarded

    @contextmanager
    def guarding(self) -> Iterator[None]:
        """Servers that the websockets package starts meanwhile stand behind this door."""
        serve = websockets.asyncio.server.serve

        def guarded(*arguments: Any, process_request: Answer, **options: Any) -> Any:
            return serve(*arguments, process_request=self.before(process_request), **options)

        websockets.asyncio.server.serve = guarded  # type: ignore[assignment, misc]
        try:
            yield
        finally:
            websockets.asyncio.server.serve = serve  # type: ignore[misc]

    def _hear(self, request: Request, told: SplitResult) -> Response:
        # Pages of other ports of this machine are of the same site, and the cookie goes along with what they ask for.
        if request.headers.get("Sec-Fetch-Site", "none") not in SAME_ORIGIN:
            return _refusal()
        try:
            self.heard[told.path](dict(parse_qsl(told.query)))
        except (KeyError, ValueError):
            return Response(http.HTTPStatus.BAD_REQUEST, "Bad Request", _plain(MISTAKEN), MISTAKEN)
        return Response(http.HTTPStatus.NO_CONTENT, "No Content", Headers({"Cache-Control": "no-store"}))

    def _remember(self, response: Response, host: str) -> None:
        # The page's websocket cannot carry the token in its address: viser makes that. Strict: no other site's page
        # sends it along. The policy keeps other sites from framing the page.
        response.headers["Set-Cookie"] = f"{_cookie_name(host)}={self.token}; Path=/; HttpOnly; SameSite=Strict"
        response.headers["Referrer-Policy"] = "no-referrer"
        response.headers["Content-Security-Policy"] = "frame-ancestors 'self'"

    def _cookie(self, request: Request, host: str) -> str:
        try:
            cookies = SimpleCookie("; ".join(request.headers.get_all("Cookie")))
        except CookieError:
            return ""
        found = cookies.get(_cookie_name(host))
        return "" if found is None else found.value


def _refusal() -> Response:
    return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", _plain(REFUSED), REFUSED)


def _cookie_name(host: str) -> str:
    """Browsers share cookies between ports: each studio's has its own name."""
    return f"mirrorgaze-studio-{urlsplit(f'//{host}').port or 80}"


def _plain(body: bytes) -> Headers:
    return Headers({"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))})

"""Let only its own page steer a live walk, of all pages that a browser has open.

A browser lets any page open a websocket to this machine, and names that page in `Origin`; viser does not check it.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio import server as websockets

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names of this machine that no other machine's page can have."""


def is_own_page(headers: Mapping[str, str], host: str) -> bool:
    """Return True if a request with these `headers` comes from the live page itself, or from a program, which sends no
    `Origin`.

    The page is ours if its address, `Origin`, equals the request's `Host`. If the server listens on an address of this
    machine alone (`host`), the page's host must be such an address too: another name that resolves to this machine (DNS
    rebinding) would pass the first test.
    """
    origin = headers.get("Origin")
    if origin is None:
        return True
    page = urlsplit(origin)
    return page.netloc == headers.get("Host") and (host not in LOOPBACK or page.hostname in LOOPBACK)


@contextmanager
def own_pages_only(host: str) -> Iterator[None]:
    """Make a viser server answer websockets of other pages with 403 inside the block."""
    serve = websockets.serve

    def serve_own(*arguments: Any, process_request: Callable[..., Any], **options: Any) -> Any:
        """Start the server with an answer of 403 to requests from other pages."""

        def process(connection: Any, request: Any) -> Any:
            """Answer a request from another page with 403, any other as viser does."""
            if is_own_page(request.headers, host):
                return process_request(connection, request)
            return connection.respond(HTTPStatus.FORBIDDEN, "This page is not of the live walk.\n")

        return serve(*arguments, process_request=process, **options)

    websockets.serve = serve_own  # type: ignore[assignment,misc]  # viser has no argument for it
    try:
        yield
    finally:
        websockets.serve = serve  # type: ignore[misc]

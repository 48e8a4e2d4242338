"""Access to the page: free on this machine by default, elsewhere only with the token.

Requests of other sites' pages in a browser on this machine are rejected by the ``Origin`` and ``Sec-Fetch-`` headers,
which a page cannot forge, and by the host name they use for this machine (DNS rebinding). Other sites cannot show this
page in a frame either.
"""

import hashlib
import hmac
import html
import re
import secrets
from dataclasses import dataclass, field
from typing import Final, Literal
from urllib.parse import SplitResult, parse_qsl, quote, urlencode, urlsplit

from starlette.datastructures import Headers, MutableHeaders, State
from starlette.requests import cookie_parser
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from handsteer.plugins.page.limits import Connections
from handsteer.transports.addresses import is_loopback

# NiceGUI's pages contain inline scripts and styles, and Vue compiles their templates.
_CONTENT: Final = {
    "default-src": "'none'",
    "script-src": "'self' 'unsafe-inline' 'unsafe-eval'",
    "style-src": "'self' 'unsafe-inline'",
    "img-src": "'self' data: blob:",
    "font-src": "'self' data:",
    "connect-src": "'self'",
    "worker-src": "'self'",
    "media-src": "'self' blob:",
    "manifest-src": "'self'",
    "form-action": "'none'",
    "base-uri": "'none'",
    "frame-ancestors": "'none'",
}

HEADERS: Final = (
    ("Content-Security-Policy", "; ".join(f"{name} {sources}" for name, sources in _CONTENT.items())),
    ("X-Frame-Options", "DENY"),
    ("X-Content-Type-Options", "nosniff"),
    # The address contains the token until the browser has its cookie.
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Permissions-Policy", "camera=(self)"),
)
"""Name and value of each header; sent with pages, static files, video and errors."""


_NAME_BYTES: Final = 18
_LONGEST: Final = 200


class Sessions:
    """Creates and verifies sessions; it stores none of them, so their number costs nothing."""

    def __init__(self) -> None:
        self._key = secrets.token_bytes(32)

    def new(self) -> str:
        """Return a new session."""
        name = secrets.token_urlsafe(_NAME_BYTES)
        return f"{name}.{self._signature(name)}"

    def knows(self, session: str | None) -> bool:
        """Return whether ``session`` was created here."""
        if session is None or len(session) > _LONGEST or not session.isascii():
            return False
        name, _, signature = session.partition(".")
        return hmac.compare_digest(signature, self._signature(name))

    def _signature(self, name: str) -> str:
        return hmac.new(self._key, name.encode(), hashlib.sha256).hexdigest()


_TOKEN_BYTES = 24
_LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})
_KINDS = frozenset({"http", "websocket"})
_FRAMES = frozenset({"iframe", "frame", "fencedframe", "embed", "object"})
_LONGEST_COOKIES = 8192
_HOST = re.compile(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9_.-]+)(:[0-9]{1,5})?", re.ASCII)
"""A name or an address, with a port or not (RFC 9110, section 7.2)."""

SESSION = "handsteer_session"
"""Key of a request's session in the ``state`` of its scope."""

HAD_SESSION = "handsteer_had_session"
"""Key of whether the request came with its session, and was not given it, next to it."""


@dataclass(frozen=True)
class Access:
    """Access rules of the page.

    Attributes:
        token: Required in the address, in the cookie set from it, or in an ``Authorization`` header; None when the page
            is served to this machine only and needs none.
        is_local: Whether the page is served to this machine only.
        sessions: Distinguishes browsers.
    """

    token: str | None = None
    is_local: bool = True
    sessions: Sessions = field(default_factory=Sessions)

    @classmethod
    def to(cls, host: str, token: Literal["auto", "always"] = "auto") -> "Access":
        """Return the rules for a page served on ``host``, a name or an address.

        They have a token unless only this machine can reach the page; with ``always``, in any case.
        """
        is_local = is_loopback(host)
        is_free = is_local and token == "auto"
        return cls(None if is_free else secrets.token_urlsafe(_TOKEN_BYTES), is_local)

    def admits(self, given: str | None) -> bool:
        """Return whether ``given`` is the token, in constant time."""
        return self.token is None or hmac.compare_digest((given or "").encode(), self.token.encode())


class AccessMiddleware:
    """Rejects requests without access: 400 and 403 for pages of other sites, 401 without the token.

    A request without a session is given a new one. ``state`` has the current :class:`Access` as ``access``, and the
    :class:`Connections` as ``connections``.
    """

    def __init__(self, app: ASGIApp, state: State) -> None:
        self._app = app
        self._state = state

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or reject it."""
        if scope["type"] not in _KINDS:
            await self._app(scope, receive, send)
            return
        access: Access = self._state.access
        connections: Connections = self._state.connections
        answer = _answer(access, scope)
        session = _cookie(Headers(scope=scope), session_cookie_name(scope))
        is_known = answer is None and access.sessions.knows(session)
        with connections.serving(scope.get("client"), is_known=is_known):
            if answer is not None:
                await _refuse(answer, scope, receive, send)
                return
            _drop_token(scope)
            if not is_known and scope["type"] == "http":
                session = access.sessions.new()
                send = _with_session(send, scope, session)
            scope.setdefault("state", {})[SESSION] = session if session and access.sessions.knows(session) else ""
            scope["state"][HAD_SESSION] = is_known
            await self._app(scope, receive, send)


async def _refuse(answer: Response, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "http" or "websocket.http.response" in scope.get("extensions", {}):
        await answer(scope, receive, send)
    else:
        await send({"type": "websocket.close", "code": 1008})


def _answer(access: Access, scope: Scope) -> Response | None:
    headers = Headers(scope=scope)
    host = _only(headers, "host")
    if not _HOST.fullmatch(host):
        return PlainTextResponse("the request needs one header Host, with a name or an address", 400)
    if access.is_local and _parts(f"//{host}").hostname not in _LOOPBACK_NAMES:
        return PlainTextResponse("this page is served to this machine only", 400)
    if _is_of_another_site(headers):
        return PlainTextResponse("pages of other sites may not use this one", 403)
    refusal = None if access.token is None else _ask_for_token(access, scope, headers)
    return refusal or (_door(scope, headers) if _follows_a_link(headers) else None)


def _door(scope: Scope, headers: Headers) -> Response:
    """Return a page with a link to the one that another site's link leads to; so that site cannot make us build any."""
    words, language = ("Continue to handsteer", "en")
    if headers.get("accept-language", "").lower().startswith("de"):
        words, language = ("Weiter zu handsteer", "de")
    rest = scope.get("query_string", b"").decode("latin-1")
    address = html.escape(f"/{quote(scope['path'].lstrip('/'))}{'?' if rest else ''}{rest}")
    body = f'<!doctype html><html lang="{language}"><meta name="viewport" content="width=device-width">'
    return HTMLResponse(
        f'{body}<title>handsteer</title><p><a href="{address}">{words}</a></p></html>',
        headers={"Cache-Control": "no-store"},
    )


def _ask_for_token(access: Access, scope: Scope, headers: Headers) -> Response | None:
    cookie = cookie_name(scope)
    query = dict(parse_qsl(scope.get("query_string", b"").decode("latin-1")))
    if access.admits(_cookie(headers, cookie)) or access.admits(_bearer(headers)):
        return None
    if not access.admits(query.pop("token", None)):
        return PlainTextResponse(
            "401: this page needs its whole address, with the token, as handsteer printed it when it started",
            401,
            {"WWW-Authenticate": "Bearer"},
        )
    if scope["type"] != "http" or scope["method"] not in {"GET", "HEAD"}:
        return None
    # Remove the token from the address, which appears in the browser's history and on its screen.
    rest = f"?{urlencode(query)}" if query else ""
    # One slash: a browser takes what follows two slashes for another site.
    answer = RedirectResponse(f"/{scope['path'].lstrip('/')}{rest}", 303)
    _set_cookie(answer, scope, cookie, access.token or "")
    return answer


def _drop_token(scope: Scope) -> None:
    """Remove the token from the address of a request, which others may log."""
    query: bytes = scope.get("query_string", b"")
    if b"token" in query:
        rest = [(name, value) for name, value in parse_qsl(query.decode("latin-1")) if name != "token"]
        scope["query_string"] = urlencode(rest).encode()


def _with_session(send: Send, scope: Scope, session: str) -> Send:
    """Return a ``send`` that sets ``session`` as a cookie in the browser."""
    cookie = Response()
    _set_cookie(cookie, scope, session_cookie_name(scope), session)

    async def send_with_cookie(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).append("Set-Cookie", cookie.headers["set-cookie"])
        await send(message)

    return send_with_cookie


def _set_cookie(answer: Response, scope: Scope, name: str, value: str) -> None:
    answer.set_cookie(name, value, httponly=True, samesite="lax", secure=scope.get("scheme") == "https")


def cookie_name(scope: Scope) -> str:
    """Return the name of the cookie; it includes the port, because browsers share cookies between ports of a host."""
    _, port = scope.get("server") or ("", 0)
    return f"handsteer_{port}"


def session_cookie_name(scope: Scope) -> str:
    """Return the name of the session's cookie, see :func:`cookie_name`."""
    return f"{cookie_name(scope)}_session"


def _is_of_another_site(headers: Headers) -> bool:
    origin = headers.get("origin")
    if origin is not None and _parts(origin).netloc.lower() != _only(headers, "host").lower():
        return True
    if _FRAMES & {each.strip() for each in _only(headers, "sec-fetch-dest").lower().split(",")}:  # we have no frames
        return True
    # Requests for pictures and the like have no Origin. Another port of this machine counts as the same site, but is
    # not ours. Following a link from elsewhere is allowed.
    return not (_is_ours(headers) or _follows_a_link(headers))


def _is_ours(headers: Headers) -> bool:
    return _only(headers, "sec-fetch-site").lower() in {"same-origin", "none", ""}


def _follows_a_link(headers: Headers) -> bool:
    return not _is_ours(headers) and _only(headers, "sec-fetch-mode").lower() == "navigate"


def _only(headers: Headers, name: str) -> str:
    """Return the value of a header; of several, a list, which is not a valid value of those used here."""
    return ", ".join(headers.getlist(name)).strip()


def _parts(address: str) -> SplitResult:
    try:
        return urlsplit(address)
    except ValueError:
        return urlsplit("")


def _cookie(headers: Headers, name: str) -> str | None:
    return cookie_parser(headers.get("cookie", "")[:_LONGEST_COOKIES]).get(name)


def _bearer(headers: Headers) -> str | None:
    kind, _, token = headers.get("authorization", "").partition(" ")
    return token if kind.lower() == "bearer" else None


def session_of(scope: Scope) -> str:
    """Return the session of the browser that a request comes from; empty without one."""
    return str(scope.get("state", {}).get(SESSION, ""))

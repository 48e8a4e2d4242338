"""Who may use the page: everybody on this machine, and elsewhere whoever has the token.

A page of another site that a browser on this machine shows is kept out, whatever it asks for: by the ``Origin`` and
``Sec-Fetch-Site`` headers, which it cannot forge, and by the name that it has for this machine (DNS rebinding).
"""

import hmac
import ipaddress
import secrets
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qsl, urlencode, urlsplit

from starlette.datastructures import Headers, State
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

_TOKEN_BYTES = 24
_LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})
_KINDS = frozenset({"http", "websocket"})


@dataclass(frozen=True)
class Access:
    """What a request needs.

    Attributes:
        token: Has to be in the address, in the cookie that follows from it, or in an ``Authorization`` header; None
            when the page is served to this machine only, which needs none.
    """

    token: str | None = None

    @classmethod
    def to(cls, host: str) -> "Access":
        """Return what is needed where the page is served on ``host``: a fresh token, unless only we can reach it."""
        return cls(None if is_loopback(host) else secrets.token_urlsafe(_TOKEN_BYTES))

    def admits(self, given: str | None) -> bool:
        """Return whether ``given`` is the token; takes as long for a wrong one as for the right one."""
        return self.token is None or hmac.compare_digest((given or "").encode(), self.token.encode())


class AccessMiddleware:
    """Answers those who may not come in: 400 and 403 to pages of other sites, 401 to those without the token.

    Args:
        app: What the others get.
        state: Has the :class:`Access` that holds now, as ``access``.
    """

    def __init__(self, app: ASGIApp, state: State) -> None:
        self._app = app
        self._state = state

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or answer it."""
        answer = _answer(self._state.access, scope) if scope["type"] in _KINDS else None
        if answer is None:
            await self._app(scope, receive, send)
        elif scope["type"] == "http" or "websocket.http.response" in scope.get("extensions", {}):
            await answer(scope, receive, send)
        else:
            await send({"type": "websocket.close", "code": 1008})


def is_loopback(host: str) -> bool:
    """Return whether ``host``, a name or an address, is this machine and nobody else can reach it."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _answer(access: Access, scope: Scope) -> Response | None:
    headers = Headers(scope=scope)
    if access.token is None and _name(headers.get("host", "")) not in _LOOPBACK_NAMES:
        return PlainTextResponse("this page is served to this machine only", 400)
    if _is_of_another_site(headers, scope):
        return PlainTextResponse("pages of other sites may not use this one", 403)
    return None if access.token is None else _ask_for_token(access, scope, headers)


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
    # The token leaves the address, which stands in the browser's history and over its user's shoulder.
    rest = f"?{urlencode(query)}" if query else ""
    answer = RedirectResponse(f"{scope['path']}{rest}", 303)
    is_secure = scope.get("scheme") == "https"
    answer.set_cookie(cookie, access.token or "", httponly=True, samesite="lax", secure=is_secure)
    return answer


def cookie_name(scope: Scope) -> str:
    """Return the name of the cookie: browsers keep apart the cookies of two machines, but not those of two ports."""
    _, port = scope.get("server") or ("", 0)
    return f"handsteer_{port}"


def _is_of_another_site(headers: Headers, scope: Scope) -> bool:
    origin = headers.get("origin")
    if origin is not None and urlsplit(origin).netloc != headers.get("host"):
        return True
    # Without an Origin: pictures and the like. To follow a link from elsewhere is all right.
    return headers.get("sec-fetch-site") == "cross-site" and headers.get("sec-fetch-mode") != "navigate"


def _name(host: str) -> str:
    """Return the name or address in a ``Host`` header, without its port."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _cookie(headers: Headers, name: str) -> str | None:
    try:
        found = SimpleCookie(headers.get("cookie", "")).get(name)
    except CookieError:
        return None
    return found.value if found else None


def _bearer(headers: Headers) -> str | None:
    kind, _, token = headers.get("authorization", "").partition(" ")
    return token if kind.lower() == "bearer" else None

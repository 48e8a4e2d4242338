"""Who may connect.

A browser lets any web page connect to a server of this machine, and names the page's site in the header ``Origin``,
which the page cannot forge. Without the token, only pages of this machine and Foxglove's own are admitted, so that no
other site can watch the camera; where clients may drive, all need the token. Programs other than browsers send no such
header, or one that is not a web address.
"""

import hmac
import secrets
from collections.abc import Mapping
from typing import Final, Literal
from urllib.parse import parse_qs, urlsplit

from handsteer.transports.addresses import is_loopback

_TOKEN_BYTES: Final = 24
_FOXGLOVE: Final = "foxglove.dev"
_BROWSERS_SECRET: Final = "null"  # the origin of sandboxed frames and of local files that a browser does not trust


class Access:
    """The rules for one server.

    Args:
        token: Required from every client; None for a server that only this machine can reach.
    """

    def __init__(self, token: str | None = None) -> None:
        self.token = token

    @classmethod
    def to(cls, host: str, token: Literal["auto", "always"] = "auto") -> "Access":
        """Return the rules for a server on ``host``.

        Args:
            host: A name or an address.
            token: ``auto`` makes a token unless only this machine can reach the server, ``always`` in any case.
        """
        return cls(None if token == "auto" and is_loopback(host) else secrets.token_urlsafe(_TOKEN_BYTES))

    def refusal(self, path: str, headers: Mapping[str, str]) -> str | None:
        """Return why a client is refused, in a sentence, or None if it is admitted.

        Args:
            path: Its request's path, with the query.
            headers: Its request's headers.
        """
        if self.token is not None:
            if hmac.compare_digest(_given(path, headers).encode(errors="surrogateescape"), self.token.encode()):
                return None
            return "connect to the whole address, with the token, as handsteer printed it when it started"
        if _is_trusted(headers.get("Origin")):
            return None
        return "pages of this site may not connect without a token: run handsteer with --foxglove.token always"


def _given(path: str, headers: Mapping[str, str]) -> str:
    kind, _, bearer = headers.get("Authorization", "").partition(" ")
    if kind.lower() == "bearer":
        return bearer
    try:
        return parse_qs(urlsplit(path).query).get("token", [""])[0]
    except ValueError:
        return ""


def _is_trusted(origin: str | None) -> bool:
    if origin is None:
        return True
    try:
        site = urlsplit(origin)
        host = site.hostname or ""
    except ValueError:
        return False
    if site.scheme in {"http", "https"}:
        is_foxglove = site.scheme == "https" and (host == _FOXGLOVE or host.endswith(f".{_FOXGLOVE}"))
        return is_loopback(host) or is_foxglove
    # Desktop programs: file://, app://.
    return bool(site.scheme) and origin != _BROWSERS_SECRET

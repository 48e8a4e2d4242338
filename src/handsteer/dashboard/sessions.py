"""Tells browsers apart: each has a cookie that only this server can have made, and each page belongs to one."""

import hashlib
import hmac
import secrets
from typing import Final

_NAME_BYTES: Final = 18
_LONGEST: Final = 200


class Sessions:
    """Makes sessions, and knows those that it has made; it keeps none of them, so their number costs nothing."""

    def __init__(self) -> None:
        self._key = secrets.token_bytes(32)

    def new(self) -> str:
        """Return a new session."""
        name = secrets.token_urlsafe(_NAME_BYTES)
        return f"{name}.{self._signature(name)}"

    def knows(self, session: str | None) -> bool:
        """Return whether ``session`` was made here."""
        if session is None or len(session) > _LONGEST or not session.isascii():
            return False
        name, _, signature = session.partition(".")
        return hmac.compare_digest(signature, self._signature(name))

    def _signature(self, name: str) -> str:
        return hmac.new(self._key, name.encode(), hashlib.sha256).hexdigest()

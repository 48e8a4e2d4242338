"""What the server sends to a page: each update costs the browser the drawing of the whole page."""

import json
from typing import Any

import pytest

from tests.plugins.page.visits import NEEDS_A_BROWSER, each_when_there_is_time, visiting

pytestmark = NEEDS_A_BROWSER

_ENOUGH = 12


@pytest.mark.parametrize("path", ["/", "/settings", *each_when_there_is_time("/world", "/teach", "/study")])
def test_only_what_has_changed_is_sent(path: str) -> None:
    with visiting("Forward:2 Stop:1", camera={"fps": 10}) as visit:
        page = visit.page
        updates: dict[int, dict[str, Any]] = {}  # by number: after a lost connection, they are sent again

        def note(frame: str | bytes) -> None:
            if isinstance(frame, str) and frame.startswith("42") and (sent := json.loads(frame[2:]))[0] == "update":
                updates[sent[1].pop("_id")] = sent[1]

        page.on("websocket", lambda socket: socket.on("framereceived", note))
        page.goto(page.url.rstrip("/") + path)
        visit.wait_until(lambda: len(updates) >= _ENOUGH)
        known: dict[str, Any] = {}
        again = []
        for update in updates.values():
            for element, content in update.items():
                if content is not None and known.get(element) == content:
                    again.append(content)
                known[element] = content
        assert again == []


def test_the_settings_are_complete_when_they_are_served() -> None:
    with visiting("Stop:600", details=True, camera={"fps": 5}) as visit:
        page, calls = visit.page, []
        page.on("websocket", lambda socket: socket.on("framereceived", lambda frame: calls.append(str(frame))))
        page.goto(page.url.rstrip("/") + "/settings")
        visit.wait_until(lambda: visit.text(".timing .rate") not in ("", "-- frames/s"))
        assert sum(map(len, calls)) < 20_000  # bytes; it was 200,000 with a message for each value
        assert page.get_by_label("control.max_linear", exact=True).first.input_value() == "1"

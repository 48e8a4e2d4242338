"""The signs are calibrated on the page in a real browser, with the virtual hand."""

from pathlib import Path

import pytest

from handsteer.recognition.landmark_models import models_dir
from handsteer.recognition.profile import load_profile, profile_path
from handsteer.types import FORWARD
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS, visiting

pytestmark = NEEDS_A_BROWSER

CALIBRATION_MS = 5 * PATIENCE_MS


@pytest.fixture(autouse=True)
def profiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HANDSTEER_MODELS", str(models_dir()))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))


def test_a_sign_is_shown_saved_used_and_given_up_again() -> None:
    with visiting("Forward:3600", "/teach", locale="de-DE") as visit:
        card = visit.page.locator(".calibration")
        card.get_by_label("Name des Profils").fill("Ann")
        card.get_by_text("linke Hand").click()
        card.get_by_role("button", name="Einstellen", exact=True).click()
        lead = card.locator(".lead:visible")
        skip = card.get_by_role("button", name="Überspringen", exact=True)
        for step in range(1, 7):
            visit.wait_until(lambda step=step: f"{step} von 6" in lead.inner_text())  # type: ignore[misc]
            if "Vorwärts" not in lead.inner_text():
                skip.click()
        save = card.get_by_role("button", name="Speichern und nutzen", exact=True)
        save.wait_for(timeout=CALIBRATION_MS)
        assert "Händen" in card.locator(".recalls").inner_text()
        save.click()
        visit.wait_until(lambda: visit.graph.config.signs.profile == Path("Ann"))
        assert set(load_profile(profile_path(Path("Ann"))).views) == {FORWARD}
        assert abs(visit.graph.robot.state.odometry.x) < 0.01
        card.get_by_role("button", name="Einstellung beenden", exact=True).click()
        profile_path(Path("Bad")).write_bytes(b"not a profile")
        visit.page.reload()
        card.get_by_label("Zeichen werden gelesen").click()
        visit.page.get_by_role("option", name="Bad").click()
        problem = card.get_by_text("Bad.npz")
        problem.wait_for()
        visit.page.wait_for_timeout(1000)
        assert problem.is_visible()
        card.get_by_label("Zeichen werden gelesen").click()
        visit.page.get_by_role("option", name="wie alle sie zeigen").click()
        visit.wait_until(lambda: visit.graph.config.signs.profile is None)
        assert visit.troubles == []

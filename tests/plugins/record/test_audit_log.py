import logging
from pathlib import Path

import pytest

from handsteer.audit import AuditEvent, write_event
from handsteer.messages import AUDIT, Time
from handsteer.plugins.record.audit_log import AuditLog, audit_log_path
from handsteer.transports.in_process import InProcessTransport

EVENT = AuditEvent("seat_taken", "viewer 1 (127.0.0.1)", "took the seat,\nwhich was free")


def written(path: Path, *events: AuditEvent) -> None:
    transport = InProcessTransport()
    audit = AuditLog(transport, path)
    publisher = transport.advertise("dashboard", AUDIT)
    for event in events:
        publisher.publish(write_event(event, Time(1_795_300_000, 250_000_000)))
    audit.close()
    audit.close()


def test_a_line_has_time_code_who_and_sentence(tmp_path: Path) -> None:
    path = tmp_path / "logs" / "audit.log"
    written(path, EVENT)
    written(path, EVENT)
    line = "2026-11-21T22:26:40.250Z\tseat_taken\tviewer 1 (127.0.0.1)\ttook the seat, which was free\n"
    assert path.read_text() == 2 * line


def test_it_rotates(tmp_path: Path) -> None:
    long = AuditEvent("stands", "hand_sign_control", "x" * 1000)
    for _ in range(9):
        written(tmp_path / "audit.log", *[long] * 700)  # less than may wait for the disk
    sizes = {path.name: path.stat().st_size for path in tmp_path.iterdir()}
    assert set(sizes) == {"audit.log", *(f"audit.log.{number}" for number in range(1, 5))}
    assert max(sizes.values()) <= 1 << 20


def test_a_file_that_cannot_be_written_is_told_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "file").write_text("")
    with caplog.at_level(logging.WARNING):
        written(tmp_path / "file" / "audit.log", EVENT, EVENT, EVENT)
    (line,) = caplog.messages
    assert "the audit cannot be written to" in line


def test_which_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert audit_log_path("off") is None
    assert audit_log_path("auto", is_simulated_time=True) is None
    auto = audit_log_path("auto")
    assert auto is not None
    assert (auto.name, "handsteer" in str(auto)) == ("audit.log", True)
    assert audit_log_path("my.log", is_simulated_time=True) == Path("my.log")

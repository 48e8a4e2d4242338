from hypothesis import given
from hypothesis import strategies as st

from handsteer.audit import ERROR, AuditEvent, read_event, setting_changes, write_event
from handsteer.config import Config, load
from handsteer.errors import without_passwords
from handsteer.messages import Log, Time

STAMP = Time(12, 500_000_000)


def test_an_event_comes_back_from_its_message() -> None:
    event = AuditEvent("disarmed", "/r1/hand_sign_control", "disarmed (no robot listens)", "no robot listens", ERROR)
    message = write_event(event, STAMP)
    assert read_event(message) == event
    assert (message.stamp, message.level, message.function, message.name) == (STAMP, 40, "disarmed", event.who)


def test_a_log_message_of_others_is_no_event() -> None:
    assert read_event(Log(STAMP, 20, "nav2", "goal reached", "nav.cpp", "on_goal", 7)) is None


@given(st.text(), st.text(), st.text())
def test_texts_of_any_length_and_kind_are_taken(who: str, sentence: str, about: str) -> None:
    event = read_event(Log(STAMP, 20, who, sentence * 50, about, "stands", 0))
    assert event is not None
    assert len(event.sentence) <= 1000


def test_each_changed_parameter_is_told_with_both_values() -> None:
    new = load(None, None, {"control": {"max_linear": 0.3, "actions": {"Peace": "turbo"}}, "signs": {"model": "a.npz"}})
    told = [event.sentence for event in setting_changes(Config(), new, "viewer 1")]
    assert told == [
        "changed signs.model from none to a.npz",
        "changed control.max_linear from 1 to 0.3",
        "changed control.actions.Peace from none to turbo",
    ]
    assert {event.about for event in setting_changes(Config(), new, "viewer 1")} == {
        "signs.model",
        "control.max_linear",
        "control.actions.Peace",
    }
    assert list(setting_changes(new, new, "viewer 1")) == []


def test_passwords_are_left_out() -> None:
    new = load(None, None, {"camera": {"source": "rtsp://me:secret@10.0.0.2/live"}})
    (event,) = setting_changes(Config(), new, "viewer 1")
    assert event.sentence == "changed camera.source from auto to rtsp://10.0.0.2/live"
    assert without_passwords("http://a/b@c") == "http://a/b@c"
    assert without_passwords("rtsp://admin:P@ss@10.0.0.5/1") == "rtsp://10.0.0.5/1"

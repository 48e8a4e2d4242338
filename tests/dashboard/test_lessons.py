"""Teaching on the nodes of a graph, without a page: real training, hands that are made."""

import itertools
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from handsteer.clock import RealClock
from handsteer.config import Config, TeachConfig
from handsteer.dashboard.lesson import LessonState
from handsteer.dashboard.lesson_node import thumbnail
from handsteer.dashboard.lessons import Lessons, with_sign
from handsteer.errors import ConfigError, DatasetError, ModelCorrupt
from handsteer.images import image_message
from handsteer.messages import IMAGE_RAW, Header
from handsteer.recognition.custom_signs import load_custom_model, save_custom_model
from handsteer.recognition.hand import Hand, RecordedLandmarker
from handsteer.recognition.recognizer import open_classifier
from handsteer.training.custom.dataset import Dataset, load_dataset, save_dataset
from handsteer.transports.in_process import InProcessTransport
from tests.recognition.hands import show_sign
from tests.recognition.models import model
from tests.training.custom.takes import shaken, takes

PATIENCE_S = 180.0
IMAGE = np.full((48, 64, 3), 90, np.uint8)


class School:
    """Teaching, and frames that come ten times as fast as the lesson's clock says."""

    def __init__(self, folder: Path, hands: list[Hand]) -> None:
        self.folder = folder
        self.clock = RealClock()
        self.transport = InProcessTransport()
        plan = TeachConfig(
            dataset=folder / "signs.npz", model=folder / "mine.npz", takes=3, take_time=1.0, countdown=0.5
        )
        self.config = self.initial = Config(teach=plan)
        self.lessons = Lessons(
            self.transport,
            self.clock,
            lambda: (RecordedLandmarker([[hand] for hand in hands] * 1000), open_classifier(Config().signs)),
            config=lambda: self.config,
            reconfigure=self._take,
        )
        self.refuses = False
        self._ended = threading.Event()
        self._camera = threading.Thread(target=self._publish)
        self._camera.start()

    def _take(self, config: Config) -> None:
        if self.refuses:
            raise ConfigError("signs.model: refused")
        self.config = config

    def _publish(self) -> None:
        images = self.transport.advertise("my_camera", IMAGE_RAW)
        for number in itertools.count():
            if self._ended.wait(0.005):
                return
            header = Header(self.clock.stamp(self.clock.now()), "camera")
            images.publish(image_message(IMAGE, header), number * 0.05)

    @property
    def files(self) -> set[str]:
        return {path.name for path in self.folder.iterdir()}

    def wait_until(self, condition: Callable[[], bool]) -> None:
        for _ in range(round(PATIENCE_S / 0.02)):
            lesson = self.lessons.node("ann")
            if lesson is not None:
                lesson.attend()
            if condition():
                return
            self._ended.wait(0.02)
        pytest.fail(f"waited in vain; the lesson is at {self.lessons.node('ann')}")

    def close(self) -> None:
        self.lessons.close()
        self._ended.set()
        self._camera.join()


@pytest.fixture
def school(tmp_path: Path) -> Iterator[School]:
    random = np.random.default_rng(4)
    school = School(tmp_path, [shaken("Peace", random) for _ in range(60)])
    yield school
    school.close()


def seen_by_ann(lessons: Lessons) -> LessonState:
    node = lessons.node("ann")
    assert node is not None
    return node.state


def collected(school: School) -> int:
    node = school.lessons.node("ann")
    return len(node.state.takes) if node else -1


@pytest.mark.slow
def test_a_sign_is_collected_learnt_kept_and_taken_by_the_graph(school: School) -> None:
    save_dataset(Dataset(tuple(takes("Call", count=2))), school.folder / "signs.npz")
    save_custom_model(model(), school.folder / "mine.npz")
    lessons = school.lessons
    lessons.begin("ann", " peace ", "Ann")
    assert lessons.lost() == ("Hi", "Ho")
    assert lessons.save("ann", "turbo") is None, "nothing is learnt yet"
    lesson = lessons.node("ann")
    assert lesson is not None
    assert lessons.node("ben") is None
    lesson.record()
    school.wait_until(lambda: collected(school) == 3)
    lesson.delete(1)
    assert school.files == {"signs.npz", "mine.npz"}
    assert seen_by_ann(lessons).takes[0].picture.startswith(b"\xff\xd8")

    lesson.train()
    school.wait_until(lambda: seen_by_ann(lessons).progress > 0)
    school.wait_until(lambda: seen_by_ann(lessons).step == "try")
    school.wait_until(lambda: (seen := seen_by_ann(lessons).seen) is not None and seen.sign == "peace")
    report = seen_by_ann(lessons).report
    assert report is not None
    assert report.confusion.labels == ("Call", "peace", "NONE")

    with pytest.raises(ConfigError, match="'fly' is no action: choose one of forward"):
        lessons.save("ann", "fly")
    assert lessons.save("ben", "turbo") is None
    school.refuses = True
    with pytest.raises(ConfigError, match="refused"):
        lessons.save("ann", "turbo")
    school.refuses = False
    learnt = lessons.save("ann", "turbo")
    assert learnt is not None
    assert school.config.control.actions == {"peace": "turbo"}
    assert school.config.signs.model == school.folder / "mine.npz"
    assert load_custom_model(school.folder / "mine.npz").labels == ("Call", "peace")
    saved = load_dataset(school.folder / "signs.npz").takes
    assert [(take.label, take.person) for take in saved] == [("Call", "me")] * 2 + [("peace", "Ann")] * 2
    assert (lessons.label, lessons.node("ann")) == (None, None)
    assert "actions:\n    peace: turbo" in learnt.yaml


def test_what_is_discarded_leaves_nothing(school: School) -> None:
    school.lessons.begin("ann", "Peace")
    lesson = school.lessons.node("ann")
    assert lesson is not None
    lesson.record()
    school.wait_until(lambda: collected(school) == 2)
    school.lessons.end("ben")
    label = school.lessons.label
    assert label == "Peace", "another one's lesson goes on"
    school.lessons.end("ann")
    assert (school.lessons.label, school.files, school.config) == (None, set(), school.initial)


def test_a_training_is_cancelled_with_the_lesson_or_before(school: School) -> None:
    school.lessons.begin("ann", "Peace")
    lesson = school.lessons.node("ann")
    assert lesson is not None
    lesson.record()
    school.wait_until(lambda: collected(school) == 3)
    lesson.train()
    lesson.go_back()
    assert (lesson.state.step, collected(school)) == ("collect", 3)
    lesson.train()
    school.lessons.end("ann")
    school.wait_until(lambda: not any(thread.name == "lesson_training" for thread in threading.enumerate()))
    assert school.files == set()


def test_takes_are_collected_only_while_the_page_is_there(school: School) -> None:
    school.lessons.begin("ann", "Peace")
    lesson = school.lessons.node("ann")
    assert lesson is not None
    lesson.record()
    waiting = threading.Event()
    for _ in range(200):
        if not lesson.state.recording:
            break
        waiting.wait(0.05)
    assert not lesson.state.recording
    assert school.lessons.label == "Peace", "the page may come back"


@pytest.mark.parametrize(
    ("name", "person", "problem"),
    [
        ("", "", "'' is no name for a sign"),
        ("turn left", "", "Turn Left is known already: give the new sign a name of its own"),
        ("x" * 41, "", "is no name for a sign"),
        ("Hi\x07", "", "is no name for a sign"),
        ("Hi", "y" * 41, "is no name of a person"),
    ],
)
def test_what_is_no_name_is_refused(school: School, name: str, person: str, problem: str) -> None:
    with pytest.raises(DatasetError, match=problem):
        school.lessons.begin("ann", name, person)
    assert school.lessons.label is None


def test_files_that_are_something_else_are_not_written_over(school: School) -> None:
    (school.folder / "mine.npz").write_bytes(b"my thesis")
    with pytest.raises(ModelCorrupt, match="not a model of taught signs"):
        school.lessons.begin("ann", "Peace")
    (school.folder / "signs.npz").write_bytes(b"my thesis")
    with pytest.raises(DatasetError, match="not a dataset of signs"):
        school.lessons.begin("ann", "Peace")


def test_a_sign_that_has_an_action_by_another_spelling_gets_another() -> None:
    config = Config.model_validate({"control": {"actions": {"thumb-up": "go"}, "max_linear": 0.5}})
    changed = with_sign(config, Path("mine.npz"), "Thumb up", "turbo")
    assert changed.control.actions == {"thumb-up": "turbo"}
    assert changed.control.max_linear == 0.5
    assert with_sign(config, Path("mine.npz"), "NONE", None).control == config.control


def test_a_picture_of_a_take_is_small() -> None:
    picture = thumbnail(np.zeros((480, 640, 3), np.uint8), show_sign("Stop"))
    assert len(picture) < 10_000

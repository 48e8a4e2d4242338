"""Teaching on the nodes of a graph, without a page: real training, hands that are made."""

import itertools
import threading
from collections.abc import Callable, Iterator
from math import inf
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from handsteer.clock import RealClock
from handsteer.config import Config, TeachConfig
from handsteer.errors import ConfigError, DatasetError, ModelCorrupt
from handsteer.graph import Graph
from handsteer.images import image_message
from handsteer.messages import IMAGE_RAW, Header
from handsteer.plugins.page.lesson_node import LessonNode
from handsteer.plugins.page.lesson_state import SignClass
from handsteer.plugins.page.lessons import KEPT, KEPT_TAKES, Lessons, with_signs
from handsteer.plugins.page.sign_pictures import taught_drawings
from handsteer.plugins.teach.dataset import Dataset, load_dataset, save_dataset
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.teach.exchange import load_shared, save_shared
from handsteer.recognition.custom_signs import load_custom_model, save_custom_model
from handsteer.recognition.hand import Hand
from handsteer.recognition.recognizer import open_classifier
from handsteer.transports.in_process import InProcessTransport
from handsteer.types import NONE
from tests.plugins.teach.takes import shaken, takes
from tests.recognition.hands import RecordedLandmarker
from tests.recognition.models import model

PATIENCE_S = 180.0
IMAGE = np.full((48, 64, 3), 90, np.uint8)
IMAGE[:, 32:] = 200
"""Its left half is darker."""


class SidedLandmarker(RecordedLandmarker):
    """Finds one hand in :data:`IMAGE`, and its mirror image in the mirrored one."""

    def __init__(self, hand: Hand) -> None:
        super().__init__([])
        self.hand = hand
        self.resets = 0

    def detect(self, image: np.ndarray, *, search: bool = True, dt_s: float = inf) -> list[Hand]:
        return [View(flip=bool(image[0, 0, 0] > image[0, -1, 0])).hand(self.hand)]

    def reset(self) -> None:
        self.resets += 1


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
            cast(Graph, self),
            lambda: (RecordedLandmarker([[hand] for hand in hands] * 1000), open_classifier(Config().signs)),
        )
        self.refuses = self.camera_is_lost = False
        self._ended = threading.Event()
        self._camera = threading.Thread(target=self._publish)
        self._camera.start()

    def reconfigure(self, config: Config) -> None:
        if self.refuses:
            raise ConfigError("signs.model: refused")
        self.config = config

    def _publish(self) -> None:
        images = self.transport.advertise("my_camera", IMAGE_RAW)
        for number in itertools.count():
            if self._ended.wait(0.005):
                return
            if self.camera_is_lost:
                continue
            header = Header(self.clock.stamp(self.clock.now()), "camera")
            images.publish(image_message(IMAGE, header), number * 0.05)

    @property
    def files(self) -> set[str]:
        return {path.name for path in self.folder.iterdir()}

    def wait_until(self, condition: Callable[[], bool], patience_s: float = PATIENCE_S) -> None:
        for _ in range(round(patience_s / 0.02)):
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


def ann(school: School) -> LessonNode:
    node = school.lessons.node("ann")
    assert node is not None
    return node


def begin(school: School, name: str = "peace", person: str = "", *, restore: bool = False) -> LessonNode:
    """Begin a lesson of Ann's with one more sign."""
    school.lessons.begin("ann", person, restore=restore)
    node = ann(school)
    node.do(lambda lesson: lesson.add_class(name))
    return node


def own(school: School, label: str = "peace") -> SignClass:
    return next(one for one in ann(school).state.classes if one.label == label)


def collected(school: School, label: str = "peace") -> int:
    return len(own(school, label).takes)


def record(school: School) -> None:
    key = own(school).key
    ann(school).do(lambda lesson: lesson.record(key))
    school.wait_until(lambda: collected(school) == 3)


@pytest.mark.slow
def test_a_sign_is_collected_learnt_kept_and_taken_by_the_graph(school: School) -> None:
    save_dataset(Dataset(tuple(takes("Call", count=2))), school.folder / "signs.npz")
    save_custom_model(model(), school.folder / "mine.npz")
    lessons = school.lessons
    lesson = begin(school, person="Ann")
    assert lesson.state.lost == ("Hi", "Ho")
    assert lessons.node("ben") is None
    record(school)
    first = own(school).takes[0].number
    lesson.do(lambda of: of.delete_take(first))
    before = (school.folder / "signs.npz").read_bytes()

    lesson.train()
    school.wait_until(lambda: (lesson.state.progress or 0) > 0)
    school.wait_until(lambda: lesson.state.is_fresh)
    school.wait_until(lambda: (seen := lesson.state.seen) is not None and seen.confidences.get("peace", 0) > 0.8)
    report = lesson.state.report
    assert report is not None
    assert report.confusion.labels == ("Call", "peace", "NONE")

    with pytest.raises(ConfigError, match="'fly' is not a valid action: choose one of forward"):
        lessons.save("ann", {"peace": "fly"})
    with pytest.raises(ConfigError, match="choose first what the robot does at Call"):
        lessons.save("ann", {"peace": "turbo"})
    lessons.save("ben", {"peace": "turbo"})
    school.refuses = True
    with pytest.raises(ConfigError, match="refused"):
        lessons.save("ann", {"peace": "turbo", "Call": "go"})
    assert (school.folder / "signs.npz").read_bytes() == before
    school.refuses = False
    lessons.save("ann", {"peace": "turbo", "Call": "go"})
    assert (lesson.state.message, lesson.state.is_changed) == (KEPT, False)
    assert school.config.control.actions == {"peace": "turbo"}, "what is so by default is not written"
    assert school.config.signs.model == school.folder / "mine.npz"
    assert load_custom_model(school.folder / "mine.npz").labels == ("Call", "peace")
    saved = load_dataset(school.folder / "signs.npz").takes
    assert [(take.label, take.person) for take in saved] == [("Call", "me")] * 2 + [("peace", "Ann")] * 2
    assert set(taught_drawings(school.config.signs)) == {"Call", "peace"}

    shared = school.folder / "shared.npz"
    assert lessons.share("ann", shared)
    assert not lessons.share("ben", shared)
    dataset, shared_model = load_shared(shared)
    assert (len(dataset.takes), shared_model is not None) == (4, True)
    assert lessons.chosen_action("Call", lesson.state) == "go", "it is in use"
    lessons.save("ann", {"peace": "stop"})
    assert school.config.control.actions == {"peace": "stop"}, "an action changes without another training"
    lessons.end("ann")
    assert (lessons.is_running, lessons.draft) == (False, None)


def test_the_takes_alone_are_kept_too(school: School) -> None:
    begin(school)
    record(school)
    school.lessons.save("ann", {"peace": "turbo"})
    assert ann(school).state.message == KEPT_TAKES
    assert (school.files, school.config) == ({"signs.npz"}, school.initial)
    (school.folder / "signs.npz").unlink()
    with pytest.raises(DatasetError, match="was changed by another program"):
        school.lessons.save("ann", {})


def test_what_is_not_kept_leaves_no_file_and_can_be_continued(school: School) -> None:
    begin(school)
    record(school)
    school.lessons.end("ben")
    assert school.lessons.is_running, "another one's lesson goes on"
    school.lessons.end("ann")
    assert (school.lessons.is_running, school.files, school.config) == (False, set(), school.initial)
    draft = school.lessons.draft
    assert draft is not None
    school.lessons.begin("ann", restore=True)
    assert ann(school).state.classes == draft.classes
    assert collected(school) == 3
    school.lessons.end("ann")
    school.lessons.begin("ann")
    assert [one.label for one in ann(school).state.classes] == [NONE]


@pytest.fixture
def taught(school: School) -> School:
    """Where Hi and Ho are taught already: Hi stops."""
    save_custom_model(model(), school.folder / "mine.npz")
    save_dataset(Dataset((*takes("Hi", "Peace", count=1), *takes("Ho", "OK", count=1))), school.folder / "signs.npz")
    actions = school.initial.control.model_copy(update={"actions": {"Hi": "stop", "Ho": "turbo"}})
    signs = school.initial.signs.model_copy(update={"model": school.folder / "mine.npz"})
    school.config = school.initial.model_copy(update={"control": actions, "signs": signs})
    school.lessons.begin("ann")
    return school


def key_of(node: LessonNode, label: str) -> int:
    return next(one.key for one in node.state.classes if one.label == label)


def delete(node: LessonNode, label: str) -> None:
    key = key_of(node, label)
    node.do(lambda lesson: lesson.delete_class(key))


def test_a_sign_that_is_renamed_or_deleted_keeps_its_action_while_the_model_knows_it(taught: School) -> None:
    node = ann(taught)
    node.do(lambda lesson: lesson.rename(key_of(node, "Hi"), "Halt"))
    delete(node, "Ho")
    taught.lessons.save("ann", {"Halt": "stop"})
    assert node.state.message == "The takes are kept. Until you train, Hi counts as before."
    assert taught.config.control.actions == {"Hi": "stop", "Ho": "turbo", "Halt": "stop"}
    assert load_custom_model(taught.folder / "mine.npz").labels == ("Hi", "Ho")


def test_after_the_last_sign_is_deleted_the_model_is_gone_too(taught: School) -> None:
    node = ann(taught)
    delete(node, "Hi")
    delete(node, "Ho")
    taught.lessons.save("ann", {})
    assert (taught.config.signs.model, taught.config.control.actions) == (None, {})
    assert taught.files == {"signs.npz"}
    assert node.state.model is None
    assert not node.state.is_changed


def test_a_model_of_signs_that_were_never_among_the_takes_is_not_deleted(school: School) -> None:
    save_custom_model(model(), school.folder / "mine.npz")
    school.lessons.begin("ann")
    school.lessons.save("ann", {})
    assert "mine.npz" in school.files
    assert ann(school).state.model is not None


def test_what_another_program_has_added_is_not_lost_when_a_lesson_is_continued(school: School) -> None:
    path = school.folder / "signs.npz"
    save_dataset(Dataset(tuple(takes("Hi", "Peace", count=2))), path)
    begin(school, "Wave")
    school.lessons.end("ann")
    save_dataset(Dataset((*takes("Hi", "Peace", count=2), *takes("Ho", "OK", count=3))), path)
    school.lessons.begin("ann", restore=True)
    assert [one.label for one in ann(school).state.classes] == ["Hi", "Wave", "Ho", NONE]
    school.lessons.save("ann", {})
    kept = load_dataset(path)
    assert {label: len(kept.of(label)) for label in kept.labels} == {"Hi": 2, "Ho": 3}


def test_a_file_is_added_or_refused_in_one_sentence(school: School) -> None:
    school.lessons.begin("ann")
    path = school.folder / "upload.npz"
    school.lessons.take_file("ben", path)
    for hostile in (b"my thesis", b""):
        path.write_bytes(hostile)
        school.lessons.take_file("ann", path)
        message = ann(school).state.message
        assert message.startswith("The file: not a file of taught signs")
        assert str(school.folder) not in message
        assert "\n" not in message
    save_shared(path, Dataset(tuple(takes("Hi", "Peace", count=2))), model())
    school.lessons.take_file("ann", path)
    assert collected(school, "Hi") == 2
    assert ann(school).state.is_fresh


def test_a_training_is_cancelled_with_the_lesson_or_before(school: School) -> None:
    lesson = begin(school)
    record(school)
    lesson.train()
    lesson.cancel()
    assert (lesson.state.is_training, collected(school)) == (False, 3)
    lesson.train()
    school.lessons.end("ann")
    school.wait_until(lambda: not any(thread.name == "lesson_training" for thread in threading.enumerate()))
    assert school.files == set()


def test_takes_are_recorded_only_while_the_page_is_there(school: School) -> None:
    lesson = begin(school)
    key = own(school).key
    lesson.do(lambda of: of.record(key))
    waiting = threading.Event()
    for _ in range(200):
        if lesson.state.recorded is None:
            break
        waiting.wait(0.05)
    assert lesson.state.recorded is None
    assert school.lessons.is_running, "the page may come back"


def swap_sides(school: School, on: bool) -> None:
    signs = school.config.signs.model_copy(update={"swap_sides": on})
    school.config = school.config.model_copy(update={"signs": signs})


@pytest.fixture
def sided(school: School) -> SidedLandmarker:
    """Used by the lessons of the school from here on."""
    landmarker = SidedLandmarker(shaken("Peace", np.random.default_rng(4)))
    school.lessons = Lessons(cast(Graph, school), lambda: (landmarker, open_classifier(Config().signs)))
    return landmarker


@pytest.mark.parametrize("swapped", [False, True])
def test_a_lesson_sees_the_hands_that_recognition_sees(school: School, sided: SidedLandmarker, swapped: bool) -> None:
    swap_sides(school, swapped)
    begin(school)
    record(school)
    seen = View(flip=swapped).hand(sided.hand)
    for each in own(school).takes:
        assert {hand.handedness for hand in each.take.hands} == {seen.handedness}
        assert all(np.allclose(hand.pixels, seen.pixels) for hand in each.take.hands)


def test_no_take_has_hands_from_before_and_after_the_sides_are_swapped(school: School, sided: SidedLandmarker) -> None:
    lesson = begin(school)
    key = own(school).key
    lesson.do(lambda of: of.record(key, hold=True))
    school.wait_until(lambda: lesson.state.status.hands > 2)
    assert sided.resets == 0
    swap_sides(school, True)
    school.wait_until(lambda: lesson.state.recorded is None)
    assert (collected(school), sided.resets) == (0, 1)
    record(school)
    seen = View(flip=True).hand(sided.hand)
    hands = [hand for each in own(school).takes for hand in each.take.hands]
    assert all(np.allclose(hand.pixels, seen.pixels) for hand in hands)


def test_a_take_ends_with_the_picture_and_does_not_go_on_with_the_next_one(school: School) -> None:
    lesson = begin(school)
    key = own(school).key
    lesson.do(lambda of: of.record(key, hold=True))
    school.wait_until(lambda: lesson.state.status.hands > 2)
    school.camera_is_lost = True
    school.wait_until(lambda: lesson.state.hint == "No picture comes from the camera.")
    school.wait_until(lambda: lesson.state.recorded is None, patience_s=20.0)
    school.camera_is_lost = False
    school.wait_until(lambda: lesson.state.seen is not None)
    assert (lesson.state.recorded, collected(school)) == (None, 0)


def test_what_is_no_name_of_a_person_is_refused(school: School) -> None:
    with pytest.raises(DatasetError, match="is not a valid name of a person"):
        school.lessons.begin("ann", "y" * 41)
    assert not school.lessons.is_running


def test_files_that_are_something_else_are_not_written_over(school: School) -> None:
    (school.folder / "mine.npz").write_bytes(b"my thesis")
    with pytest.raises(ModelCorrupt, match="not a model of taught signs"):
        school.lessons.begin("ann")
    (school.folder / "signs.npz").write_bytes(b"my thesis")
    with pytest.raises(DatasetError, match="not a dataset of signs"):
        school.lessons.begin("ann")


def test_a_sign_that_has_an_action_by_another_spelling_gets_another() -> None:
    config = Config.model_validate({"control": {"actions": {"thumb-up": "go", "Old": "stop"}, "max_linear": 0.5}})
    changed = with_signs(config, Path("mine.npz"), {"Thumb up": "turbo", "Call": "go"}, ["old"])
    assert changed.control.actions == {"thumb-up": "turbo"}
    assert changed.control.max_linear == 0.5
    assert with_signs(config, Path("mine.npz"), {}).control == config.control

"""Every reader of what comes from anywhere, over mutants of good files and of those that once did harm.

``make fuzz`` gives each a hundred times as many.
"""

import gzip
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handsteer.cameras.browser import BrowserCamera
from handsteer.cameras.files import read_photo
from handsteer.clock import SteppedClock
from handsteer.config import Config, ControlConfig, load
from handsteer.errors import FrameError, HandsteerError, TransportError
from handsteer.images import bgr_image, jpeg_picture
from handsteer.messages import (
    CMD_VEL,
    DIAGNOSTICS,
    HAND_SIGN,
    IMAGE_COMPRESSED,
    IMAGE_RAW,
    JOINT_STATES,
    ODOM,
    WORLD_MARKERS,
    CompressedImage,
    Header,
    Image,
    String,
    Time,
    Topic,
    type_name,
)
from handsteer.plugins.page.editing import edit
from handsteer.plugins.page.elements import read_words
from handsteer.plugins.page.settings_fields import FIELDS
from handsteer.plugins.page.steering_input import SteeringInput, read_deflection, read_number
from handsteer.plugins.page.urdf import joints, visuals
from handsteer.plugins.page.world_editor import read_file
from handsteer.plugins.ros2.arguments import parse_arguments
from handsteer.plugins.study.plan import read_plan
from handsteer.plugins.study.session import Session
from handsteer.plugins.teach.dataset import load_dataset
from handsteer.plugins.teach.evaluation.labels import read_photo_labels
from handsteer.plugins.teach.exchange import read_class_names, read_keypoints
from handsteer.recognition.custom_signs import load_custom_model, save_custom_model
from handsteer.recognition.shipped_signs import DEFAULT_MODEL, load_model
from handsteer.robots.description import robot_description
from handsteer.robots.world import load_world, parse_world
from handsteer.transports.encoding import decode, encode
from handsteer.types import SIGNS, Velocity
from tests.fuzz import corpus
from tests.fuzz.mutants import CASES, hold, mutants
from tests.plugins.study.plans import a_task
from tests.recognition.models import model

HEADER = Header(stamp=Time(1, 2), frame_id="camera")
WORLDS = [
    (Path(load_world.__code__.co_filename).parent / "worlds" / f"{name}.yaml") for name in ("obstacles", "slalom")
]
ODD_YAML = [text.encode() for text in corpus.YAMLS]
CONFIG = b"""camera: {source: "0", width: 640, at_end: hold}
signs: {min_confidence: 0.7, model: a.npz}
control:
  ramp: per_second
  max_linear: 0.5
  actions: {Peace: turbo, Hi: stop}
robot: {kind: dds, preset: turtlebot4}
dashboard: {host: 0.0.0.0, port: 8080, token: always}
"""


def in_file(path: Path, read: Callable[[Path], object]) -> Callable[[bytes], object]:
    """Return what reads bytes by way of a file."""

    def read_bytes(data: bytes) -> object:
        path.write_bytes(data)
        return read(path)

    return read_bytes


def text_of(data: bytes) -> str:
    return data.decode("utf-8", "surrogateescape")


def test_worlds() -> None:
    good = [path.read_bytes() for path in WORLDS]
    assert hold(lambda data: parse_world(text_of(data), "w.yaml"), mutants([*good, *ODD_YAML])) > CASES / 10


def test_world_files_that_a_page_sends() -> None:
    def read(data: bytes) -> object:
        sent = _json(data)
        name, text = read_file({"name": "w", "text": sent} if isinstance(sent, str) else sent)
        return parse_world(text, name)

    hold(read, mutants([b'{"name": "w.yaml", "text": "floor: {}"}', b'["a"]', *ODD_YAML]))


def test_changes_of_things_that_a_page_asks_for() -> None:
    world = load_world("obstacles")
    name = world.obstacles[0].name
    hold(lambda data: edit(world, name, _fields(data)), mutants(_JSONS))


def _fields(data: bytes) -> dict[str, object]:
    return {"position": _json(data), "colour": _json(data[::-1])}


_JSONS = [
    b"[1, 2]",
    b'{"x": 0.5, "y": -1, "at": 1e3}',
    b"1e400",
    b"9" * 400,
    b"NaN",
    b'"#c04020"',
    b"null",
    b"[[[[1]]]]",
]


def _json(data: bytes) -> object:
    try:
        return json.loads(data)
    except (ValueError, RecursionError):
        return text_of(data)


def test_what_a_page_says_of_pad_sliders_and_camera() -> None:
    def read(data: bytes) -> None:
        sent = _json(data)
        x, y = read_deflection(sent)
        assert abs(x) <= 1
        assert abs(y) <= 1
        assert 0 <= read_number(sent, 0.0, 1.0, 0.5) <= 1
        assert len(read_words(sent)) <= 200
        at = sent.get("at") if isinstance(sent, dict) else sent
        steering = SteeringInput()
        steering.slide(Velocity(0.1, 0.0), 0.9)
        steering.keep_sliders(at, at, 1.0)

    hold(read, mutants([*_JSONS, b'{"words": "no camera"}']))


def test_configurations(tmp_path: Path) -> None:
    assert hold(in_file(tmp_path / "c.yaml", load), mutants([CONFIG, *ODD_YAML])) > CASES / 10


def test_plans_and_results_of_studies(tmp_path: Path) -> None:
    plan = (Path(__file__).parents[2] / "examples" / "study.yaml").read_bytes()
    assert hold(in_file(tmp_path / "p.yaml", read_plan), mutants([plan, *ODD_YAML])) > CASES / 10
    session = Session(a_task(tmp_path))
    session.agree()
    forms = (tmp_path / "forms.csv").read_bytes()
    hold(in_file(tmp_path / "forms.csv", lambda path: Session(a_task(path.parent))), mutants([forms]))


def test_fields_of_the_settings() -> None:
    fields = list(FIELDS.values())
    config = Config()
    cases = enumerate(mutants([b"0.5", b"true", b"Peace: turbo, Hi: stop", b"r1, r2", b"rtsp://me:pw@h/", *ODD_YAML]))

    def read(data: bytes) -> object:
        number = int.from_bytes(data[:2].ljust(2), "little")
        field = fields[number % len(fields)]
        return field.parse(text_of(data), field.value_in(config))

    hold(read, (data for _, data in cases))


def test_arguments_of_ros() -> None:
    good = (
        b"--ros-args -r image_raw:=camera/image -r __ns:=/r1 -p fps:=10",
        b"--ros-args -p a.b:=[1, 2] --log-level debug -r n:a:=b",
        b"--ros-args -p n:x:={a: 1} -e x --",
        b"camera/image:=/b --params-file /none",
    )
    odd = [b"--ros-args -p a:=" + text for text in ODD_YAML]
    assert hold(lambda data: parse_arguments(text_of(data).split(" ")), mutants([*good, *odd])) > CASES / 10


def test_parameter_files_of_ros(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    good = b"/**: {ros__parameters: {fps: 10, a: {b: [1]}}}\nn:\n  ros__parameters: {x: 1}\n"
    read = in_file(path, lambda path: parse_arguments(["--ros-args", "--params-file", str(path)]))
    assert hold(read, mutants([good, *ODD_YAML])) > CASES / 10


def test_pictures() -> None:
    files = [corpus.jpeg(), corpus.png(20, 20), corpus.png(10000, 10000), corpus.resized_jpeg(9999, 9999)]

    def read(data: bytes) -> None:
        picture = jpeg_picture(CompressedImage(HEADER, "jpeg", np.frombuffer(data, np.uint8)))
        assert picture.ndim == 3
        assert picture.dtype == np.uint8

    assert hold(read, mutants([*files, corpus.two_faced_jpeg()])) > CASES / 10


def test_photos(tmp_path: Path) -> None:
    hold(in_file(tmp_path / "p.png", read_photo), mutants([corpus.jpeg(), corpus.png(9, 9), corpus.png(20000, 20000)]))


def test_frames_of_a_browser() -> None:
    def read(data: bytes) -> None:
        camera = BrowserCamera(SteppedClock())
        camera.offer(data)
        camera.read(0.0)

    hold(read, mutants([struct.pack("<d", 1e3) + corpus.jpeg(), struct.pack("<d", 0) + corpus.two_faced_jpeg()]))


def test_raw_images() -> None:
    encodings = ("bgr8", "rgb8", "mono8", "bgra8", "yuv422", "16UC1", "\x1b[2J" * 99)

    def read(data: bytes) -> None:
        height, width, step, kind = struct.unpack("<iiiB", data[:13].ljust(13, b"\0"))
        content = np.frombuffer(data[13:], np.uint8)
        picture = bgr_image(Image(HEADER, height, width, encodings[kind % len(encodings)], 0, step, content))
        assert picture.shape == (height, width, 3)

    good = [struct.pack("<iiiB", 4, 4, 4 * size, kind) + bytes(16 * size) for kind, size in ((0, 3), (2, 1), (4, 2))]
    assert hold(read, mutants([*good, struct.pack("<iiiB", 2**31 - 1, 2**31 - 1, 1, 2)])) > CASES / 10


def test_datasets(tmp_path: Path) -> None:
    files = [
        corpus.dataset(),
        corpus.dataset(3, value=1e38),
        corpus.dataset(points=corpus.npy((40_000_000, 21, 3))),
        corpus.dataset(takes=corpus.saved("[" * 9999)),
    ]
    assert hold(in_file(tmp_path / "d.npz", load_dataset), mutants(files)) > CASES / 10


def test_arrays_of_datasets(tmp_path: Path) -> None:
    """Mutants of a packed file are mostly torn; here what is within changes, and the file is whole."""
    names = ("takes", "take", "time_s", "points", "world", "handedness", "presence", "image_size", "format")
    arrays = [corpus.saved(np.ones(shape, kind)) for shape in ((), (1,), (1, 2), (1, 21, 3)) for kind in "fdi?UF"]
    read = in_file(tmp_path / "d.npz", load_dataset)

    def read_array(data: bytes) -> object:
        name = names[sum(data) % len(names)]
        arrays: dict[str, Any] = {name: data}
        return read(corpus.dataset(**arrays))

    hold(read_array, mutants([*arrays, corpus.saved('[{"label": "Hi"}]'), corpus.npy((10**9,), "<f8")]))


def test_models_of_signs(tmp_path: Path) -> None:
    save_custom_model(model(), tmp_path / "t.npz")
    taught = (tmp_path / "t.npz").read_bytes()
    hold(in_file(tmp_path / "t.npz", load_custom_model), mutants([taught, corpus.dataset()]))
    few = max(100, CASES // 10)  # the shipped one is large
    hold(in_file(tmp_path / "m.npz", load_model), mutants([DEFAULT_MODEL.read_bytes(), taught], few))


def test_rows_of_landmarks(tmp_path: Path) -> None:
    row = b"0," + b",".join(b"%.3f" % (number / 50) for number in range(42)) + b"\n"
    good = [row * 3, row.replace(b"0.1", b"1e38"), row.replace(b"0.2", b"nan"), b"0," + b"9" * 9999]
    labels = {"0": "Hi"}
    hold(in_file(tmp_path / "k.csv", lambda path: read_keypoints(path, labels, "me")), mutants(good))
    packed = [gzip.compress(each) for each in good]
    hold(in_file(tmp_path / "k.csv.gz", lambda path: read_keypoints(path, labels, "me")), mutants(packed))
    hold(in_file(tmp_path / "names.csv", read_class_names), mutants([b"Hi\nYou\n", b"\n", b"x" * 99999]))


def test_labels_of_photos(tmp_path: Path) -> None:
    (tmp_path / "a.jpg").write_bytes(corpus.jpeg())
    good = [b"path,sign\na.jpg,Stop\n", b"path,sign,kind\na.jpg,,x\n", b'path,sign\n"a.jpg,Stop\n']
    index = tmp_path / "index.csv"
    hold(in_file(index, lambda path: read_photo_labels(path.parent, SIGNS)), mutants(good))


def test_descriptions_of_robots() -> None:
    laughs = '<!DOCTYPE r [<!ENTITY a "ha">' + "".join(
        f'<!ENTITY {chr(98 + n)} "{f"&{chr(97 + n)};" * 10}">' for n in range(9)
    )
    files = [robot_description().encode(), f"{laughs}]><robot>&j;</robot>".encode(), b"<robot>" * 9999]
    assert hold(lambda data: (visuals(text_of(data)), joints(text_of(data))), mutants(files)) > CASES / 10


@pytest.mark.parametrize(
    "topic",
    [CMD_VEL, DIAGNOSTICS, HAND_SIGN, IMAGE_COMPRESSED, IMAGE_RAW, JOINT_STATES, ODOM, WORLD_MARKERS],
    ids=lambda topic: topic.name,
)
def test_messages_of_other_nodes(topic: Topic[Any]) -> None:
    """What cannot be decoded is left out by the transports, whatever rosbags raises; here it must be soon."""
    name = type_name(topic.type)

    def read(data: bytes) -> None:
        try:
            message = decode(data, name)
        except Exception as error:
            raise TransportError(type(error).__name__) from None
        if isinstance(message, Image):
            bgr_image(message)
        elif isinstance(message, CompressedImage):
            jpeg_picture(message)

    image = Image(HEADER, 4, 4, "bgr8", 0, 12, np.zeros(48, np.uint8))
    picture = CompressedImage(HEADER, "png", np.frombuffer(corpus.png(9, 9), np.uint8))
    good = [encode(each) for each in (image, picture, String("Forward"))]
    hold(read, mutants([*good, b"\x00\x01\x00\x00" + b"\xff" * 64, b"\x00\x01\x00\x00" + bytes(400)]))


def test_the_fuzzer_finds_what_it_looks_for() -> None:
    def read(data: bytes) -> None:
        if data[:1] == b"x":
            raise FrameError("two\nlines")
        if data[:1] == b"y":
            raise KeyError(data)

    for corpus_of_one in ([b"x"], [b"y"]):
        with pytest.raises(pytest.fail.Exception):
            hold(read, mutants(corpus_of_one, 1))
    assert issubclass(FrameError, HandsteerError)
    assert ControlConfig()

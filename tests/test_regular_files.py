"""Files from outside that are none, or too large, and the texts in them that error messages repeat."""

import os
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from handsteer.cameras.files import read_photo
from handsteer.config import load
from handsteer.errors import HandsteerError
from handsteer.plugins.record.bags import Bag
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.plugins.teach.dataset import load_dataset
from handsteer.plugins.teach.exchange import load_shared, read_class_names, read_keypoints
from handsteer.recognition.custom_signs import load_custom_model
from handsteer.recognition.shipped_signs import load_model
from handsteer.regular_files import mode_of, open_regular, read_regular, replacing
from handsteer.robots.world import load_world, parse_world

READERS: dict[str, Callable[[Path], object]] = {
    "configuration": load,
    "world": load_world,
    "photo": read_photo,
    "signs": load_custom_model,
    "model": load_model,
    "dataset": load_dataset,
    "shared": load_shared,
    "class names": read_class_names,
    "keypoints": lambda path: read_keypoints(path, {"0": "Go"}, "a"),
    "packed keypoints": lambda path: read_keypoints(path.rename(path.with_suffix(".gz")), {"0": "Go"}, "a"),
    "recording": lambda path: list(McapFile(path).messages()),
    "bag": lambda path: list(Bag(path.rename(path.with_suffix(".bag"))).messages()),
}


def test_a_regular_file_and_a_link_to_it_are_read(tmp_path: Path) -> None:
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_bytes(b"abc")
    link.symlink_to(file)
    assert read_regular(file, 3) == read_regular(link, 3) == b"abc"
    with open_regular(file) as opened:
        assert opened.read() == b"abc"
    with pytest.raises(OSError, match="larger than") as refused:
        read_regular(file, 2)
    assert refused.value.strerror


def test_a_file_is_replaced_as_a_whole_or_not_at_all(tmp_path: Path) -> None:
    file = tmp_path / "file"
    with replacing(file, mode_of(file, 0o640)) as new:
        new.write(b"first")
        assert not file.exists()
    assert (file.read_bytes(), mode_of(file, 0)) == (b"first", 0o640)
    unfinished = ExitStack()
    unfinished.enter_context(replacing(file, 0o600)).write(b"second")
    assert len(list(tmp_path.iterdir())) == 2
    assert not unfinished.__exit__(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert (file.read_bytes(), mode_of(file, 0)) == (b"first", 0o640)
    assert [*tmp_path.iterdir()] == [file]


@pytest.mark.timeout(60)
@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("what", ["pipe", "device", "folder"])
def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path, kind: str, what: str) -> None:
    path = tmp_path / "file.yaml"
    if what == "pipe":
        os.mkfifo(path)
    elif what == "device":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    with pytest.raises(HandsteerError) as refused:
        READERS[kind](path)
    words = str(refused.value)
    assert "not a regular file" in words or what == "folder"
    assert words.isprintable()


@pytest.mark.parametrize("kind", ["signs", "model", "dataset", "shared"])
def test_a_large_file_is_refused_before_it_is_read(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "large.npz"
    with path.open("wb") as file:
        file.truncate(5_000_000_000)  # takes no space
    with pytest.raises(HandsteerError, match="larger than"):
        READERS[kind](path)


OUTSIDE = ("\\u001b[2J\\u202e", "x" * 3000)


@pytest.mark.parametrize("text", OUTSIDE, ids=["unprintable", "long"])
@pytest.mark.parametrize(
    "content",
    [
        'obstacles: [{{name: a, shape: "{0}", position: [0, 0]}}]',
        'obstacles: [{{name: "{0}", shape: box, position: [0, 0]}}]',
        'obstacles: [{{name: a, shape: sphere, radius: 1, position: [0, 0], colour: "{0}"}}]',
        'obstacles: [{{name: a, shape: sphere, radius: "{0}", position: [0, 0]}}]',
        'obstacles: [{{name: a, shape: sphere, radius: 1, position: [0, 0], "{0}": 1}}]',
        '"{0}": 1',
        'floor: {{"{0}": 1}}',
        'floor: {{colour: "{0}"}}',
    ],
)
def test_an_error_repeats_little_of_a_world_and_on_one_line(content: str, text: str) -> None:
    with pytest.raises(HandsteerError) as refused:
        parse_world(content.format(text), "w.yaml")
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < 500


@pytest.mark.parametrize("text", OUTSIDE, ids=["unprintable", "long"])
@pytest.mark.parametrize(
    "content", ['control: {{rule: "{0}"}}', 'control: {{max_linear: "{0}"}}', 'control: {{"{0}": 1}}', '"{0}": 1']
)
def test_an_error_repeats_little_of_a_configuration_and_on_one_line(tmp_path: Path, content: str, text: str) -> None:
    path = tmp_path / "c.yaml"
    path.write_text(content.format(text))
    with pytest.raises(HandsteerError) as refused:
        load(path)
    words = str(refused.value).removeprefix(str(path))
    assert words.isprintable()
    assert len(words) < 500

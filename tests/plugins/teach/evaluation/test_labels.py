from pathlib import Path

import pytest

from handsteer.errors import LabelError
from handsteer.plugins.teach.evaluation.labels import LabelledPhoto, read_photo_labels, read_video_labels
from handsteer.types import FORWARD, NONE, SIGNS, STOP, TURN_RIGHT


def put(folder: Path, *names: str) -> None:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"not looked into here")


def test_an_index_gives_sign_and_kind(tmp_path: Path) -> None:
    put(tmp_path, "a.jpg", "b.jpg", "negatives/ok/c.jpg", "d.jpg", "e.jpg")
    rows = ["a.jpg, Stop,,", "b.jpg,turn_right,left hand, Ann", "negatives/ok/c.jpg,none,", "d.jpg,,L,B,x", ""]
    text = "\n".join(["\ufeffpath,sign,kind,person_set", *rows])
    (tmp_path / "index.csv").write_text(text, encoding="utf-8")
    assert read_photo_labels(tmp_path, SIGNS) == [
        LabelledPhoto(tmp_path / "a.jpg", STOP),
        LabelledPhoto(tmp_path / "b.jpg", TURN_RIGHT, "left hand", "Ann"),
        LabelledPhoto(tmp_path / "negatives/ok/c.jpg", NONE, "ok"),
        LabelledPhoto(tmp_path / "d.jpg", None, "L", "B"),
    ]


def test_subfolders_are_signs_and_kinds(tmp_path: Path) -> None:
    put(tmp_path, "stop/a.jpg", "stop/deep/b.PNG", "Turn Right/c.jpg", "negatives/d.jpg", "negatives/horns/e/f.jpg")
    put(tmp_path, "ambiguous/x/g.jpg", "stop/notes.txt")
    found = {(str(p.path.relative_to(tmp_path)), p.truth, p.kind) for p in read_photo_labels(tmp_path, SIGNS)}
    assert found == {
        ("stop/a.jpg", STOP, ""),
        ("stop/deep/b.PNG", STOP, ""),
        ("Turn Right/c.jpg", TURN_RIGHT, ""),
        ("negatives/d.jpg", NONE, ""),
        ("negatives/horns/e/f.jpg", NONE, "horns"),
        ("ambiguous/x/g.jpg", None, ""),
    }


def test_a_taught_sign_may_occur(tmp_path: Path) -> None:
    put(tmp_path, "hi_there/a.jpg")
    assert read_photo_labels(tmp_path, (*SIGNS, "Hi There"))[0].truth == "Hi There"


@pytest.mark.parametrize(
    ("index", "message"),
    [
        (
            "path,sign\na.jpg,Stop\na.jpg,Wave\n",
            r"index\.csv, line 3: there is no sign 'Wave'; the signs are Stop, .*NONE",
        ),
        ("path,sign\ngone.jpg,Stop\n", r"index\.csv, line 2: there is no photo .*gone\.jpg"),
        ("file,sign\na.jpg,Stop\n", r"index\.csv, line 1: expected the columns path, sign; path is missing"),
        ("path,sign\na.jpg\n", r"index\.csv, line 2: expected 2 or more fields"),
        ("path,sign\n", r"there is no photo to score"),
        ("path,sign\na.jpg,\n", r"there is no photo to score"),
        ("", r"line 1: expected the columns"),
        ("path,sign\n\xe4.jpg,Stop\n", r"cannot read the labels .*index\.csv"),
    ],
)
def test_what_is_wrong_in_an_index_is_named(tmp_path: Path, index: str, message: str) -> None:
    put(tmp_path, "a.jpg")
    (tmp_path / "index.csv").write_text(index, encoding="latin-1")
    with pytest.raises(LabelError, match=message) as caught:
        read_photo_labels(tmp_path, SIGNS)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ([], r"no labels; expected an index\.csv, or subfolders"),
        (["a.jpg"], r"no label for a\.jpg; put it into a subfolder"),
        (["wave/a.jpg"], r"folder .*wave: there is no sign 'wave'"),
        (["ambiguous/a.jpg"], r"there is no photo to score"),
    ],
)
def test_a_folder_without_labels(tmp_path: Path, names: list[str], message: str) -> None:
    put(tmp_path, *names)
    with pytest.raises(LabelError, match=message):
        read_photo_labels(tmp_path, SIGNS)


def test_no_such_folder(tmp_path: Path) -> None:
    with pytest.raises(LabelError, match=r"there is no folder .*gone: give"):
        read_photo_labels(tmp_path / "gone", SIGNS)


def test_video_labels(tmp_path: Path) -> None:
    video = tmp_path / "drive.v2.mp4"
    assert read_video_labels(video, SIGNS) is None
    (tmp_path / "drive.v2.labels.csv").write_text("frame,sign,photo\n0,none,a\n1,TurnRight,b\n2,,c\n7,FORWARD,d\n")
    assert read_video_labels(video, SIGNS) == {0: NONE, 1: TURN_RIGHT, 7: FORWARD}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("frame,sign\n0,none\nx,Stop\n", r"line 3: expected the number of a frame, each once, found 'x'"),
        ("frame,sign\n0,none\n0,Stop\n", r"line 3: expected the number of a frame, each once, found '0'"),
        ("frame,sign\n0,Wave\n", r"line 2: there is no sign 'Wave'"),
        ("frame,sign\n0,\n", r"there is no frame with a sign or NONE"),
    ],
)
def test_what_is_wrong_in_video_labels_is_named(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "drive.labels.csv").write_text(text)
    with pytest.raises(LabelError, match=rf"drive\.labels\.csv.*{message}|{message}"):
        read_video_labels(tmp_path / "drive.mp4", SIGNS)


def test_the_real_photos(data_dir: Path) -> None:
    photos = read_photo_labels(data_dir / "photos", SIGNS)
    by_folder = [
        LabelledPhoto(photo.path, photo.truth)
        for photo in photos
        if photo.truth is not None and photo.path.relative_to(data_dir / "photos").parts[0] != "negatives"
    ]
    assert len([photo for photo in photos if photo.truth is not None]) == 713
    assert all(photo.path.parent.name.replace("_", " ") == str(photo.truth).lower() for photo in by_folder)

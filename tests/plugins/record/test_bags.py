from collections import Counter
from pathlib import Path

import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from handsteer.cameras.files import is_recording
from handsteer.errors import RecordingError
from handsteer.plugins.record.files import open_recording
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.transports.encoding import encode, types

TOPICS = {
    "/image_raw/compressed",
    "/gesture/hand_sign",
    "/robot_diff_drive_controller/cmd_vel",
    "/robot_diff_drive_controller/odom",
}


def as_ros1(recording: Path, bag: Path) -> Path:
    """Write what is in a recording as a bag of ROS 1, by rosbags."""
    store, connections = get_typestore(Stores.ROS1_NOETIC), {}
    with Ros1Writer(bag) as writer:
        for recorded in McapFile(recording).messages(TOPICS):
            if recorded.topic not in connections:
                connections[recorded.topic] = writer.add_connection(recorded.topic, recorded.type, typestore=store)
            raw = types().cdr_to_ros1(recorded.raw, recorded.type)  # adds the seq of headers
            writer.write(connections[recorded.topic], recorded.time_ns, raw)
    return bag


def as_ros2(recording: Path, bag: Path, plugin: StoragePlugin) -> Path:
    """Write what is in a recording as a folder of ROS 2, by rosbags."""
    store, connections = get_typestore(Stores.ROS2_JAZZY), {}
    with Ros2Writer(bag, version=9, storage_plugin=plugin) as writer:
        for recorded in McapFile(recording).messages(TOPICS):
            if recorded.topic not in connections:
                connections[recorded.topic] = writer.add_connection(recorded.topic, recorded.type, typestore=store)
            writer.write(connections[recorded.topic], recorded.time_ns, recorded.raw)
    return bag


@pytest.fixture(params=["ros1", "sqlite3", "mcap", "db3 alone"])
def bag(request: pytest.FixtureRequest, recording: Path, tmp_path: Path) -> Path:
    if request.param == "ros1":
        return as_ros1(recording, tmp_path / "drive.bag")
    plugin = StoragePlugin.MCAP if request.param == "mcap" else StoragePlugin.SQLITE3
    folder = as_ros2(recording, tmp_path / "drive", plugin)
    return next(folder.glob("*.db3")) if request.param == "db3 alone" else folder


def test_a_bag_has_the_same_messages(bag: Path, recording: Path) -> None:
    assert is_recording(bag)
    theirs = [(it.topic, it.type, it.time_ns, encode(it.message)) for it in open_recording(bag).messages()]
    ours = [(it.topic, it.type, it.time_ns, it.raw) for it in McapFile(recording).messages(TOPICS)]
    assert Counter(theirs) == Counter(ours)


def test_only_the_asked_topics_are_read(bag: Path) -> None:
    signs = list(open_recording(bag).messages({"/gesture/hand_sign"}))
    assert len(signs) == 241
    assert list(open_recording(bag).messages({"/nothing"})) == []


@pytest.mark.parametrize("name", ["a.bag", "a.db3", "a/metadata.yaml"])
def test_a_damaged_bag_is_refused_in_one_line(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text("#ROSBAG V2.0\nthis is not a bag\n")
    with pytest.raises(RecordingError, match="cannot read the bag") as error:
        open_recording(path.parent if path.suffix == ".yaml" else path)
    assert "\n" not in str(error.value)


def test_a_folder_that_is_no_bag_is_said(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r" is a folder without metadata\.yaml: give a recording"):
        open_recording(tmp_path)


def test_what_is_missing_is_said() -> None:
    with pytest.raises(RecordingError, match=r"there is no recording nowhere\.mcap"):
        open_recording(Path("nowhere.mcap"))

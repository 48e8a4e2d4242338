"""Images that a player of bags publishes in ROS 2 are recognised each, whatever else the machine does.

Beside load, the node itself says what it has recognised: a program that listens loses signs that come to it late.
"""

import re
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

from rosbags.rosbag2 import StoragePlugin, Writer

from handsteer.images import jpeg_message
from handsteer.messages import CompressedImage, Header, Time, type_name
from handsteer.transports.encoding import encode, message_types
from tests.bags import BUSY, FRAMES, PLAYS, SHOWN, frames
from tests.processes import Process, eventually
from tests.ros2.graph import NEEDS_ROS2, Ros2Graph

pytestmark = NEEDS_ROS2

PLAYER = Path(__file__).with_name("player.py")


def bag_of_frames(path: Path, topic: str) -> Path:
    """Write a bag of JPEG images as ``ros2 bag record -s mcap`` does; it is of another day."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(topic, type_name(CompressedImage), typestore=message_types())
        for stamp_ns, bgr in frames():
            header = Header(Time(stamp_ns // 10**9, stamp_ns % 10**9), "camera")
            writer.write(connection, stamp_ns, encode(jpeg_message(bgr, header)))
    return path


def test_a_bag_gives_the_same_signs_each_time_quiet_and_beside_load(
    ros2: Ros2Graph, tmp_path: Path, busy: Callable[[int], None]
) -> None:
    peer, topic = ros2.peer, "/played/gesture/hand_sign"
    bag = bag_of_frames(tmp_path / "bag", "/played/image_raw/compressed")
    peer.ask("record", topic=topic, type="String", fields=["data"])
    words = ("-r", "__ns:=/played", "-p", "image_transport:=compressed")
    recognition = ros2.node("recognition", name="/played/hand_sign_recognition", ros=words)
    eventually(lambda: peer.ask("get", topic=topic), what="the recognition's NONE")

    def reports() -> list[str]:
        return re.findall(r"\d+ images of a recording: .*", recognition.text)

    def play() -> str:
        """Play the bag; return what the node reports of it."""
        before = len(reports())
        player = ros2.adopt(Process([ros2.python, str(PLAYER), str(bag), "2.0"], ros2.env, ros2.log("player")))
        eventually(lambda: len(reports()) > before, 120.0, "a report")
        assert player.code() == 0, player.text
        return "; ".join(reports()[before:])

    def signs() -> list[str]:
        """Play the bag; return its signs, without the NONE before and after: it begins and ends with Stop."""
        before = len(peer.ask("get", topic=topic))
        play()
        words = [str(values[0]) for _, values in peer.ask("get", topic=topic)[before:]]
        first, last = words.index("Stop"), len(words) - words[::-1].index("Stop")
        return words[first:last]

    quiet = [signs() for _ in range(PLAYS)]
    assert [len(each) for each in quiet] == [FRAMES] * PLAYS
    assert [word for word, _ in groupby(quiet[0]) if word != "NONE"] == SHOWN
    assert all(each == quiet[0] for each in quiet)
    assert len(set(reports())) == 1
    busy(BUSY)
    for _ in range(PLAYS):
        assert play() == reports()[0]

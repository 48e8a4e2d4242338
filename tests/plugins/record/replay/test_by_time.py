from pathlib import Path

import pytest

from handsteer.config import Config, SignsConfig
from handsteer.errors import RecordingError
from handsteer.messages import CMD_VEL, HAND_SIGN, Header, Time, Topic, TwistStamped
from handsteer.plugins.record.files import open_recording
from handsteer.plugins.record.mcap_writer import McapWriter
from handsteer.plugins.record.replay.by_time import rerun_by_time
from handsteer.plugins.record.replay.compare import Comparison, Moment, compare
from handsteer.plugins.record.replay.rerun import Source
from handsteer.transports.encoding import encode
from tests.plugins.record.test_bags import as_ros1


def replayed(path: Path, config: Config, source: Source = "frames") -> tuple[Comparison, list[Moment]]:
    recording, comparison = open_recording(path), Comparison()
    return comparison, list(compare(rerun_by_time(recording, config, source), comparison, recording.began_s))


@pytest.mark.slow
@pytest.mark.parametrize("source", ["frames", "signs"])
def test_a_bag_of_another_recorder_gives_the_same_within_a_tolerance(
    source: Source, recording: Path, tmp_path: Path
) -> None:
    comparison, moments = replayed(as_ros1(recording, tmp_path / "drive.bag"), Config(), source)
    assert moments == []
    assert comparison.frames == 241
    assert comparison.signs == (241 if source == "frames" else 0)
    assert comparison.commands > 200


@pytest.mark.slow
def test_other_parameters_give_the_moments_that_differ(recording: Path, tmp_path: Path) -> None:
    config = Config(signs=SignsConfig(confirm_time=1.0))
    comparison, moments = replayed(as_ros1(recording, tmp_path / "drive.bag"), config)
    assert 20 < comparison.differing < comparison.signs + comparison.commands
    first = next(moment for moment in moments if moment.what == "sign")
    assert first.recorded != first.replayed
    assert first.frame is not None


def test_a_time_that_jumps_for_years_is_no_reason_to_hang(recording: Path, tmp_path: Path) -> None:
    writer = McapWriter(tmp_path / "jump.mcap")
    years_ns = 20 * 365 * 86400 * 10**9
    for recorded in open_recording(recording).messages({HAND_SIGN.name}):
        shift_ns = years_ns if recorded.number > 100 else 0
        writer.write(HAND_SIGN, HAND_SIGN.name, recorded.raw, recorded.time_ns + shift_ns, recorded.number)
    writer.close()
    recording_ = open_recording(tmp_path / "jump.mcap")
    assert list(rerun_by_time(recording_, Config(), "signs")) == []


def test_without_pictures_only_signs_can_be_replayed(tmp_path: Path) -> None:
    McapWriter(tmp_path / "empty.mcap").close()
    with pytest.raises(RecordingError, match="contains no pictures"):
        list(rerun_by_time(open_recording(tmp_path / "empty.mcap"), Config()))
    with pytest.raises(RecordingError, match="contains nothing"):
        list(rerun_by_time(open_recording(tmp_path / "empty.mcap"), Config(), "signs"))


@pytest.mark.slow
def test_commands_with_a_time_stamp_are_compared_without_it(recording: Path, tmp_path: Path) -> None:
    path, stamped = tmp_path / "stamped.mcap", Topic(CMD_VEL.name, TwistStamped)
    writer = McapWriter(path)
    for recorded in open_recording(recording).messages({HAND_SIGN.name, CMD_VEL.name}):
        if recorded.topic == CMD_VEL.name:
            message = TwistStamped(Header(Time(0, recorded.number), "base_link"), recorded.message)
            writer.write(stamped, stamped.name, encode(message), recorded.time_ns, recorded.number)
        else:
            writer.write(HAND_SIGN, HAND_SIGN.name, recorded.raw, recorded.time_ns, recorded.number)
    writer.close()
    comparison, moments = replayed(path, Config(), "signs")
    assert moments == []
    assert comparison.commands > 200

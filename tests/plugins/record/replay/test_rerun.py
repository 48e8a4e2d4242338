import json
import math
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path

import pytest

from handsteer.config import Config, VirtualHandConfig
from handsteer.errors import RecordingError
from handsteer.graph import Graph
from handsteer.messages import HAND_SIGN, String
from handsteer.nodes.journal import journal_topic
from handsteer.plugins.record.mcap_reader import McapFile
from handsteer.plugins.record.mcap_writer import McapWriter
from handsteer.plugins.record.recorded import Recorded
from handsteer.plugins.record.replay.compare import Comparison, Moment, compare
from handsteer.plugins.record.replay.journals import parse_spin
from handsteer.plugins.record.replay.rerun import Source, recorded_config, rerun
from handsteer.transports.encoding import encode


def replayed(path: Path, config: Config | None = None, source: Source = "frames") -> tuple[Comparison, list[Moment]]:
    file, comparison = McapFile(path), Comparison()
    moments = list(compare(rerun(file, config or recorded_config(file), source), comparison, file.began_s))
    assert file.problem is None
    return comparison, moments


def changed(path: Path, section: str, **values: object) -> Config:
    config = recorded_config(McapFile(path))
    part = getattr(config, section).model_copy(update=values)
    return config.model_copy(update={section: part})


@pytest.mark.slow
@pytest.mark.parametrize("source", ["frames", "signs"])
def test_the_same_software_gives_the_same_signs_and_commands(source: Source, recording: Path) -> None:
    comparison, moments = replayed(recording, source=source)
    assert moments == []
    assert comparison.frames == (241 if source == "frames" else 0)
    assert comparison.commands > 200
    assert comparison.duration_s == pytest.approx(8.0, abs=0.1)


@pytest.mark.slow
def test_a_run_in_real_time_gives_the_same_however_it_was_disturbed(tmp_path: Path) -> None:
    config = Config(virtual_hand=VirtualHandConfig(script="Stop:1 Forward:1 Turn Left:1"))
    with Graph(config) as graph:
        graph.record(tmp_path / "drive.mcap")
        graph.start()
        graph.wait(4.0)
        slower = config.control.model_copy(update={"max_linear": 0.2})
        graph.reconfigure(config.model_copy(update={"control": slower}))
        graph.wait(3.0)
        graph.steering.halt()
        graph.wait(1.0)
    comparison, moments = replayed(tmp_path / "drive.mcap")
    assert moments == []
    assert comparison.signs > 20
    assert comparison.commands > 20


@pytest.mark.slow
def test_a_recording_that_began_in_mid_run_can_be_replayed(tmp_path: Path) -> None:
    with Graph(Config(virtual_hand=VirtualHandConfig(script="Stop:1 Forward:1"))) as graph:
        graph.start()
        graph.wait(3.0)
        graph.record(tmp_path / "drive.mcap")
        graph.wait(5.0)
        graph.end_recording()
        graph.wait(1.0)
    comparison, moments = replayed(tmp_path / "drive.mcap")
    assert comparison.signs > 20
    assert Counter(moment.what for moment in moments)["sign"] < comparison.signs / 4


@pytest.mark.slow
def test_other_parameters_give_the_moments_that_differ(recording: Path) -> None:
    comparison, moments = replayed(recording, changed(recording, "control", max_linear=0.2))
    assert {moment.what for moment in moments} == {"command"}
    assert comparison.differing == len(moments) > 20
    first = moments[0]
    assert 1.0 < first.time_s < 3.0
    assert first.recorded.startswith("0.2")
    assert first.replayed == "0.200 m/s, 0.000 rad/s"


@pytest.mark.slow
def test_a_model_that_sees_less_gives_the_frames_where_it_does(recording: Path) -> None:
    comparison, moments = replayed(recording, changed(recording, "signs", confirm_time=0.5))
    signs = [moment for moment in moments if moment.what == "sign"]
    assert 10 < len(signs) < comparison.signs
    assert all(moment.frame is not None for moment in signs)
    assert {moment.recorded for moment in signs} >= {"Forward", "Turn Left"}
    assert "command" in {moment.what for moment in moments}


def test_without_a_journal_it_says_so(recording: Path, tmp_path: Path) -> None:
    writer = McapWriter(tmp_path / "signs.mcap")
    for recorded in McapFile(recording).messages({HAND_SIGN.name}):
        writer.write(HAND_SIGN, HAND_SIGN.name, recorded.raw, recorded.time_ns, recorded.number)
    writer.close()
    file = McapFile(tmp_path / "signs.mcap")
    with pytest.raises(RecordingError, match="no journal of hand_sign_recognition"):
        list(rerun(file, Config()))
    with pytest.raises(RecordingError, match="contains no parameters"):
        recorded_config(file)


@pytest.mark.parametrize("offset", ["nan", "inf", "-1e300", "abc"])
def test_an_offset_of_the_clock_that_is_not_a_time_is_refused(offset: str, tmp_path: Path) -> None:
    writer = McapWriter(tmp_path / "odd.mcap")
    writer.describe("handsteer", {"clock_offset_s": offset})
    writer.close()
    with pytest.raises(RecordingError, match=rf"odd\.mcap: clock_offset_s: '{offset}' is not a valid time in seconds"):
        list(rerun(McapFile(tmp_path / "odd.mcap"), Config(), "signs"))


@pytest.mark.parametrize("time_s", [1e300, math.nan])
@pytest.mark.parametrize("entry", ['{"t": [%s]}', '{"t": [1.0], "got": [["/hand_sign", 1, %s, false, false]]}'])
def test_a_journal_with_a_number_that_is_not_a_time_is_damaged(time_s: float, entry: str) -> None:
    data = String(data=entry % json.dumps(time_s))
    recorded = Recorded("/journal", "std_msgs/msg/String", 0, 1, encode(data))
    with pytest.raises(RecordingError, match=r"/journal is damaged at 0\.000 s: a number that is not a time"):
        parse_spin(recorded)


@pytest.mark.slow
def test_a_recording_that_was_cut_off_is_replayed_up_to_there(recording: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recording.read_bytes()[: recording.stat().st_size * 2 // 3])
    file, comparison = McapFile(cut), Comparison()
    assert list(compare(rerun(file, recorded_config(file)), comparison, file.began_s)) == []
    assert comparison.frames > 100
    assert file.problem is not None


class CutInASpin(McapFile):
    """A recording that ends while recognition publishes a sign: the control has it, recognition's journal not yet."""

    cut_topic = journal_topic("hand_sign_recognition").name

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Recorded]:
        """Yield the messages up to the control's last entry with a sign."""
        written = list(super().messages())
        self.problem = "it was cut off"
        end = max(
            index for index, each in enumerate(written) if self._is_of_control(each) and HAND_SIGN.name in text(each)
        )
        entry = max(index for index, each in enumerate(written[:end]) if each.topic == self.cut_topic)
        kept = [*written[:entry], *written[entry + 1 : end + 1]]
        return iter([each for each in kept if topics is None or each.topic in topics])

    @staticmethod
    def _is_of_control(recorded: Recorded) -> bool:
        return recorded.topic == journal_topic("hand_sign_control").name


def text(recorded: Recorded) -> str:
    return str(recorded.message.data)


class CutBeforeTheSign(CutInASpin):
    """Likewise, but the sign itself is not recorded either."""

    cut_topic = HAND_SIGN.name


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "source"), [(CutInASpin, "frames"), (CutBeforeTheSign, "signs")])
def test_a_recording_that_ends_in_a_spin_is_replayed_up_to_there(
    kind: type[CutInASpin], source: Source, recording: Path
) -> None:
    file, comparison = kind(recording), Comparison()
    assert list(compare(rerun(file, recorded_config(file), source), comparison, file.began_s)) == []
    assert comparison.commands > 200

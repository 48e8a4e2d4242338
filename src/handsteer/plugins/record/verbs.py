"""``handsteer record``, ``replay`` and ``report``: record a graph; run it again, and compare; what happened in it."""

import json as json_format
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from handsteer.cli import signals
from handsteer.cli.app import ConfigFile, Flag, Parameters, Transport, loads
from handsteer.cli.running import fail, printable, say, settings, signals_ignored
from handsteer.errors import RecordingError

if TYPE_CHECKING:
    from handsteer.plugins.record.replay.compare import Comparison, Moment
    from handsteer.plugins.record.replay.drive_facts import DriveFacts

_LOOK_PERIOD_S = 0.2
_MOST_PRINTED = 50


@loads("handsteer.plugins.record.recorder", "handsteer.transports")
def record(
    output: Path,
    *ros_args: str,
    transport: Transport,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Record the topics of a graph of several processes to an MCAP file, until Ctrl-C.

    Pictures are recorded as JPEG: those of image_raw/compressed if a node publishes them, else those of image_raw.

    For example:
      handsteer record drive.mcap --transport auto  a graph of ROS 2
      handsteer record drive.mcap --transport ros1 image_raw:=/front/image_raw

    Parameters
    ----------
    output
        The file, which must not exist yet.
    ros_args
        ROS arguments. ROS 1: topic:=other, __name:=name, __ns:=namespace.
        ROS 2: --ros-args -r topic:=other -r __ns:=/namespace.
    config_file
        YAML file with parameters, of which cmd_vel_type and control.assist matter; options override it.
    """
    from handsteer.plugins.record.recorder import GraphRecorder
    from handsteer.transports import join

    config = settings(config_file, parameters)
    session = join(transport, "recorder", ros_args)
    try:
        recorder = GraphRecorder(output, session.transport, session.clock, config)
        try:
            say(f"recording to {output}; Ctrl-C ends")
            while recorder.ended_by is None and not session.wait(_LOOK_PERIOD_S) and not signals.were_raised():
                recorder.look()
        except KeyboardInterrupt:
            pass  # the usual end
        finally:
            with signals_ignored():
                recorder.close()
    finally:
        with signals_ignored():
            session.close()
    return 0


@loads("handsteer.plugins.record.replay.by_time", "handsteer.plugins.record.replay.rerun")
def replay(
    recording: Path,
    *,
    from_: Annotated[Literal["frames", "signs"], Parameter(name="--from")] = "frames",
    diff: Path | None = None,
    json: Flag = False,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Run a recording through today's software, as fast as possible, and compare signs and commands.

    Exit code 0 if all are the same, 1 if any differs. A recording of `handsteer run --record` is compared bit for bit.

    For example:
      handsteer replay drive.mcap                recognition and control
      handsteer replay drive.mcap --from signs   control alone
      handsteer replay drive.mcap --diff folder  keep frames that differ

    Parameters
    ----------
    recording
        MCAP file, or a bag of ROS 1 or 2.
    from_
        frames runs recognition and control again; signs the control alone, from the recorded signs.
    diff
        Folder to which the frame of each differing sign is written; it must not exist yet.
    json
        Print the result in JSON, and nothing else.
    config_file
        YAML file with parameters that replace the recorded ones; options override it.
    """
    from handsteer.clock import SteppedClock
    from handsteer.plugins.record.files import describe, open_recording
    from handsteer.plugins.record.replay.by_time import rerun_by_time
    from handsteer.plugins.record.replay.compare import Comparison, compare, differing_software
    from handsteer.plugins.record.replay.rerun import has_journals, recorded_config, rerun
    from handsteer.recognition.recognizer import model_files

    file = open_recording(recording)
    recorded = recorded_config(file).model_dump(exclude_unset=True) if "config" in file.about else {}
    config = settings(config_file, parameters, base=recorded)
    others = differing_software(file.about, describe(config, SteppedClock(), model_files(config))) if file.about else []
    if diff is not None:
        _make_folder(diff)
    comparison, moments = Comparison(), []
    results = rerun(file, config, from_) if has_journals(file) else rerun_by_time(file, config, from_)
    for moment in compare(results, comparison, file.began_s):
        moments.append(_described(moment, diff))
        if not json and len(moments) <= _MOST_PRINTED:
            print(printable(_line(moments[-1])))
    if file.problem:
        say(f"{recording}: {file.problem}")
    if json:
        print(json_format.dumps({**asdict(comparison), "software": others, "moments": moments}))
    else:
        _print_result(comparison, others, len(moments), is_exact=has_journals(file))
    if file.is_damaged:
        return fail(f"{recording} is damaged, so only a part of it could be compared")
    return 1 if comparison.differing else 0


@loads("handsteer.plugins.record.replay.drive_reader", "handsteer.plugins.record.replay.report_words")
def report(recording: Path, *, output: Path | None = None, force: Flag = False, json: Flag = False) -> None:
    """Report what happened in a recording, in one HTML page that needs no network, and print the totals.

    The page shows signs, velocities, the driven path, latencies, each stop with its reason and frame, and each motion
    without a live reason.

    For example:
      handsteer report drive.mcap                     writes drive.html next to it
      handsteer report drive.mcap --output page.html  another name
      handsteer report drive.mcap --json              the totals, for programs

    Parameters
    ----------
    recording
        MCAP file, or a bag of ROS 1 or 2; it may be cut off.
    output
        The page; by default next to the recording, as drive.html.
    force
        Overwrite the page if it exists.
    json
        Print the totals in JSON, and nothing else; no page is written.
    """
    from handsteer.plugins.record.files import open_recording
    from handsteer.plugins.record.replay.drive_reader import read_drive

    if json:
        print(json_format.dumps(read_drive(open_recording(recording)).totals()))
        return
    # Only the page needs the package plotly.
    from handsteer.plugins.record.replay.report import write_report

    # The name of a folder, such as rosbag2_2026_11_22-10.00.00, has no suffix.
    whole = recording.resolve()
    page = output or (whole.with_name(f"{whole.name}.html") if recording.is_dir() else recording.with_suffix(".html"))
    _print_totals(write_report(recording, page, force=force))
    print(f"report: {page}")


def _print_totals(facts: "DriveFacts") -> None:
    from handsteer.plugins.record.replay.report_words import heading, sign_totals, totals

    lines = [heading(facts)]
    for total in totals(facts)[1:]:
        more = f" ({total.more})" if total.more else ""
        lines.append(f"{total.name + ':':12}{total.value}{more}")
    signs = ", ".join(f"{total.name} {total.value}" for total in sign_totals(facts))
    lines += [f"{'signs:':12}{signs}"] if signs else []
    for line in lines:
        print(printable(line))
    for problem in facts.problems:
        say(f"{facts.path}: {problem}")


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise RecordingError(f"--diff: {folder} exists already: give another name, nothing is overwritten") from None
    except OSError as error:
        raise RecordingError(f"--diff: cannot create {folder}: {error.strerror}") from None


def _described(moment: "Moment", folder: Path | None) -> dict[str, Any]:
    """Return a moment for JSON; its frame is written to ``folder``, if there is one."""
    row = {"time_s": round(moment.time_s, 3), "what": moment.what}
    row |= {"recorded": moment.recorded, "replayed": moment.replayed}
    if folder is not None and moment.frame is not None:
        path = folder / f"{moment.time_s:010.3f}.jpg"
        try:
            path.write_bytes(moment.frame.message.data.tobytes())
        except OSError as error:
            raise RecordingError(f"--diff: cannot write {path}: {error.strerror}") from None
        row["picture"] = str(path)
    return row


def _line(row: dict[str, Any]) -> str:
    picture = f" ({row['picture']})" if "picture" in row else ""
    return f"{row['time_s']:9.3f} s  {row['what']}: {row['recorded']} was recorded, now {row['replayed']}{picture}"


def _print_result(comparison: "Comparison", others: list[str], moments: int, *, is_exact: bool) -> None:
    from handsteer.plugins.record.replay.by_time import TOLERANCE_S

    if moments > _MOST_PRINTED:
        print(f"and {moments - _MOST_PRINTED} more: --json lists all")
    counts = f"{comparison.frames} frames, {comparison.signs} signs, {comparison.commands} commands"
    same = "all the same, bit for bit" if is_exact else f"all the same, within {TOLERANCE_S:g} s"
    result = f"{comparison.differing} moments differ" if comparison.differing else same
    print(f"replayed {comparison.duration_s:.1f} s: {counts}; {result}")
    for other in others:
        print(printable(f"other software: {other}"))

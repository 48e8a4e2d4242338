"""``handsteer graph``: who is in a graph of several processes."""

import json as json_format
from typing import Annotated

from cyclopts import Parameter, validators

from handsteer.cli.options import Flag
from handsteer.transports import observe
from handsteer.transports.observed import ObservedGraph, ObservedTopic

Seconds = Annotated[float, Parameter(validator=validators.Number(gte=0, lte=3600))]


def graph(*, transport: str, seconds: Seconds = 2.0, json: Flag = False) -> int:
    """List the nodes and topics of a graph, ROS's and ours, with the rates of the topics and what is amiss.

    Example: handsteer graph --transport dds

    Parameters
    ----------
    transport
        What joins the nodes: dds (ROS 2).
    seconds
        For how long rates are measured; 0 leaves them out. It listens to every topic, so what is made on demand is
        made meanwhile.
    json
        Print one JSON object.
    """
    seen = observe(transport, seconds)
    if json:
        print(json_format.dumps(seen.as_dict()))
    else:
        print("\n".join(_lines(seen)))
    return 0


def _lines(seen: ObservedGraph) -> list[str]:
    lines = [f"{seen.place}: {_count(len(seen.nodes), 'node')}, {_count(len(seen.topics), 'topic')}"]
    named = {*seen.nodes, *(node for topic in seen.topics for node in (*topic.publishers, *topic.subscribers))}
    for node in sorted(named):
        lines += ["", node]
        lines += [f"  publishes   {topic.name}" for topic in seen.topics if node in topic.publishers]
        lines += [f"  subscribes  {topic.name}" for topic in seen.topics if node in topic.subscribers]
    if seen.topics:
        lines += ["", *_table(seen.topics)]
    return [*lines, *(f"!!  {warning}" for warning in seen.warnings)]


def _table(topics: tuple[ObservedTopic, ...]) -> list[str]:
    rows = [("topic", "type", "pub", "sub", "Hz")] + [
        (
            topic.name,
            " ".join(topic.types),
            str(len(topic.publishers)),
            str(len(topic.subscribers)),
            "-" if topic.rate_hz is None else f"{topic.rate_hz:.1f}",
        )
        for topic in topics
    ]
    name, kind = (max(len(row[column]) for row in rows) for column in (0, 1))
    return [f"{row[0]:{name}}  {row[1]:{kind}}  {row[2]:>3}  {row[3]:>3}  {row[4]:>6}" for row in rows]


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"

"""Plans and courses that the tests of studies share."""

from pathlib import Path
from typing import Any

import yaml

from handsteer.plugins.study.plan import Plan, load_configs
from handsteer.plugins.study.session import Task
from handsteer.robots.world import Gate, World

GATES = (
    Gate(name="start", left=(0.4, 0.6), right=(0.4, -0.6)),
    Gate(name="finish", left=(1.0, 0.6), right=(1.0, -0.6)),
)
PAD = {"name": "pad", "input": "pad"}
SIGNS = {"name": "signs"}


def a_plan(**fields: Any) -> Plan:
    """Return a small plan; ``fields`` override its own."""
    small = {"participants": 2, "conditions": [SIGNS, PAD], "courses": ["short"], "laps": 2, "lap_limit": 60}
    return Plan.model_validate({**small, **fields})


def a_task(folder: Path, plan: Plan | None = None, participant: str = "P01") -> Task:
    """Return a task whose courses are straight ahead."""
    plan = plan or a_plan()
    courses = {name: World(gates=GATES) for name in plan.courses}
    return Task(plan, participant, courses, load_configs(plan, Path("plan.yaml"), {}), folder)


def write(path: Path, values: Any) -> Path:
    """Write ``values`` as YAML."""
    path.write_text(yaml.safe_dump(values), encoding="utf-8")
    return path

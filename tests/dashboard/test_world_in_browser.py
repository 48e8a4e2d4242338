"""The world card in a real browser: views, editor, and the course."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page

from handsteer.dashboard.scene import about_axis, from_rpy
from handsteer.messages import JOINT_STATES, JointState
from handsteer.robots.description import joints, robot_description
from handsteer.robots.world import load_world, read_world
from handsteer.transports.base import Received
from tests.dashboard.browsers import a_browser
from tests.dashboard.served import Site
from tests.dashboard.visits import NEEDS_A_BROWSER, PATIENCE_MS, Visit, visiting

pytestmark = NEEDS_A_BROWSER

SCENE = """
    const name = Object.keys(window).find(key => key.startsWith("scene_"));
    const scene = window[name];
    const { camera, controls } = getElement(Number(name.slice("scene_c".length)));
"""
COURSE = """
obstacles:
  - {name: post, shape: box, size: [0.2, 3, 0.5], position: [2.2, 0]}
gates:
  - {name: start, left: [0.4, 0.6], right: [0.4, -0.6]}
  - {name: finish, left: [1.2, 0.6], right: [1.2, -0.6]}
  - {name: beyond, left: [9, 0.6], right: [9, -0.6]}
"""


@contextmanager
def looking_at(world: object) -> Iterator[Visit]:
    """Show the page with ``world``."""
    with visiting("NONE:600", steering=True, robot={"world": str(world)}) as visit:
        visit.wait_until(lambda: visit.text(".banner .reason") == "No hand is in view")
        yield visit


def camera(page: Page) -> tuple[float, float, float]:
    place = page.evaluate(f"() => {{ {SCENE} return camera.position.toArray() }}")
    return place[0], place[1], place[2]


def trail_points(page: Page) -> int:
    count: int = page.evaluate(
        f"""() => {{ {SCENE}
            let points = 0;
            scene.traverse(shape => points += shape.frustumCulled ? 0 : shape.geometry.attributes.position.count / 2);
            return points;
        }}"""
    )
    return count


def turned_links(page: Page) -> list[NDArray[np.float64]]:
    """Return how the links of the drawn robot are turned, (3, 3) each."""
    found = page.evaluate(
        f"""() => {{ {SCENE}
            const turned = [];
            scene.traverse(shape => {{ if (shape.isGroup) turned.push(shape.matrix.elements) }});
            return turned;
        }}"""
    )
    return [np.reshape(columns, (4, 4)).T[:3, :3] for columns in found]


def is_any_link_turned(page: Page, to: NDArray[np.float64]) -> bool:
    return any(np.abs(to - link).max() < 0.03 for link in turned_links(page))


def on_screen(page: Page, x: float, y: float, z: float = 0.2) -> tuple[float, float]:
    """Return where a point of the world is on the page, in its pixels."""
    place = page.evaluate(
        f"""([x, y, z]) => {{ {SCENE}
            const box = document.querySelector(".world canvas").getBoundingClientRect();
            const point = camera.position.clone().set(x, y, z).project(camera);
            return [box.left + (point.x + 1) / 2 * box.width, box.top + (1 - point.y) / 2 * box.height];
        }}""",
        [x, y, z],
    )
    return place[0], place[1]


def press(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def test_three_views_go_along_with_the_robot_and_its_way_is_drawn() -> None:
    with looking_at("empty") as visit:
        page, robot = visit.page, visit.graph.robot
        visit.steer_until(0.0, 1.0, lambda: robot.state.truth.yaw > 1.2)
        visit.steer_until(0.5, 0.0, lambda: robot.state.truth.y > 1.5)
        visit.graph.steering.release()
        visit.wait_until(lambda: abs(robot.state.linear_mps) < 0.001)
        visit.wait_until(lambda: trail_points(page) > 8)
        at = robot.state.truth

        beside = pytest.approx((at.x - 1.6, at.y - 0.7), abs=0.05)
        visit.wait_until(lambda: camera(page)[:2] == beside)  # it came along, and did not turn
        press(page, "Follow")
        visit.wait_until(lambda: camera(page)[1] < at.y - 1.2)  # behind a robot that looks along y
        press(page, "Top")
        visit.wait_until(lambda: camera(page)[2] > 10)
        assert camera(page)[:2] == pytest.approx((at.x, at.y), abs=0.05)
        right, up = on_screen(page, at.x + 1, at.y), on_screen(page, at.x, at.y + 1)
        middle = on_screen(page, at.x, at.y)
        assert right[0] > middle[0] + 10
        assert up[1] < middle[1] - 10

        press(page, "Back to start")
        visit.wait_until(lambda: abs(robot.state.truth.y) < 0.01)
        visit.wait_until(lambda: trail_points(page) <= 1)
        assert visit.troubles == []


def test_the_wheels_turn_as_the_joint_states_say() -> None:
    with looking_at("empty") as visit:
        robot = visit.graph.robot
        angles: dict[str, float] = {}

        def keep(received: Received[JointState]) -> None:
            angles.update(zip(received.message.name, received.message.position.tolist(), strict=True))

        visit.graph.transport.subscribe("test", JOINT_STATES, keep)
        visit.steer_until(0.2, 0.5, lambda: robot.state.truth.yaw > 1.0)
        visit.graph.steering.release()
        visit.wait_until(lambda: abs(robot.state.linear_mps) < 0.001)
        wheels = [joint for joint in joints(robot_description()) if joint.type == "continuous"]
        assert len({round(angles[wheel.name], 1) for wheel in wheels}) > 1  # each side its own
        for wheel in wheels:
            expected = from_rpy(wheel.rpy) @ about_axis(wheel.axis, angles[wheel.name])
            visit.wait_until(partial(is_any_link_turned, visit.page, expected))
        assert visit.troubles == []


def test_things_are_added_dragged_changed_deleted_saved_and_loaded(tmp_path: Path) -> None:
    with looking_at("empty") as visit:
        page, robot = visit.page, visit.graph.robot

        def things() -> tuple[Any, ...]:
            return robot.world.obstacles if robot.world else ()

        press(page, "Edit world")
        page.get_by_role("button", name="Add a box").click()
        visit.wait_until(lambda: len(things()) == 1)
        page.get_by_role("button", name="Add a sphere").click()
        visit.wait_until(lambda: [thing.name for thing in things()] == ["box 1", "sphere 1"])
        page.get_by_role("button", name="Delete").click()  # what was added last is chosen
        visit.wait_until(lambda: [thing.name for thing in things()] == ["box 1"])

        box = things()[0]
        page.locator(".world canvas").scroll_into_view_if_needed()
        visit.wait_until(lambda: drawn_at(page, *box.position))
        page.mouse.move(*on_screen(page, *box.position))
        page.mouse.down()
        for y in (0.5, 1.0, 1.5):
            page.mouse.move(*on_screen(page, 2.0, y))
            page.wait_for_timeout(100)
        page.mouse.up()
        visit.wait_until(lambda: things()[0].position == pytest.approx((2.0, 1.5), abs=0.15))
        visit.wait_until(lambda: drawn_at(page, *things()[0].position))

        page.get_by_label("length [m]").fill("1.5")
        visit.wait_until(lambda: things()[0].size == (1.5, 0.4, 0.4))
        page.get_by_label("x [m]").fill("0")
        page.get_by_label("y [m]").fill("0")
        page.locator(".world .message", has_text="overlaps the robot").wait_for()
        visit.wait_until(
            lambda: page.get_by_label("y [m]").input_value() != "0"
        )  # it says what is, not what was refused

        with page.expect_download() as download:
            press(page, "Save file")
        path = tmp_path / download.value.suggested_filename
        download.value.save_as(path)
        assert read_world(path) == robot.world
        saved = robot.world
        page.get_by_role("button", name="Delete").click()
        visit.wait_until(lambda: things() == ())
        page.locator(".world input[type=file]").set_input_files(path)
        visit.wait_until(lambda: robot.world == saved)

        bad = tmp_path / "bad.yaml"
        bad.write_text("obstacles: [{shape: '<b>cone</b>', name: a}]")
        page.locator(".world input[type=file]").set_input_files(bad)
        page.locator(".world .message", has_text="not <b>cone</b>").wait_for()
        assert robot.world == saved
        assert visit.troubles == []


def drawn_at(page: Page, x: float, y: float) -> bool:
    is_drawn: bool = page.evaluate(
        f"""([x, y]) => {{ {SCENE}
            return scene.children.some(shape => shape.isMesh && shape.geometry.type === "BoxGeometry"
                && Math.hypot(shape.position.x - x, shape.position.y - y) < 0.01);
        }}""",
        [x, y],
    )
    return is_drawn


def test_the_course_counts_gates_and_bumps_and_only_the_driver_edits(tmp_path: Path) -> None:
    world = tmp_path / "course.yaml"
    world.write_text(COURSE)
    with looking_at(world) as visit:
        page, robot = visit.page, visit.graph.robot
        visit.wait_until(lambda: "gates 0/3" in visit.text(".course"))
        page.locator(".lease .role", has_text="you drive").wait_for()
        visit.steer_until(0.5, 0.0, lambda: "gates 2/3" in visit.text(".course"))
        visit.steer_until(0.5, 0.0, lambda: "bumps 1" in visit.text(".course"))
        page.locator(".world .stage.bump-a").wait_for()
        visit.wait_until(lambda: red_boxes(page) == 1)
        visit.graph.steering.release()

        other = visit.another_page()
        other.set_default_timeout(PATIENCE_MS)
        other.goto(page.url)
        other.locator(".lease .role", has_text="another viewer drives").wait_for()
        press(other, "Edit world")
        other.locator(".world .message", has_text="Somebody else drives").wait_for()
        press(other, "Back to start")
        other.wait_for_timeout(500)
        assert robot.state.truth.x > 1.0
        assert not other.locator(".world .editor").is_visible()
        other.close()

        press(page, "Back to start")
        visit.wait_until(lambda: "gates 0/3" in visit.text(".course") and "0:00.0" in visit.text(".course"))
        press(page, "Edit world")
        page.get_by_label("Which world to load").click()
        page.get_by_role("option", name="slalom").click()
        page.get_by_role("button", name="Load the chosen world").click()
        visit.wait_until(lambda: robot.world == load_world("slalom"))
        visit.wait_until(lambda: "gates 0/8" in visit.text(".course"))
        assert visit.troubles == []


def red_boxes(page: Page) -> int:
    count: int = page.evaluate(
        f"""() => {{ {SCENE}
            const isRed = ({{ r, g }}) => r > 0.9 && g < 0.1;
            return scene.children.filter(shape => shape.isMesh && isRed(shape.material.color)).length;
        }}"""
    )
    return count


def test_a_page_without_the_robot_says_where_its_world_is_edited() -> None:
    site = Site()
    try:
        with a_browser() as browser:
            page = browser.new_page()
            page.set_default_timeout(PATIENCE_MS)
            page.goto(site.url)
            press(page, "Edit world")
            page.locator(".world .message", has_text="runs in another process").wait_for()
            assert not page.locator(".world .editor").is_visible()
    finally:
        site.close()


def test_what_the_scanner_sees_is_drawn() -> None:
    with looking_at("obstacles") as visit:
        dots = f"""() => {{ {SCENE}
            const found = [];
            scene.traverse(shape => shape.isPoints && found.push(...shape.geometry.attributes.position.array));
            return found;
        }}"""
        visit.wait_until(lambda: visit.page.evaluate(dots))
        seen = np.array(visit.page.evaluate(dots)).reshape(-1, 3)
        # The island ahead, whose near side is 3.25 m away.
        assert np.abs(seen[:, :2] - (3.25, 0.0)).sum(axis=1).min() < 0.05

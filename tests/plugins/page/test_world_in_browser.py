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

from handsteer.messages import JOINT_STATES, JointState
from handsteer.plugins.page.scene import about_axis, from_rpy
from handsteer.plugins.page.urdf import joints
from handsteer.robots.description import robot_description
from handsteer.robots.world import load_world, read_world
from handsteer.transports.base import Received
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.served import Site
from tests.plugins.page.visits import NEEDS_A_BROWSER, PATIENCE_MS, Visit, visiting

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


def drawn(page: Page) -> int:
    """Return how often the view was drawn."""
    count: int = page.evaluate(
        """() => getElement(Number(document.querySelector(".nicegui-scene").id.slice(1))).renderer.info.render.frame"""
    )
    return count


def draws_in_a_second(page: Page) -> int:
    before = drawn(page)
    page.wait_for_timeout(1000)
    return drawn(page) - before


def test_a_view_in_which_nothing_moves_is_hardly_drawn() -> None:
    with looking_at("empty") as visit:
        visit.wait_until(lambda: draws_in_a_second(visit.page) <= 2)  # 20 if all were drawn; 11 were on a busy machine
        visit.steer_until(0.2, 0.5, lambda: draws_in_a_second(visit.page) > 2)
        visit.graph.steering.release()
        visit.wait_until(lambda: draws_in_a_second(visit.page) <= 2)
        before = drawn(visit.page)
        visit.page.get_by_role("button", name="Follow").click()
        visit.wait_until(lambda: drawn(visit.page) > before)
        assert visit.troubles == []


@contextmanager
def editing(world: object) -> Iterator[Visit]:
    """Show the editor with ``world``."""
    with visiting("NONE:600", "/world", camera={"fps": 5}, robot={"world": str(world)}) as visit:
        visit.page.set_viewport_size({"width": 1440, "height": 900})
        name = visit.page.get_by_label("Name of the world")
        visit.wait_until(lambda: name.input_value() == Path(str(world)).stem)
        yield visit


def on_plan(page: Page, x: float, y: float) -> tuple[float, float]:
    """Return where a point of the world is on the page, in its pixels."""
    place = page.locator(".plan").evaluate(
        """(plan, [x, y]) => {
            const at = new DOMPoint(x, -y).matrixTransform(plan.getScreenCTM());
            return [at.x, at.y];
        }""",
        [x, y],
    )
    return place[0], place[1]


def drag(page: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*on_plan(page, *start))
    page.mouse.down()
    page.mouse.move(*on_plan(page, *end), steps=4)
    page.mouse.up()


def test_things_are_added_dragged_changed_deleted_saved_and_loaded(tmp_path: Path) -> None:
    with editing("empty") as visit:
        page, surroundings = visit.page, visit.graph.robot.surroundings

        def things() -> tuple[Any, ...]:
            return surroundings.world.obstacles if surroundings.world else ()

        page.get_by_role("button", name="Add a box").click()
        page.locator(".banner .headline", has_text="Stopped").wait_for()  # nothing drives it while it is edited
        visit.wait_until(lambda: len(things()) == 1)
        page.get_by_role("button", name="Add a sphere").click()
        visit.wait_until(lambda: [thing.name for thing in things()] == ["box 1", "sphere 1"])
        page.get_by_role("button", name="Delete the chosen").click()  # what was added last is chosen
        visit.wait_until(lambda: [thing.name for thing in things()] == ["box 1"])
        visit.wait_until(lambda: page.locator(".plan .thing").count() == 1)

        drag(page, things()[0].position, (2.03, 1.48))
        visit.wait_until(lambda: things()[0].position == (2.0, 1.5))  # on the grid
        page.get_by_text("snap to").click()
        page.locator(".plan .thing.chosen").wait_for()
        drag(page, (2.0, 1.5), (2.53, 1.5))
        visit.wait_until(lambda: things()[0].position[0] == pytest.approx(2.53, abs=0.03))

        page.get_by_label("length [m]").fill("1.5")
        visit.wait_until(lambda: things()[0].size == (1.5, 0.4, 0.4))
        page.get_by_label("x [m]").fill("0")
        page.get_by_label("y [m]").fill("0")
        page.locator(".bar .message", has_text="overlaps the robot").wait_for()
        visit.wait_until(
            lambda: page.get_by_label("y [m]").input_value() != "0"
        )  # it says what is, not what was refused

        page.locator(".saved", has_text="unsaved changes").wait_for()
        page.get_by_label("Name of the world").fill("My course")
        page.get_by_label("Name of the world").press("Enter")
        visit.wait_until(lambda: surroundings.world is not None and surroundings.world.name == "My course")
        visit.wait_until(lambda: "My course" in visit.text(".files .q-select"))
        with page.expect_download() as download:
            press(page, "Save file")
        page.locator(".saved", has_text="no unsaved changes").wait_for()
        path = tmp_path / download.value.suggested_filename
        download.value.save_as(path)
        assert path.name == "My course.yaml"
        assert read_world(path) == surroundings.world
        saved = surroundings.world
        page.get_by_role("button", name="Delete the chosen").click()
        visit.wait_until(lambda: things() == ())
        page.locator("input[type=file]").set_input_files(path)
        visit.wait_until(lambda: surroundings.world == saved)

        bad = tmp_path / "bad.yaml"
        bad.write_text("obstacles: [{shape: '<b>cone</b>', name: a}]")
        page.locator("input[type=file]").set_input_files(bad)
        page.locator(".bar .message", has_text="not <b>cone</b>").wait_for()
        assert surroundings.world == saved
        assert visit.troubles == []


def test_walls_and_gates_are_drawn_undone_and_made_again() -> None:
    with editing("empty") as visit:
        page, surroundings = visit.page, visit.graph.robot.surroundings

        def names() -> list[str]:
            world = surroundings.world
            return [each.name for each in (*world.obstacles, *world.gates)] if world else []

        press(page, "Wall")
        drag(page, (1.02, 1.01), (2.03, 1.1))
        visit.wait_until(lambda: names() == ["wall 1"])
        assert surroundings.world
        wall = surroundings.world.obstacles[0]
        assert (wall.position, wall.yaw, wall.extent) == ((1.5, 1.0), 0.0, (1.0, 0.1, 0.5))  # on the grid, and straight
        press(page, "Gate")
        drag(page, (1.5, 0.6), (1.5, -0.6))
        visit.wait_until(lambda: names() == ["wall 1", "gate 1"])
        drag(page, (2.0, -0.6), (2.0, 0.6))
        visit.wait_until(lambda: names() == ["wall 1", "gate 1", "gate 2"])
        assert (surroundings.world.gates[0].left, surroundings.world.gates[0].right) == (
            (1.5, 0.6),
            (1.5, -0.6),
        )
        page.get_by_label("Pass this gate earlier").click()
        visit.wait_until(lambda: names() == ["wall 1", "gate 2", "gate 1"])

        page.locator(".plan .gate.chosen", has_text="1").wait_for()
        for left in (["wall 1", "gate 1", "gate 2"], ["wall 1", "gate 1"], ["wall 1"]):
            page.keyboard.press("Control+z")
            visit.wait_until(partial(lambda left: names() == left, left))
        page.get_by_label("Undo the last change").click()
        visit.wait_until(lambda: names() == [])
        page.locator(".saved", has_text="no unsaved changes").wait_for()
        page.get_by_label("Make the change again").click()
        visit.wait_until(lambda: names() == ["wall 1"])
        page.keyboard.press("Control+Shift+Z")
        visit.wait_until(lambda: names() == ["wall 1", "gate 1"])

        page.get_by_label("Which world to load").click()
        page.get_by_role("option", name="slalom").click()
        page.get_by_role("button", name="Load the chosen world").click()
        visit.wait_until(lambda: surroundings.world == load_world("slalom"))
        visit.wait_until(lambda: page.get_by_label("Name of the world").input_value() == "slalom")
        visit.wait_until(lambda: page.locator(".plan .gate").count() == 8)
        page.get_by_label("Undo the last change").click()  # what was not saved is not lost
        visit.wait_until(lambda: names() == ["wall 1", "gate 1"])
        visit.wait_until(lambda: page.get_by_label("Name of the world").input_value() == "empty")
        page.get_by_label("Make the change again").click()
        visit.wait_until(lambda: page.locator(".plan .gate").count() == 8)
        page.get_by_label("Show the whole world").click()
        for width, height in ((1440, 900), (390, 844), (360, 740)):
            page.set_viewport_size({"width": width, "height": height})
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            for at in (0, 1):  # all is in view
                x, y = on_plan(page, *load_world("slalom").gates[-1 - at].left)
                plan = page.locator(".plan").bounding_box()
                assert plan
                assert plan["x"] <= x <= plan["x"] + plan["width"]
                assert plan["y"] <= y <= plan["y"] + plan["height"]
        assert visit.troubles == []


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
        press(other, "Back to start")
        other.wait_for_timeout(500)
        assert robot.state.truth.x > 1.0
        other.locator(".world .message", has_text="Another viewer drives").wait_for()
        other.goto(f"{page.url.rstrip('/')}/world")
        other.get_by_role("button", name="Add a box").click()
        other.locator(".bar .message", has_text="Another viewer drives").wait_for()
        assert robot.surroundings.world == read_world(world)
        other.close()

        press(page, "Back to start")
        visit.wait_until(lambda: "gates 0/3" in visit.text(".course") and "0:00.0" in visit.text(".course"))
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
            page.get_by_role("link", name="Edit world").click()
            page.locator(".bar .message", has_text="runs in another process").wait_for()
    finally:
        site.close()

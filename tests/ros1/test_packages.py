import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

from handsteer import __version__
from handsteer.config import RobotConfig
from handsteer.plugins.page.urdf import joints
from tests.ros1.launches import ROS, ros_environment, run

pytestmark = pytest.mark.ros1

PACKAGES = ["my_cam", "ros_hand_gesture_recognition", "ros_mobile_robot", "xacro"]

LAUNCHES = {
    ("my_cam", "my_cam.launch"): {"/my_camera"},
    ("ros_hand_gesture_recognition", "hand_sign.launch"): {"/hand_sign_recognition"},
    ("ros_hand_gesture_recognition", "sign_control.launch"): {
        "/my_camera",
        "/hand_sign_recognition",
        "/hand_sign_control",
    },
    ("ros_mobile_robot", "drive_robot.launch"): {"/robot", "/robot_state_publisher"},
    ("ros_mobile_robot", "mobile_robot.launch"): {"/joint_state_publisher", "/robot_state_publisher"},
    ("ros_mobile_robot", "steering.launch"): {"/steering"},
}

ARGS = {
    "my_cam.launch": {"camera_name"},
    "hand_sign.launch": {
        "subscribe_image_topic",
        "publish_gesture_topic",
        "show_image",
        "keypoint_classifier_model",
        "keypoint_classifier_label",
    },
    "sign_control.launch": {"publish_gesture_topic", "control_topic", "camera_name", "show_image"},
    "mobile_robot.launch": {"config"},
    "drive_robot.launch": {"gui", "rviz", "rvizconfig", "model", "world", "gazebo"},
    "steering.launch": {"port", "control_topic"},
}

# Debian has no Gazebo: this stands for the file that its package gazebo_ros has, with the args that it takes.
EMPTY_WORLD = """<launch>
  <arg name="paused" default="false"/> <arg name="use_sim_time" default="true"/> <arg name="gui" default="true"/>
  <param name="/use_sim_time" value="$(arg use_sim_time)"/>
  <node name="gazebo" pkg="gazebo_ros" type="gzserver"/>
</launch>"""


def nodes(*launch: str, **env: str) -> set[str]:
    return set(run("roslaunch", "--nodes", *launch, env=ros_environment(**env)).split())


def parameters(*launch: str, **env: str) -> dict[str, object]:
    dumped = yaml.safe_load(run("roslaunch", "--dump-params", *launch, env=ros_environment(**env)))
    assert isinstance(dumped, dict)
    return dumped


@pytest.mark.parametrize("package", PACKAGES)
def test_rospack_finds_the_packages_in_a_plain_folder(package: str) -> None:
    assert run("rospack", "find", package, env=ros_environment()).strip() == str(ROS / package)


@pytest.mark.parametrize("package", PACKAGES[:3])
def test_the_packages_have_the_version_of_handsteer(package: str) -> None:
    assert ET.parse(ROS / package / "package.xml").findtext("version") == __version__


@pytest.mark.parametrize("launch", LAUNCHES, ids=lambda value: value[1])
def test_launch_files_start_the_nodes_of_the_course(launch: tuple[str, str]) -> None:
    assert nodes(*launch) == LAUNCHES[launch]


@pytest.mark.parametrize("launch", LAUNCHES, ids=lambda value: value[1])
def test_launch_files_take_the_args_of_the_course_and_describe_each(launch: tuple[str, str]) -> None:
    said = run("roslaunch", "--ros-args", *launch, env=ros_environment())
    assert "Required" not in said
    described = {line.split()[0]: line.partition("): ")[2] for line in said.splitlines()[1:]}
    assert ARGS[launch[1]] <= set(described)
    assert all(described.values()), said


@pytest.mark.slow
@pytest.mark.parametrize("launch", LAUNCHES, ids=lambda value: value[1])
def test_a_namespace_takes_all_nodes_and_parameters_along(launch: tuple[str, str]) -> None:
    assert nodes(*launch, ROS_NAMESPACE="r1") == {f"/r1{node}" for node in LAUNCHES[launch]}
    assert all(name.startswith("/r1/") for name in parameters(*launch, ROS_NAMESPACE="r1"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("launch", "window"),
    [
        (("ros_mobile_robot", "drive_robot.launch"), "rviz"),
        (("ros_mobile_robot", "mobile_robot.launch"), "rviz"),
        (("ros_hand_gesture_recognition", "hand_sign.launch"), "hand_sign_view"),
        (("ros_hand_gesture_recognition", "sign_control.launch"), "hand_sign_view"),
    ],
)
def test_windows_open_where_there_is_a_display_or_they_are_asked_for(launch: tuple[str, str], window: str) -> None:
    arg = "gui" if window == "rviz" else "show_image"
    assert f"/{window}" in nodes(*launch, DISPLAY=":0")
    assert f"/{window}" in nodes(*launch, f"{arg}:=true")
    assert f"/{window}" not in nodes(*launch, f"{arg}:=false", DISPLAY=":0")


@pytest.mark.slow
def test_roslaunchs_own_words_for_a_namespace_work() -> None:
    launch = ("ros_mobile_robot", "drive_robot.launch")
    assert nodes(*launch, "__ns:=r1") == {"/r1/robot", "/r1/robot_state_publisher"}
    assert nodes(*launch, "rviz:=true", "gui:=false") == {"/robot", "/robot_state_publisher", "/rviz"}


def test_the_links_have_the_names_of_the_course() -> None:
    urdf = ET.fromstring(str(parameters("ros_mobile_robot", "mobile_robot.launch")["/robot_description"]))
    wheels = {f"{where}_wheel" for where in ("front_left", "front_right", "rear_left", "rear_right")}
    assert {"base_link", "chassis", "head", *wheels} <= {link.get("name") for link in urdf.iterfind("link")}


def test_the_recognition_is_told_by_the_parameters_that_the_courses_nodes_read() -> None:
    launch = ("ros_hand_gesture_recognition", "sign_control.launch")
    told = {
        "publish_gesture_topic": "/words",
        "show_image": False,
        "keypoint_classifier_model": "/my model.npz",
        "keypoint_classifier_label": "/labels.csv",
    }
    given = parameters(*launch, *(f"{name}:={value}" for name, value in told.items()))
    theirs = {**told, "subscribe_image_topic": "image_raw"}
    assert {name: given[f"/hand_sign_recognition/{name}"] for name in theirs} == theirs
    assert given["/hand_sign_control/publish_gesture_topic"] == "/words"


def test_the_robot_is_described_by_the_xacro_that_handsteer_simulates() -> None:
    launch = ("ros_mobile_robot", "drive_robot.launch")
    urdf = str(parameters(*launch)["/robot_description"])
    assert {joint.name for joint in joints(urdf) if joint.type == "continuous"} == _wheels()
    assert "gazebo_ros_control" not in urdf
    assert "/r1/robot_description" in parameters(*launch, ROS_NAMESPACE="r1")


@pytest.mark.slow
def test_gazebo_gets_the_same_robot_with_motors(tmp_path: Path) -> None:
    stand_in = tmp_path / "gazebo_ros"
    (stand_in / "launch").mkdir(parents=True)
    (stand_in / "package.xml").write_text("<package><name>gazebo_ros</name></package>")
    (stand_in / "launch" / "empty_world.launch").write_text(EMPTY_WORLD)
    launch = ("ros_mobile_robot", "drive_robot.launch", "gazebo:=true", "gazebo_gui:=false")
    env = {"ROS_PACKAGE_PATH": f"{ROS}:{tmp_path}"}

    assert nodes(*launch, **env) == {
        "/gazebo",
        "/robot_controller_spawner",
        "/robot_state_publisher",
        "/urdf_spawner",
    }
    given = parameters(*launch, **env)
    robot = ET.fromstring(str(given["/robot_description"]))
    plugin = robot.find("gazebo/plugin")
    assert plugin is not None
    assert plugin.get("filename") == "libgazebo_ros_control.so"
    moved = {(joint.get("name"), joint.findtext("hardwareInterface")) for joint in robot.iterfind("transmission/joint")}
    assert moved == {(wheel, "hardware_interface/VelocityJointInterface") for wheel in _wheels()}
    links = {link.get("name") for link in robot.iterfind("link")}
    assert {one.get("reference") for one in robot.iterfind("gazebo") if one.get("reference")} <= links
    side = "/robot_diff_drive_controller/{}_wheel"
    assert {*given[side.format("left")], *given[side.format("right")]} == _wheels()  # type: ignore[misc]


def test_gazebo_that_is_missing_is_named() -> None:
    done = subprocess.run(
        ["roslaunch", "--nodes", "ros_mobile_robot", "drive_robot.launch", "gazebo:=true"],
        env=ros_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert "gazebo_ros" in done.stderr


def test_gazebos_controller_has_the_limits_of_the_simulated_one() -> None:
    given = yaml.safe_load((ROS / "ros_mobile_robot" / "config" / "diffdrive.yaml").read_text())
    built_in = RobotConfig()
    assert given["wheel_separation"] == built_in.wheel_separation
    assert given["wheel_radius"] == built_in.wheel_radius
    assert given["cmd_vel_timeout"] == built_in.cmd_vel_timeout
    linear, angular = given["linear"]["x"], given["angular"]["z"]
    assert (linear["max_velocity"], linear["max_acceleration"]) == (
        built_in.max_linear,
        built_in.max_linear_acceleration,
    )
    assert (angular["max_velocity"], angular["max_acceleration"]) == (
        built_in.max_angular,
        built_in.max_angular_acceleration,
    )


# image_subscriber.py is plain rospy and needs no handsteer.
@pytest.mark.parametrize(
    "script",
    [*sorted(ROS.glob("*/scripts/[!i]*.py")), ROS / "my_cam/scripts/image_publisher.py"],
    ids=lambda path: path.name,
)
def test_a_node_without_handsteer_says_what_to_do(script: Path, tmp_path: Path) -> None:
    copied = tmp_path / "ros" / script.relative_to(ROS)
    shutil.copytree(ROS, tmp_path / "ros", symlinks=True)
    done = subprocess.run(
        [copied], env={"PATH": "/usr/bin:/bin"}, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2
    assert "make ros1" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("shell", ["bash", "sh", "dash", "zsh"])
def test_setup_can_be_sourced_twice_in_any_shell(shell: str) -> None:
    if not shutil.which(shell):
        pytest.skip(f"there is no {shell}")
    script = (
        '. ros/setup.sh; . ros/setup.sh; echo "$ROS_PACKAGE_PATH $ROS_HOSTNAME $ROS_MASTER_URI"; rospack find my_cam'
    )
    bare = {"PATH": "/usr/bin:/bin", "ROS_PACKAGE_PATH": "/mine", "ROS_HOSTNAME": "robot7"}
    done = subprocess.run(
        [shell, "-euc", script], cwd=ROS.parent, env=bare, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    settings, found = done.stdout.splitlines()
    path, host, master = settings.split()
    assert path.split(":") == [*(str(ROS / name) for name in PACKAGES[:3]), "/mine", "/usr/share", str(ROS / "xacro")]
    assert (host, master) == ("robot7", "http://localhost:11311")
    assert found == str(ROS / "my_cam")


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("catkin_make"), reason="catkin is not here: apt install catkin")
def test_catkin_make_builds_and_installs_the_packages(tmp_path: Path) -> None:
    source = tmp_path / "src"
    source.mkdir()
    for package in PACKAGES:
        (source / package).symlink_to(ROS / package)
    env = ros_environment()
    subprocess.run(
        ["catkin_make", "-C", tmp_path, "install", "-DPYTHON_EXECUTABLE=/usr/bin/python3"],
        env=env,
        check=True,
        capture_output=True,
        timeout=300,
    )
    for space, folder in (("devel", "src"), ("install", "install/share")):
        script = (
            f". {tmp_path}/{space}/setup.sh; rospack find my_cam; roslaunch --nodes ros_mobile_robot drive_robot.launch"
        )
        clean = {name: value for name, value in env.items() if name != "ROS_PACKAGE_PATH"}
        said = run("bash", "-c", script, env=clean).split()
        assert said == [f"{tmp_path}/{folder}/my_cam", "/robot", "/robot_state_publisher"]


def _wheels() -> set[str]:
    return {f"{where}_wheel_joint" for where in ("front_left", "front_right", "rear_left", "rear_right")}

"""Builds the message package tf2_msgs, without which there is no /tf, in .venv/ros2, whose wheels lack it.

Runs on the Python there, for scripts/setup-ros2. The generators of ROS 2, which are among the wheels, write the code,
and a C++ compiler makes one extension module of it, with the type supports that Fast DDS, the wheels' middleware, uses:
its own and introspection.
If something is missing or fails, tf2_msgs is not there afterwards, and the exit code is 1.
"""

import contextlib
import importlib
import io
import logging
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

import numpy as np
import rclpy
from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_typesupport_c.cli import GenerateCTypesupport
from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

PACKAGE = "tf2_msgs"
MESSAGE = "TFMessage"
FIELDS = "geometry_msgs/TransformStamped[] transforms\n"
NEEDED = ("builtin_interfaces", "geometry_msgs", "std_msgs")
TYPE_SUPPORTS = ("rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c")
LIBRARIES = ("rosidl_generator_c", "rosidl_generator_py", *TYPE_SUPPORTS)
EXTENSION = f"{PACKAGE}_s__rosidl_typesupport_c"
PREFIX = Path(sys.prefix)
PYTHON_HEADERS = Path(sysconfig.get_path("include"))


def main() -> None:
    home = Path(sysconfig.get_path("purelib"), PACKAGE)
    shutil.rmtree(home, ignore_errors=True)
    if not shutil.which("g++"):
        sys.exit("ROS 2 set-up: /tf is left out: there is no C++ compiler: install g++ and repeat make ros2")
    if not (PYTHON_HEADERS / "Python.h").exists():
        sys.exit(
            f"ROS 2 set-up: /tf is left out: there is no {PYTHON_HEADERS}/Python.h: install Python's headers "
            "(on Debian and Ubuntu the package python3-dev) and repeat make ros2"
        )
    with tempfile.TemporaryDirectory(dir=PREFIX) as folder:
        generate(Path(folder))
        compile_extension(Path(folder))
        Path(folder, PACKAGE).rename(home)
    for support in TYPE_SUPPORTS:  # libraries of their own in other packages; they are loaded by these names
        link = PREFIX / "lib" / f"lib{PACKAGE}__{support}.so"
        link.unlink(missing_ok=True)
        link.symlink_to(home / f"{EXTENSION}.so")
    try:
        rclpy.init()
        message = getattr(importlib.import_module(f"{PACKAGE}.msg"), MESSAGE)
        rclpy.create_node("setup").create_publisher(message, "tf", 1)
        rclpy.shutdown()
    except Exception:
        shutil.rmtree(home)  # rather no /tf than a robot that cannot start
        raise


def generate(folder: Path) -> None:
    """Write the Python package to ``folder``/tf2_msgs, and the C code to ``folder``/*/tf2_msgs."""
    os.environ["AMENT_PREFIX_PATH"] = sys.prefix  # where the generators find their templates
    source = folder / "msg" / f"{MESSAGE}.msg"
    source.parent.mkdir()
    source.write_text(FIELDS, encoding="utf-8")
    generators = {  # names of folders
        "c": GenerateC("c"),
        "fastrtps": GenerateFastRTPSCTypesupport("fastrtps_c"),
        "introspection": GenerateIntrospectionCTypesupport("introspection_c"),
        "dispatch": GenerateCTypesupport("c", typesupport_implementations=TYPE_SUPPORTS),
        ".": GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"]),
    }
    with contextlib.redirect_stdout(io.StringIO()):  # it reports each file
        idl = convert_msg_to_idl(folder, PACKAGE, source.relative_to(folder), source.parent)
    logging.disable(logging.WARNING)  # the wheels register each generator twice
    shares = [PREFIX / "share" / package for package in NEEDED]
    for name, generator in generators.items():
        output = folder / name / PACKAGE
        generator.generate(PACKAGE, [f"{folder}:{idl.relative_to(folder)}"], shares, output_path=output)
    (folder / PACKAGE / "__init__.py").touch()


def compile_extension(folder: Path) -> None:
    """Compile all C and C++ code in ``folder`` into the extension module that rclpy looks for."""
    ros = PREFIX / "include"
    includes = [
        folder / "c",
        folder / "fastrtps",
        folder / "introspection",
        ros,
        *sorted(ros.iterdir()),
        PYTHON_HEADERS,
        np.get_include(),
    ]
    # gcc tells the languages by the files' names, and has C++ where there is a g++; which would take all for C++.
    command = ["gcc", "-shared", "-fPIC", "-O2", "-Wl,-z,now", "-o", str(folder / PACKAGE / f"{EXTENSION}.so")]
    command += [f"-I{include}" for include in includes]
    command += map(str, sorted([*folder.rglob("*.c"), *folder.rglob("*.cpp")]))
    command += [f"-L{PREFIX / 'lib'}", *(f"-lgeometry_msgs__{library}" for library in LIBRARIES), "-lstdc++"]
    if subprocess.run(command, check=False).returncode:
        sys.exit("ROS 2 set-up: /tf is left out: tf2_msgs could not be compiled; the compiler's messages are above")


if __name__ == "__main__":
    main()

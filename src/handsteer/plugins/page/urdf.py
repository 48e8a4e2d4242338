"""The shapes and joints to draw, in the URDF of any robot."""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass

from handsteer.errors import WorldError
from handsteer.robots import Shape

_GREY = (0.6, 0.6, 0.6, 1.0)

Vector = tuple[float, float, float]

_LONGEST, _LONGEST_SHOWN = 5_000_000, 100


@dataclass(frozen=True)
class Visual:
    """One visual shape of a link.

    Attributes:
        link: Name of the link.
        shape: A cylinder's axis is its own z.
        size: Extent along its own x, y and z in metres: a sphere has its diameter three times.
        xyz: Its centre in the link's frame, in metres.
        rpy: Its roll, pitch and yaw in the link's frame, in radians, about fixed axes (REP 103).
        rgba: Red, green, blue and opacity, 0 to 1; grey if the description has no colour.
    """

    link: str
    shape: Shape
    size: Vector
    xyz: Vector
    rpy: Vector
    rgba: tuple[float, float, float, float]


@dataclass(frozen=True)
class Joint:
    """A joint between two links.

    Attributes:
        name: As in ``/joint_states``.
        type: ``fixed``, ``continuous``, ``revolute``, ``prismatic``, ...
        parent: Name of the parent link.
        child: Name of the child link.
        xyz: Origin of the child's frame in the parent's, at joint position 0, in metres.
        rpy: Its rotation there, in radians, about fixed axes.
        axis: The axis of rotation or translation, in the child's frame.
    """

    name: str
    type: str
    parent: str
    child: str
    xyz: Vector
    rpy: Vector
    axis: Vector


def visuals(urdf: str) -> list[Visual]:
    """Return the boxes, cylinders and spheres of a robot description, without meshes.

    Raises:
        WorldError: It is not a robot description, or a number in it is missing or wrong.
    """
    robot = _parse(urdf)
    colours = {material.get("name", ""): _rgba(material) for material in robot.iterfind("material")}
    return [
        _visual(link.get("name", ""), visual, geometry, colours)
        for link in robot.iterfind("link")
        for visual in link.iterfind("visual")
        for geometry in visual.iterfind("geometry/*")
        if geometry.tag in _SIZES
    ]


def joints(urdf: str) -> list[Joint]:
    """Return the joints of a robot description, which form the tree of its links.

    Raises:
        WorldError: It is not a robot description, or a part of a joint is missing or wrong.
    """
    return [_joint(element) for element in _parse(urdf).iterfind("joint")]


def _parse(urdf: str) -> ET.Element:
    if len(urdf) > _LONGEST:
        raise WorldError(f"robot description: has {len(urdf)} characters, and should have at most {_LONGEST}")
    if "<!DOCTYPE" in urdf:  # its entities may expand to gigabytes
        raise WorldError("robot description: document types are not supported: remove <!DOCTYPE")
    try:
        robot = ET.fromstring(urdf)
    except (ET.ParseError, ValueError) as error:
        raise WorldError(f"robot description: not valid XML: {str(error)[:_LONGEST_SHOWN]}") from None
    if robot.tag != "robot":
        raise WorldError(f"robot description: expected <robot> at the top, found <{robot.tag[:_LONGEST_SHOWN]}>")
    return robot


def _visual(
    link: str, visual: ET.Element, geometry: ET.Element, colours: dict[str, tuple[float, float, float, float] | None]
) -> Visual:
    shape, size = _SIZES[geometry.tag](geometry)
    xyz, rpy = _origin(visual)
    material = visual.find("material")
    rgba = None if material is None else _rgba(material) or colours.get(material.get("name", ""))
    return Visual(link, shape, size, xyz, rpy, rgba or _GREY)


def _joint(element: ET.Element) -> Joint:
    name = element.get("name", "")
    parent, child = element.find("parent"), element.find("child")
    if parent is None or child is None:
        raise WorldError(f"robot description: joint {name[:_LONGEST_SHOWN]!r} needs a <parent> and a <child>")
    axis = element.find("axis")
    xyz, rpy = _origin(element)
    return Joint(
        name=name,
        type=element.get("type", "fixed"),
        parent=parent.get("link", ""),
        child=child.get("link", ""),
        xyz=xyz,
        rpy=rpy,
        axis=(1.0, 0.0, 0.0) if axis is None else _vector(axis, "xyz", "1 0 0"),
    )


def _origin(element: ET.Element) -> tuple[Vector, Vector]:
    origin = element.find("origin")
    if origin is None:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return _vector(origin, "xyz", "0 0 0"), _vector(origin, "rpy", "0 0 0")


def _box(geometry: ET.Element) -> tuple[Shape, Vector]:
    return "box", _vector(geometry, "size")


def _cylinder(geometry: ET.Element) -> tuple[Shape, Vector]:
    (radius,), (length,) = _numbers(geometry, "radius", 1), _numbers(geometry, "length", 1)
    return "cylinder", (2 * radius, 2 * radius, length)


def _sphere(geometry: ET.Element) -> tuple[Shape, Vector]:
    (radius,) = _numbers(geometry, "radius", 1)
    return "sphere", (2 * radius, 2 * radius, 2 * radius)


_SIZES = {"box": _box, "cylinder": _cylinder, "sphere": _sphere}


def _rgba(material: ET.Element) -> tuple[float, float, float, float] | None:
    colour = material.find("color")
    if colour is None:
        return None
    red, green, blue, opacity = _numbers(colour, "rgba", 4)
    return red, green, blue, opacity


def _vector(element: ET.Element, attribute: str, default: str = "") -> Vector:
    x, y, z = _numbers(element, attribute, 3, default)
    return x, y, z


def _numbers(element: ET.Element, attribute: str, count: int, default: str = "") -> list[float]:
    text = element.get(attribute, default)
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(math.isfinite(number) for number in numbers):
        wanted = "a number" if count == 1 else f"{count} numbers"
        raise WorldError(
            f"robot description: {attribute} of <{element.tag}> must be {wanted}, not {text[:_LONGEST_SHOWN]!r}"
        )
    return numbers

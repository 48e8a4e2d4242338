"""Draws the pictures of docs/signs.md: the virtual hand with each sign, and shapes that are not a sign."""

from pathlib import Path

import cv2
import numpy as np

from handsteer.plugins.virtual_hand.kinematics import angles_of, pose_skeleton
from handsteer.plugins.virtual_hand.poses import HandPose, Pinhole, View, sign_pose
from handsteer.plugins.virtual_hand.renderer import Look, make_background, render
from handsteer.recognition.recognizer import Recognizer
from handsteer.types import NONE, SIGNS

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures"
SIDE = 240
CLOSED = {"mcp": 76, "pip": 96, "dip": 52}
STRAIGHT = {"mcp": 3, "pip": 5, "dip": 3}
FINGERS = ("index", "middle", "ring", "little")
ACROSS = {"spread": 9, "opposition": 45, "mcp": 32, "ip": 62}
OUT = {"spread": 58, "opposition": 12, "mcp": -6, "ip": -14}
ROUND = {"spread": 28, "opposition": 45, "mcp": 5, "ip": 20}
BENT = {"mcp": 50, "pip": 60, "dip": 35}
HALF = {"mcp": 42, "pip": 68, "dip": 38}


def shape(*straight: str, thumb: dict[str, int], roll: float = 0.0, **fingers: dict[str, int]) -> HandPose:
    """Return a right hand with its palm to the camera; fingers that are not given are closed."""
    degrees = {f"thumb_{joint}": angle for joint, angle in thumb.items()}
    for finger in FINGERS:
        joints = fingers.get(finger, STRAIGHT if finger in straight else CLOSED)
        degrees |= {f"{finger}_{joint}": angle for joint, angle in joints.items()}
    return HandPose(angles_of(**degrees), View(yaw=0.15, roll=np.radians(roll), position=(0.0, 0.0, 0.55)))


OTHERS = {
    "index sideways": shape("index", thumb=ACROSS, roll=90),
    "thumb up": shape(thumb=OUT, roll=-65),
    "thumb down": shape(thumb=OUT, roll=115),
    "L": shape("index", thumb=OUT),
    "peace": shape("index", "middle", thumb=ACROSS),
    "three": shape("index", "middle", "ring", thumb=ACROSS),
    "four": shape(*FINGERS, thumb=ACROSS),
    "OK": shape("middle", "ring", "little", thumb=ROUND, index=BENT),
    "horns": shape("index", "little", thumb=ACROSS),
    "call": shape("little", thumb=OUT),
    "half open": shape(thumb=ROUND, index=HALF, middle=HALF, ring=HALF, little=HALF),
    "hanging": shape(*FINGERS, thumb=OUT, roll=180),
}


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    signs = {sign: sign_pose(sign) for sign in SIGNS}
    for name, poses in (("signs.jpg", signs), ("no-signs.jpg", OTHERS)):
        tiles = [tile(label, pose) for label, pose in poses.items()]
        rows = [np.hstack(tiles[first : first + 6]) for first in range(0, len(tiles), 6)]
        cv2.imwrite(str(FOLDER / name), np.vstack(rows), [cv2.IMWRITE_JPEG_QUALITY, 88])


def tile(label: str, pose: HandPose) -> np.ndarray:
    """Return a mirrored picture of a hand, with its true and its recognised sign."""
    camera = Pinhole.webcam(640, 480)
    placement = pose.view.placement("Right")
    picture = render(pose_skeleton(pose.angles), placement, camera, Look(), make_background("plain", 640, 480))
    recognition = Recognizer().recognize(picture)
    place = recognition.hand.pixels[:, :2] if recognition.hand else np.array([[320.0, 240.0]])
    middle = ((place.min(axis=0) + place.max(axis=0)) / 2).clip(SIDE / 2, (640 - SIDE / 2, 480 - SIDE / 2)).astype(int)
    left, top = middle - SIDE // 2
    cut = np.ascontiguousarray(picture[top : top + SIDE, left : left + SIDE][:, ::-1])
    seen = recognition.seen if recognition.seen != NONE else "none"
    for text, y, colour in ((label, 20, (255, 255, 255)), (seen, SIDE - 10, (120, 230, 120))):
        for ink, thickness in (((0, 0, 0), 3), (colour, 1)):
            cv2.putText(cut, text, (8, y), cv2.FONT_HERSHEY_SIMPLEX, 0.55, ink, thickness, cv2.LINE_AA)
    return cut


if __name__ == "__main__":
    main()

"""Trains the hand landmark model for second opinions, from which ``hand_landmark_second.tflite`` is made.

MediaPipe's landmark model (the teacher) sees hands in colour, as they are and mirrored; a copy of it learns to see the
same in them without colours, and what the shipped classifier makes of it. With colours, too, it errs in other pictures
than the teacher does. Its size and speed stay as they are.

Run it with the photos that the tables of docs/signs.md call tuning, in handsteer's environment with PyTorch installed,
then measure the ranges of the new model's values, and convert it to 8-bit integers as ``make landmark-model`` does::

    cd ../shared/data
    python .../scripts/distilled_models/second_landmark.py hagrid-dev photos --target second.tflite
    python .../scripts/landmark_model/ranges.py hagrid-dev photos --second second.tflite
    .../quantizer/bin/python .../scripts/landmark_model/build.py second.tflite --second

Training does not give the same file byte for byte: PyTorch's sums differ between processors, and the number of steps
with time. ``make bench-signs`` says whether another one is better. The shipped file had 4,200 steps: 2,400 with an
earlier form of this program, without rendered hands and the classifier, and 52 minutes more with ``--start``.
"""

import argparse
import math
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import torch
from distill import distilled, tensor
from network import Network
from numpy.typing import NDArray
from torch.nn import functional

from handsteer.config import LandmarksConfig
from handsteer.plugins.teach.evaluation.labels import read_photo_labels
from handsteer.plugins.teach.evaluation.views import View
from handsteer.plugins.teach.synthetic.fit import part_of
from handsteer.plugins.teach.synthetic.shapes import fist, index_down, index_up, random_shapes, thumb_out
from handsteer.plugins.virtual_hand.kinematics import ANGLES, pose_joints, pose_skeleton
from handsteer.plugins.virtual_hand.poses import Pinhole
from handsteer.plugins.virtual_hand.poses import View as RenderedView
from handsteer.plugins.virtual_hand.renderer import SKINS, Look, make_background, render
from handsteer.recognition.features import BONE_ENDS, KNUCKLES, PAIRS
from handsteer.recognition.landmark_models import find_model
from handsteer.recognition.landmarker import MediaPipeLandmarker
from handsteer.recognition.regions import Roi, from_landmarks
from handsteer.recognition.shipped_signs import load_model
from handsteer.types import FORWARD, GO, SIGNS, TURN_LEFT, TURN_RIGHT

Image = NDArray[Any]
"""(height, width, 3) BGR, 0 to 255."""

_SIDE: Final = 224
_BATCH: Final = 16
_RENDERED: Final = 3700
_RENDERED_SHARE: Final = 0.2
_WEIGHTS: Final = {FORWARD: 1.8, GO: 1.3, TURN_LEFT: 1.6, TURN_RIGHT: 1.6, "like": 1.5, "dislike": 1.5}
"""How often a photo is used, by its sign or kind, compared with the others: more of what is missed most in grey."""
_LUMA: Final = np.array([0.114, 0.587, 0.299], np.float32)
"""Share of blue, green and red in the grey of ITU-R BT.601, which cameras and OpenCV use."""


def main() -> None:
    parser = argparse.ArgumentParser(description="Train the hand landmark model for second opinions.")
    parser.add_argument("folders", type=Path, nargs="+", help="photos of people, with an index.csv")
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--start", type=Path, help="a model of an earlier run, with float32 weights, to train further")
    parser.add_argument("--target", type=Path, required=True, help="the model with float32 weights")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    torch.manual_seed(0)
    hands, classifier = Hands(options.folders, seed=5), Classifier()
    content = find_model("hand_landmark_full.tflite").read_bytes()
    start = options.start.read_bytes() if options.start else None
    model = distilled(
        content, lambda teacher, learner: _loss(teacher, learner, hands, classifier), options.minutes, start
    )
    options.target.write_bytes(model)


class Hands:
    """Makes the landmark model's pictures from the photos of the tuning part of ``folders``, and of rendered hands.

    Args:
        folders: Folders of photos with an ``index.csv``.
        seed: Of all that is random.
    """

    def __init__(self, folders: list[Path], seed: int) -> None:
        self._random = np.random.default_rng(seed)
        landmarker = MediaPipeLandmarker(LandmarksConfig(model="full"))
        self._images: list[Image] = []
        self._regions: list[tuple[Image, Roi]] = []
        weights = []
        for photo in (each for folder in folders for each in read_photo_labels(folder, SIGNS)):
            if part_of(photo.path, photo.person_set) != "tune":
                continue
            image = cv2.imread(str(photo.path))
            assert image is not None, photo.path
            seen = View().picture(np.asarray(image, np.uint8))
            self._images.append(seen)
            landmarker.reset()
            for hand in landmarker.detect(seen):
                self._regions.append((seen, from_landmarks(hand.pixels[:, :2])))
                weights.append(_WEIGHTS.get(photo.truth or "", 1.0) * _WEIGHTS.get(photo.kind, 1.0))
        self._weights = np.array(weights) / sum(weights)
        self._rendered = [_rendered(angles, self._random) for angles in _shapes(_RENDERED, self._random)]

    def colour(self) -> Image:
        """Return a hand, in a region about as the landmarker gives it, or in one of ten any part of a photo."""
        random = self._random
        kind = random.random()
        if kind < 0.1:
            image = self._images[random.integers(len(self._images))]
            height, width = image.shape[:2]
            side = math.exp(random.uniform(math.log(40), math.log(min(height, width))))
            region = Roi(random.uniform(0, width), random.uniform(0, height), side, random.uniform(-math.pi, math.pi))
        else:
            image, own = (
                self._rendered[random.integers(len(self._rendered))]
                if kind < 0.1 + _RENDERED_SHARE
                else self._regions[random.choice(len(self._regions), p=self._weights)]
            )
            side = own.side * math.exp(random.normal(0.06, 0.16))
            if random.random() < 0.1:
                side *= random.uniform(1.2, 1.7)
            x, y = random.normal(0, 0.06, 2) * own.side
            region = Roi(own.center_x + x, own.center_y + y, side, own.rotation + random.normal(0, 0.25))
        picture: Image = region.crop(image, _SIDE, cv2.BORDER_REPLICATE)
        if random.random() < 0.6:
            # Sheared and of other proportions, they are other people's.
            matrix, middle = np.eye(2) + random.normal(0, 0.07, (2, 2)), np.full(2, _SIDE / 2)
            moved = np.column_stack([matrix, middle - matrix @ middle])
            picture = cv2.warpAffine(picture, moved, (_SIDE, _SIDE), borderMode=cv2.BORDER_REPLICATE)
        return np.ascontiguousarray(picture[:, :: -1 if random.random() < 0.5 else 1])

    def grey(self, picture: Image) -> Image:
        """Return ``picture`` without colours, as one of several cameras shows it, in other light, blurred or noisy."""
        random = self._random
        shares = _LUMA if random.random() < 0.75 else random.dirichlet([1, 2, 2]).astype(np.float32)
        grey: Image = picture.astype(np.float32) @ shares
        if random.random() < 0.5:
            grey = 255 * np.power(np.clip(grey, 0, 255) / 255, math.exp(random.uniform(-0.6, 0.6)))
        if random.random() < 0.3:
            contrast = random.uniform(0.4, 1.2)
            grey = grey * contrast + random.uniform(0, 255 * max(0, 1 - contrast))
        if random.random() < 0.25:
            grey = cv2.GaussianBlur(grey, (0, 0), random.uniform(0.3, 1.6))
        if random.random() < 0.3:
            grey = grey + random.normal(0, random.uniform(1, 10), grey.shape).astype(np.float32)
        return np.repeat(np.clip(np.round(grey), 0, 255)[..., None], 3, axis=2)


def _shapes(count: int, random: np.random.Generator) -> NDArray[Any]:
    """Return the joint angles of ``count`` hands: a half shows signs, the others anything."""
    signs = (index_down, index_down, index_up, fist, thumb_out)
    made = [random_shapes(count, random)[: count // 2], *(sign(count // 10, random) for sign in signs)]
    angles = np.concatenate(made)
    for name, sd_deg in (("wrist_flexion", 25), ("wrist_deviation", 12)):
        angles[:, ANGLES.index(name)] += np.radians(random.normal(0, sd_deg, len(angles)))
    return angles


def _rendered(angles: NDArray[Any], random: np.random.Generator) -> tuple[Image, Roi]:
    """Return a picture of a hand with these joint angles, cut out of a room, and its region."""
    camera = Pinhole.webcam(640, 480)
    facing_deg = 180 * int(random.integers(2))
    yaw, pitch = np.radians(random.normal((facing_deg, 0), (25, 22))).tolist()
    x, y = random.normal(0, 0.03, 2).tolist()
    distance_m = math.exp(random.uniform(math.log(0.32), math.log(0.9)))
    seen = RenderedView(yaw, pitch, random.uniform(-math.pi, math.pi), (x, y, distance_m))
    placement = seen.placement("Right" if random.random() < 0.5 else "Left")
    look = Look(
        skin=str(random.choice(list(SKINS))),
        sleeve=bool(random.integers(2)),
        light=(random.uniform(-0.9, 0.9), random.uniform(-1, 0.2), -0.8),
        brightness=random.uniform(0.6, 1.15),
    )
    room = make_background(str(random.choice(["plain", "cluttered"])), 640, 480, int(random.integers(1000)))
    image = render(pose_skeleton(angles), placement, camera, look, room)
    region = from_landmarks(
        np.asarray(camera.project(placement.apply(pose_joints(angles[None])[0]))[:, :2], np.float64)
    )
    side = int(np.clip(1.9 * region.side, 80, 480))
    left, top = (
        int(np.clip(at - side / 2, 0, most - side)) for at, most in ((region.center_x, 640), (region.center_y, 480))
    )
    cut = image[top : top + side, left : left + side].copy()
    return cut, Roi(region.center_x - left, region.center_y - top, region.side, region.rotation)


class Classifier:
    """The shipped classifier of shapes, through which gradients pass."""

    def __init__(self) -> None:
        network = load_model().network
        self._mean, self.scale = _floats(network.mean), _floats(network.scale)
        self._layers = [(_floats(a), _floats(b)) for a, b in zip(network.weights, network.biases, strict=True)]

    def features(self, points: torch.Tensor, world: torch.Tensor) -> torch.Tensor:
        """Return what :func:`handsteer.recognition.features.shape_features` does, (n, COUNT)."""
        pixels, space = points.view(-1, 21, 3)[..., :2], world.view(-1, 21, 3)
        palm = (space[:, list(KNUCKLES)] - space[:, :1]).norm(dim=2).mean(1).clamp(min=0.02)[:, None]
        flat = space[..., :2] - space[..., :2].mean(1, keepdim=True)
        image = pixels - pixels.mean(1, keepdim=True)
        scale = flat.square().sum((1, 2)) / image.square().sum((1, 2)).clamp(min=1e-6)
        image = image * scale.clamp(min=1e-12).sqrt()[:, None, None]
        far, near = (torch.tensor(each) for each in BONE_ENDS)
        bones = space[:, far] - space[:, near]
        bones = (bones / (bones.square().sum(2, keepdim=True) + 1e-9).sqrt()).view(-1, 5, 4, 3)
        # At 0 and 180 degrees the derivative is infinite.
        bends = torch.arccos((bones[:, :, 1:] * bones[:, :, :-1]).sum(3).clamp(-0.9995, 0.9995)).reshape(-1, 15)
        normal = torch.cross(space[:, 5] - space[:, 0], space[:, 17] - space[:, 0], dim=1)
        facing = (normal[:, 2].abs() / normal.norm(dim=1).clamp(min=1e-9))[:, None]
        return torch.cat([bends, _distances(space) / palm, _distances(image) / palm, facing], 1).clamp(-5, 5)

    def scores(self, features: torch.Tensor) -> torch.Tensor:
        """Return the logarithms of the likelihoods of the shapes, (n, shapes)."""
        values = (features - self._mean) * self.scale
        for number, (weights, biases) in enumerate(self._layers):
            values = (torch.tanh(values) if number else values) @ weights + biases
        return torch.log_softmax(values, 1)


def _distances(points: torch.Tensor) -> torch.Tensor:
    return ((points[:, PAIRS[:, 0]] - points[:, PAIRS[:, 1]]).square().sum(2) + 1e-9).sqrt()


def _floats(values: NDArray[Any]) -> torch.Tensor:
    return torch.tensor(np.asarray(values, np.float32))


def _loss(teacher: Network, learner: Network, hands: Hands, classifier: Classifier) -> torch.Tensor:
    colour = [hands.colour() for _ in range(_BATCH)]
    with torch.no_grad():
        points, presence, rightness, world = _seen_both_ways(teacher, tensor(colour))
        features = classifier.features(points, world)
        scores = classifier.scores(features)
    given_points, given_presence, given_rightness, given_world = learner(tensor([hands.grey(each) for each in colour]))
    # What the teacher is not sure of is not learnt, apart from how sure it is.
    counted = (2 * presence - 1).clamp(min=0) / _BATCH
    places = points.view(-1, 21, 3)[..., :2]
    size = (places.amax(1) - places.amin(1)).amax(1, keepdim=True).clamp(min=40)
    depth_counts_less = torch.tensor([1.0, 1.0, 0.4] * 21)
    off = functional.smooth_l1_loss(
        10 * given_points * depth_counts_less / size, 10 * points * depth_counts_less / size, reduction="none", beta=0.3
    )
    off_in_space = functional.smooth_l1_loss(50 * given_world, 50 * world, reduction="none", beta=0.3)
    loss: torch.Tensor = ((off + off_in_space).mean(1, keepdim=True) * counted).sum()
    given_features = classifier.features(given_points, given_world)
    off_in_shape = functional.smooth_l1_loss(
        given_features * classifier.scale, features * classifier.scale, reduction="none", beta=0.5
    )
    misread = functional.kl_div(classifier.scores(given_features), scores, reduction="none", log_target=True)
    loss = loss + ((0.3 * off_in_shape.mean(1) + 0.08 * misread.sum(1))[:, None] * counted).sum()
    loss = loss + functional.binary_cross_entropy_with_logits(given_presence.clamp(-30, 30), presence)
    return loss + 0.2 * functional.binary_cross_entropy_with_logits(given_rightness.clamp(-30, 30), rightness)


def _seen_both_ways(
    teacher: Network, pictures: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return points, presence, rightness and world points: means of both images, of the surer one more."""
    points, presence, rightness, world = teacher(pictures)
    other_points, other_presence, other_rightness, other_world = teacher(pictures.flip(3))
    mirror = torch.tensor([-1.0, 1.0, 1.0] * 21)
    other_points = other_points * mirror + torch.tensor([float(_SIDE), 0.0, 0.0] * 21)
    one, other = torch.sigmoid(presence), torch.sigmoid(other_presence)
    share = one**8 / (one**8 + other**8).clamp(min=1e-6)

    def mixed(first: torch.Tensor, second: torch.Tensor) -> torch.Tensor:
        return share * first + (1 - share) * second

    return (
        mixed(points, other_points),
        0.5 * torch.maximum(one, other) + 0.5 * mixed(one, other),
        mixed(torch.sigmoid(rightness), torch.sigmoid(-other_rightness)),
        mixed(world, other_world * mirror),
    )


if __name__ == "__main__":
    main()

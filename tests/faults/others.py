"""Rows in which other programs speak on our topics: numbers that are none, broken pictures, second publishers."""

import math
from collections.abc import Iterator

import numpy as np

from handsteer.images import image_message
from handsteer.messages import (
    CMD_VEL,
    HAND_SIGN,
    IMAGE_RAW,
    STEERING_CMD_VEL,
    STOP,
    Bool,
    Header,
    Image,
    String,
    Time,
    twist,
)
from tests.faults.chain import SPEED_MPS, Chain
from tests.faults.row import Row, lower_and_silence, publish_for_ever, silence, unfrozen


def others() -> Iterator[Row]:
    """Return all of them."""
    yield from _values()
    yield from _seconds()


def _values() -> Iterator[Row]:
    for word, number in (("NaN", math.nan), ("infinity", math.inf)):

        def steer(chain: Chain, number: float = number) -> None:
            chain.page.holds_stick = False
            publish_for_ever(chain, STEERING_CMD_VEL, lambda: twist(number, number))

        def command(chain: Chain, number: float = number) -> None:
            chain.freeze("control")
            publish_for_ever(chain, CMD_VEL, lambda: twist(SPEED_MPS, number))

        yield Row("/steering/cmd_vel", f"{word}, from another node; then the hand is lowered", steer, lower_and_silence)
        yield Row(
            CMD_VEL.name, f"{word} in one field, from another node; the control is frozen", command, unfrozen("control")
        )
    for words, text in (
        ("an unknown word", "Dance"),
        ("an empty text", ""),
        ("a text of 100,000 letters", "F" * 10**5),
    ):

        def sign(chain: Chain, text: str = text) -> None:
            chain.freeze("recognition")
            publish_for_ever(chain, HAND_SIGN, lambda: String(data=text))
            chain.run(0.5)

        yield Row(
            HAND_SIGN.name,
            f"{words}, repeated by another node; the recognition is frozen; then it ends",
            sign,
            unfrozen("recognition"),
            silence,
        )
    header = Header(stamp=Time(0, 0), frame_id="camera")
    whole = image_message(np.zeros((48, 64, 3), np.uint8), header)
    for words, image in (
        ("has no size", Image(header, 0, 0, "bgr8", 0, 0, np.zeros(0, np.uint8))),
        ("is truncated", Image(header, 48, 64, "bgr8", 0, 192, whole.data[:99])),
        ("has an unknown encoding", Image(header, 48, 64, "purple8", 0, 192, whole.data)),
    ):

        def picture(chain: Chain, image: Image = image) -> None:
            chain.camera.fail("silent")
            publish_for_ever(chain, IMAGE_RAW, lambda: image)

        def over(chain: Chain) -> None:
            silence(chain)
            chain.camera.recover()

        yield Row(IMAGE_RAW.name, f"every picture {words}", picture, over)


def _seconds() -> Iterator[Row]:
    def drive(chain: Chain) -> None:
        chain.show()
        chain.run(0.5)
        publish_for_ever(chain, CMD_VEL, lambda: twist(SPEED_MPS, 0.0))
        chain.run(0.5)

    yield Row(CMD_VEL.name, "a second publisher drives, the hand is lowered; then it stops", drive, end_reason=silence)

    def show(chain: Chain) -> None:
        chain.show()
        publish_for_ever(chain, HAND_SIGN, lambda: String(data="Forward"))

    yield Row(
        HAND_SIGN.name,
        "a second publisher sends Forward, the hand is lowered; then it stops",
        show,
        end_reason=silence,
    )

    def frozen_beside(chain: Chain) -> None:
        last = chain.hand.read().image
        chain.show()
        stamp = chain.clock.stamp
        publish_for_ever(chain, IMAGE_RAW, lambda: image_message(last, Header(stamp(chain.clock.now()), "camera")))

    yield Row(
        IMAGE_RAW.name,
        "a second camera repeats one picture of Forward, the hand is lowered",
        frozen_beside,
        silence,
    )

    def contradict(chain: Chain) -> None:
        chain.steering.halt()
        publish_for_ever(chain, STOP, lambda: Bool(data=False), every_s=0.13)

    def over(chain: Chain) -> None:
        silence(chain)
        chain.steering.reset()

    yield Row(STOP.name, "Stop from the page; another node repeats false", contradict, over)

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from handsteer.cameras.files import SensorNoise
from handsteer.cameras.freshness import Freshness
from handsteer.images import jpeg_message, jpeg_picture
from handsteer.messages import Header, Time

Picture = NDArray[np.uint8]
DT_S = 1 / 30
BOX = (200, 120, 310, 260)
TEXTURE = np.random.default_rng(0).integers(0, 250, (48, 64, 3), dtype=np.uint8).repeat(10, axis=0).repeat(10, axis=1)
NOISE = SensorNoise()


def live(count: int, begin: int = 0) -> list[Picture]:
    """Return pictures of a scene that stands still, each with the noise of its time."""
    return [NOISE.on(TEXTURE, index * DT_S) for index in range(begin, begin + count)]


def refusals(freshness: Freshness, pictures: list[Picture], **how: bool) -> list[bool]:
    """Return of each picture whether it, or the hand in it, is refused."""
    refused = []
    for picture in pictures:
        why = freshness.why_refused(picture, DT_S, **how) or freshness.why_hand_refused(BOX, DT_S)
        refused.append(why is not None)
    return refused


def test_pictures_with_noise_are_new() -> None:
    assert not any(refusals(Freshness(), live(300)))


def test_two_thousand_pictures_of_a_photo_with_noise_are_new() -> None:
    freshness = Freshness()
    small = TEXTURE[::10, ::10]
    assert not any(freshness.why_refused(NOISE.on(small, index * DT_S), DT_S) for index in range(2000))


@pytest.mark.parametrize("length", [1, 2, 9, 60, 1500])
def test_a_loop_of_pictures_is_old_whatever_its_length(length: int) -> None:
    freshness = Freshness()
    loop = [NOISE.on(TEXTURE[:240:2, :320:2], index * DT_S) for index in range(length)]
    assert not any(freshness.why_refused(picture, DT_S) for picture in loop)
    for picture in [*loop, *loop]:
        assert freshness.why_refused(picture, DT_S) is not None
    assert freshness.frozen_s == pytest.approx(2 * length * DT_S)
    assert freshness.why_refused(NOISE.on(TEXTURE, 99.0), DT_S) is None
    assert freshness.frozen_s == 0.0


def test_a_recording_may_start_again_but_not_stand_still() -> None:
    freshness = Freshness()
    loop = live(20)
    assert not any(refusals(freshness, loop * 3, recorded=True))
    assert all(refusals(freshness, [loop[-1]] * 5, recorded=True))


def torn(picture: Picture, index: int) -> Picture:
    changed = live(1, 500 + index)[0]
    changed[:320] = picture[:320]
    return changed


def one_pixel(picture: Picture, index: int) -> Picture:
    changed = picture.copy()
    changed[200, 260] = index % 250
    return changed


def few_pixels(picture: Picture, index: int) -> Picture:
    """Change a part of the hand that lies in several tiles."""
    changed = picture.copy()
    changed[200:220, 250:270] = np.random.default_rng(index).integers(0, 255, (20, 20, 3))
    return changed


def stamped(picture: Picture, index: int) -> Picture:
    changed = picture.copy()
    changed[10:40, 10:300] = np.random.default_rng(index).integers(0, 255, (30, 290, 3))
    return changed


@pytest.mark.parametrize("spoil", [torn, one_pixel, few_pixels, stamped])
@pytest.mark.parametrize("length", [1, 9])
def test_a_picture_in_which_the_hand_is_old_does_not_show_it(
    spoil: Callable[[Picture, int], Picture], length: int
) -> None:
    freshness = Freshness()
    loop = live(length)
    refusals(freshness, loop)
    spoilt = [spoil(loop[index % length], index) for index in range(60)]
    assert all(refusals(freshness, spoilt))
    assert not any(refusals(freshness, live(10, 700)))


def test_the_time_is_told_for_which_the_hand_has_been_old() -> None:
    freshness = Freshness()
    for picture in (torn(TEXTURE, index) for index in range(31)):
        assert freshness.why_refused(picture, DT_S) is None
        why = freshness.why_hand_refused(BOX, DT_S)
    assert why == "the picture is torn: the hand's part of it is the same for 1.0 s"


def test_a_background_that_stands_still_is_no_evidence() -> None:
    """Compressed video repeats it exactly."""

    def moving() -> Iterator[Picture]:
        for picture in live(60):
            shown = TEXTURE.copy()
            left, top, right, bottom = BOX
            shown[top:bottom, left:right] = picture[top:bottom, left:right]
            yield shown

    assert not any(refusals(Freshness(), list(moving())))


def test_half_a_hand_that_stands_still_is_no_evidence() -> None:
    pictures = live(60)
    for picture in pictures:
        picture[:210] = TEXTURE[:210]
    assert not any(refusals(Freshness(), pictures))


@pytest.mark.parametrize("quality", [60, 80, 95])
def test_a_still_scene_in_jpeg_is_new(quality: int) -> None:
    header = Header(Time(0, 0), "camera")
    pictures = [jpeg_picture(jpeg_message(picture, header, quality)) for picture in live(60)]
    assert not any(refusals(Freshness(), pictures))


def test_a_picture_that_was_passed_over_is_not_new_and_any_number_of_them_hides_no_other() -> None:
    freshness = Freshness()
    seen, *others = live(30)
    freshness.why_refused(seen, DT_S)
    for picture in others:
        freshness.pass_over(picture)
    assert all(refusals(freshness, [others[3], seen, others[-1]]))


@pytest.mark.parametrize("shape", [(1, 1, 3), (3, 2, 3), (481, 641, 3), (960, 544, 3), (1080, 1920, 3), (48, 64, 3)])
def test_any_size_will_do(shape: tuple[int, int, int]) -> None:
    freshness = Freshness()
    random = np.random.default_rng(0)
    for _ in range(3):
        picture = random.integers(20, 255, shape, dtype=np.uint8)
        assert freshness.why_refused(picture, DT_S) is None
        freshness.why_hand_refused((0, 0, shape[1], shape[0]), DT_S)
        assert freshness.why_refused(picture, DT_S) is not None
        assert freshness.why_hand_refused((-50, -50, -10, -10), DT_S) is None


def test_a_picture_of_another_size_is_compared_with_none_before() -> None:
    freshness = Freshness()
    large, small = live(1)[0], live(1)[0][::2, ::2]
    assert refusals(freshness, [large, small]) == [False, False]

"""Who sees the pictures of a camera that a browser gives, and who a drawn hand."""

import asyncio
import http.client
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass

import cv2
import numpy as np

from handsteer.clock import RealClock
from handsteer.images import image_message
from handsteer.messages import IMAGE_DRAWN, IMAGE_LANDMARKS, Header
from handsteer.plugins.page.pictures import CameraPrivacy, PictureResponse, Pictures
from handsteer.transports.in_process import InProcessTransport
from tests.plugins.page.served import PATIENCE_S, Site
from tests.plugins.page.test_server import read_jpeg

OWNER, OTHER, ANOTHER = "owner", "other", "another"
LATE_S = 3.0


@dataclass
class Time:
    now_s: float = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_all_see_a_camera_that_is_shared() -> None:
    privacy = CameraPrivacy()
    privacy.begin(OWNER, alone=False)
    assert not any(map(privacy.hides_from, (OWNER, OTHER, "")))


def test_only_the_owner_sees_a_camera_that_is_for_the_owner_alone() -> None:
    privacy = CameraPrivacy()
    privacy.begin(OWNER, alone=True)
    assert not privacy.hides_from(OWNER)
    assert all(map(privacy.hides_from, (OTHER, "")))


def test_a_camera_of_a_browser_without_a_session_is_hidden_from_others_too() -> None:
    privacy = CameraPrivacy()
    privacy.begin("", alone=True)
    assert privacy.hides_from(OTHER)


def test_pictures_on_their_way_stay_hidden_when_the_camera_is_given_no_more_or_shared() -> None:
    def end(privacy: CameraPrivacy) -> None:
        privacy.end()

    def share(privacy: CameraPrivacy) -> None:
        privacy.set_alone(on=False)

    def give_another(privacy: CameraPrivacy) -> None:
        privacy.end()
        privacy.begin(ANOTHER, alone=False)

    ways: tuple[Callable[[CameraPrivacy], None], ...] = (end, share, give_another)
    for way in ways:
        now = Time()
        privacy = CameraPrivacy(now)
        privacy.begin(OWNER, alone=True)
        now.now_s += 60
        way(privacy)
        now.now_s += LATE_S - 0.1
        assert privacy.hides_from(OTHER)
        assert not privacy.hides_from(OWNER)
        now.now_s += 0.2
        assert not privacy.hides_from(OTHER)


def parts_for_another(pictures: Pictures) -> AsyncIterator[bytes]:
    async def parts() -> AsyncIterator[bytes]:
        async for part in PictureResponse(pictures, OTHER).body_iterator:
            assert isinstance(part, bytes)
            yield part

    return parts()


def test_a_picture_that_was_waited_for_before_the_choice_is_not_sent() -> None:
    transport, clock = InProcessTransport(), RealClock()
    seen, drawn = (transport.advertise("hand_sign_recognition", topic) for topic in (IMAGE_LANDMARKS, IMAGE_DRAWN))
    pictures = Pictures(transport, clock)
    pictures.privacy.begin(OWNER, alone=False)

    async def parts() -> list[bytes]:
        stream = parts_for_another(pictures)
        await anext(stream)  # the boundary
        sent: list[bytes] = []
        for _ in range(5):
            coming = asyncio.ensure_future(anext(stream))
            while not pictures.seen.running and not pictures.drawn.running:
                await asyncio.sleep(0.01)
            await asyncio.sleep(0.1)
            pictures.privacy.set_alone(on=True)  # while one is waited for
            while not coming.done():
                header = Header(clock.stamp(clock.now()), "camera")
                seen.publish(image_message(np.full((48, 64, 3), 200, np.uint8), header))
                drawn.publish(image_message(np.zeros((48, 64, 3), np.uint8), header))
                await asyncio.sleep(0.02)
            sent.append(await coming)
        return sent

    sent = asyncio.run(asyncio.wait_for(parts(), PATIENCE_S))
    pictures.close()
    assert max(map(brightness, sent)) < 40


def brightness(part: bytes) -> float:
    jpeg = np.frombuffer(part[part.index(b"\xff\xd8") :], np.uint8)
    picture = cv2.imdecode(jpeg, cv2.IMREAD_COLOR)
    assert picture is not None
    return float(picture.mean())


def test_the_last_picture_is_replaced_at_the_choice_even_if_no_other_comes() -> None:
    transport, clock = InProcessTransport(), RealClock()
    seen = transport.advertise("hand_sign_recognition", IMAGE_LANDMARKS)
    pictures = Pictures(transport, clock)
    pictures.privacy.begin(OWNER, alone=False)

    async def last_part() -> bytes:
        stream = parts_for_another(pictures)
        await anext(stream)  # the boundary
        coming = asyncio.ensure_future(anext(stream))
        while not coming.done():
            header = Header(clock.stamp(clock.now()), "camera")
            seen.publish(image_message(np.full((48, 64, 3), 200, np.uint8), header))
            await asyncio.sleep(0.02)
        assert brightness(await coming) > 150
        pictures.privacy.set_alone(on=True)
        return await anext(stream)

    assert brightness(asyncio.run(asyncio.wait_for(last_part(), PATIENCE_S))) < 40
    pictures.close()


def shows(response: http.client.HTTPResponse) -> str:
    """Return what the next picture of ``response`` shows."""
    return "the person" if read_jpeg(response).mean() > 40 else "a drawn hand"


def test_the_stream_of_pictures_shows_others_a_drawn_hand_from_the_moment_of_the_choice(site: Site) -> None:
    _, cookies = site.page()
    _, others = site.page()
    session = cookies.partition("=")[2]
    privacy = site.dashboard.pictures.privacy
    privacy.begin(session, alone=False)
    own, other, stranger = (site.get("/camera.mjpg", **{"Cookie": each}) for each in (cookies, others, ""))
    assert {shows(each) for each in (own, other, stranger)} == {"the person"}
    privacy.set_alone(on=True)
    for response in (other, stranger):
        seen = [shows(response) for _ in range(30)]
        first = seen.index("a drawn hand")
        # What was sent before the choice is still on its way.
        assert set(seen[first:]) == {"a drawn hand"}
    assert {shows(own) for _ in range(30)} == {"the person"}
    late = site.get("/camera.mjpg")
    assert shows(late) == "a drawn hand"
    for response in (own, other, stranger, late):
        response.close()

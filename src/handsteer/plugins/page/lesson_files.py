"""Files of a lesson: what a browser downloads and uploads."""

import asyncio
import importlib.util
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, Final

from fastapi import FastAPI
from starlette.background import BackgroundTask
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, PlainTextResponse, Response, StreamingResponse

from handsteer.plugins.page.lesson import Lesson
from handsteer.plugins.page.lessons import Lessons
from handsteer.plugins.page.socket_events import is_page_of
from handsteer.plugins.teach.dataset import Dataset
from handsteer.plugins.teach.exchange import LARGEST_SHARED_BYTES, takes_as_csv
from handsteer.recognition.custom_signs import CustomModel

LESSON_PATH: Final = "/lesson"
CAN_EXPORT: Final = importlib.util.find_spec("onnx") is not None
"""Whether the package for the export as ONNX is installed."""

_UPLOAD_TIMEOUT_S: Final = 120.0
_TOO_LARGE: Final = f"The file is too large: a file of taught signs has at most {LARGEST_SHARED_BYTES // 1_000_000} MB."


def serve_lesson_files(application: FastAPI, lessons: Callable[[], Lessons | None]) -> None:
    """Serve the files of the lesson of ``lessons``, each only to the browser of the viewer who teaches."""
    uploading = threading.Lock()

    def teaching(viewer: str, request: Request) -> Lessons | None:
        current = lessons()
        is_taught = current is not None and is_page_of(viewer, request.scope) and current.node(viewer) is not None
        return current if is_taught else None

    @application.get(f"{LESSON_PATH}/signs.npz")
    def signs(request: Request, viewer: str = "") -> Response:
        current = teaching(viewer, request)
        return _missing() if current is None else _shared(current, viewer)

    @application.get(f"{LESSON_PATH}/takes.csv")
    def takes(request: Request, viewer: str = "") -> Response:
        current = teaching(viewer, request)
        node = current.node(viewer) if current is not None else None
        return _missing() if node is None else _as_csv(node.do(Lesson.dataset))

    @application.get(f"{LESSON_PATH}/signs.onnx")
    def onnx(request: Request, viewer: str = "") -> Response:
        current = teaching(viewer, request)
        node = current.node(viewer) if current is not None else None
        model = node.state.model if node is not None else None
        return _missing() if model is None or not CAN_EXPORT else _as_onnx(model)

    @application.post(f"{LESSON_PATH}/signs")
    async def upload(request: Request, viewer: str = "") -> Response:
        current = teaching(viewer, request)
        if current is None:
            return _missing()
        if not uploading.acquire(blocking=False):
            return PlainTextResponse("another file is being uploaded", 409)
        try:
            return await _receive(current, viewer, request)
        finally:
            uploading.release()


async def _receive(lessons: Lessons, viewer: str, request: Request) -> Response:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "signs.npz"
        with path.open("wb") as file, suppress(TimeoutError, ClientDisconnect):
            async with asyncio.timeout(_UPLOAD_TIMEOUT_S):
                if not await _write(request, file):
                    node = lessons.node(viewer)
                    if node is not None:
                        node.do(lambda lesson: lesson.say(_TOO_LARGE))
                    return PlainTextResponse(_TOO_LARGE, 413)
        await asyncio.to_thread(lessons.take_file, viewer, path)
    return Response(status_code=204)


async def _write(request: Request, file: BinaryIO) -> bool:
    """Write the body of ``request`` to ``file``; return whether it is small enough."""
    size = 0
    async for part in request.stream():
        size += len(part)
        if size > LARGEST_SHARED_BYTES:
            return False
        file.write(part)
    return True


def _shared(lessons: Lessons, viewer: str) -> Response:
    folder = tempfile.TemporaryDirectory()
    path = Path(folder.name) / "signs.npz"
    if not lessons.share(viewer, path):
        folder.cleanup()
        return _missing()
    return FileResponse(
        path,
        media_type="application/octet-stream",
        filename="handsteer-signs.npz",
        background=BackgroundTask(folder.cleanup),
    )


def _as_csv(dataset: Dataset) -> Response:
    lines = (line.encode() for line in takes_as_csv(dataset))
    return StreamingResponse(lines, media_type="text/csv", headers=_attached("takes.csv"))


def _as_onnx(model: CustomModel) -> Response:
    from handsteer.plugins.teach.onnx_file import as_onnx  # noqa: PLC0415

    headers = _attached("handsteer-signs.onnx")
    return Response(as_onnx(model), media_type="application/octet-stream", headers=headers)


def _attached(name: str) -> dict[str, str]:
    return {"Content-Disposition": f'attachment; filename="{name}"'}


def _missing() -> Response:
    return PlainTextResponse("there is no such lesson", 404)

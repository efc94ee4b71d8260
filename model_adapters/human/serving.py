"""The page of a desk: its routes, and the server that has them while a run goes on."""

import asyncio
import os
import sys
import time
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from socket import socket
from typing import Annotated, Any

import msgspec
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute, Route

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.pages.server import file_route, serve_pages
from model_adapters.human.adapter import HumanOptions
from model_adapters.human.desk import Desk, Question, StaleError
from model_adapters.protocols import Turn

_WAIT_S = 20.0  # a page asks again after so long without a change
_LOOK_S = 0.03  # and hears of one so soon
# For pages to learn that it is over: those that wait for news, and those that may be closed.
_LAST_NEWS_S, _LAST_LOOK_S = 30.0, 3.0
_LONGEST = 2000  # characters of an answer
_DIGITS = 15  # of a number of a question, frame or version
_PACKAGE = "model_adapters.human"


class _AnswerForm(msgspec.Struct):
    """An answer as the page sends it."""

    number: int
    text: str
    watched: int = 0


class _ScreenForm(msgspec.Struct):
    """A page's report on its screen: whether it shows a question; `page` identifies the page."""

    number: int
    page: Annotated[str, msgspec.Meta(max_length=40)]
    shows: bool


@contextmanager
def serve_desk(desk: Desk, options: HumanOptions, listening: socket) -> Iterator[None]:
    """Serve the page of a desk on a socket until the context ends, and say where it is."""
    with serve_pages(desk_routes(desk), listening=listening) as server:
        print(f"human: answer at {server.address}", file=sys.stderr, flush=True)
        if options.browser and _has_screen():
            webbrowser.open(server.address)
        yield
        desk.wait_until_informed(_LAST_NEWS_S, _LAST_LOOK_S)


def desk_routes(desk: Desk) -> list[BaseRoute]:
    """Return the routes of a desk's page."""
    page = _Page(desk)
    return [
        file_route("/", _PACKAGE, "page.html"),
        file_route("/look.css", "infthor_eval.pages", "look.css"),
        *(file_route(f"/{name}", _PACKAGE, name) for name in ("page.css", "page.js", "strip.js")),
        Route("/state.json", page.state),
        Route("/frames/{number}/{index}", page.frame),
        Route("/answer", page.answer, methods=["POST"]),
        Route("/screen", page.screen, methods=["POST"]),
        Route("/stop", page.stop, methods=["POST"]),
    ]


class _Page:
    """The answers to a page's requests."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk

    async def state(self, request: Request) -> Response:
        """What is asked now; waits for another version than the one that the page has."""
        seen = _number(request.query_params.get("seen", ""))
        if seen is not None:
            # Not in a thread: there are few, and answers need one.
            end = time.monotonic() + _WAIT_S
            with self._desk.reading():
                while self._desk.version == seen and time.monotonic() < end:
                    await asyncio.sleep(_LOOK_S)
        state = _state_of(self._desk)
        informing = BackgroundTask(self._desk.report_closed) if state["closed"] else None
        return JSONResponse(state, background=informing)

    async def frame(self, request: Request) -> Response:
        """One frame of the question of a number."""
        question = self._desk.question
        if question is None or question.number != _number(request.path_params["number"]):
            return _problem("this question is not asked any more", 409)
        frames = _frames_of(question.inquiry.turns)
        index = _number(request.path_params["index"])
        if index is None or index >= len(frames):
            return _problem("there is no such frame", 404)
        return await run_in_threadpool(_picture, frames[index])

    async def answer(self, request: Request) -> Response:
        """Take an answer."""
        try:
            form = msgspec.json.decode(await request.body(), type=_AnswerForm)
        except (msgspec.ValidationError, msgspec.DecodeError):
            return _problem("not an answer", 400)
        return await run_in_threadpool(_take, self._desk, form)

    async def screen(self, request: Request) -> Response:
        """Take a page's report on its screen."""
        try:
            form = msgspec.json.decode(await request.body(), type=_ScreenForm)
        except (msgspec.ValidationError, msgspec.DecodeError):
            return _problem("not a page's report on its screen", 400)
        self._desk.report_screen(form.number, form.page, shows=form.shows)
        return JSONResponse({})

    async def stop(self, _request: Request) -> Response:
        """End the run, which can go on later."""
        self._desk.stop()
        return JSONResponse({})


def _take(desk: Desk, form: _AnswerForm) -> Response:
    question = desk.question
    text = form.text.strip()
    if not text:
        return _problem("write an answer first", 400)
    if len(text) > _LONGEST:
        return _problem(f"an answer has at most {_LONGEST} characters", 400)
    if (
        question is not None
        and question.inquiry.decoding.choices
        and text not in question.inquiry.decoding.choices
    ):
        return _problem("only the listed replies are possible here", 400)
    n_frames = 0 if question is None else len(_frames_of(question.inquiry.turns))
    try:
        desk.give(form.number, text, min(max(0, form.watched), n_frames))
    except StaleError:
        return _problem("this question was answered already, perhaps in another tab", 409)
    if not desk.wait_until_kept(form.number):
        return _problem("the run ended before the answer was on disk; start it again", 500)
    return JSONResponse({})


def _picture(frame: FrameRef) -> Response:
    """Return a frame, named as the image that it is, whatever the name of its file."""
    try:
        content, media_type = frame.encoded()
    except DataError as error:
        return _problem(str(error), 404)
    return Response(content, media_type=media_type)


def _number(text: str) -> int | None:
    """Return a number of a request; None for what is none, or longer than any there is."""
    return int(text) if text.isdecimal() and len(text) <= _DIGITS else None


def _problem(text: str, status: int) -> JSONResponse:
    return JSONResponse({"problem": text}, status_code=status)


def _has_screen() -> bool:
    """Return whether a browser can open a window; without one it would take the terminal."""
    return sys.platform in ("darwin", "win32") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )


def _state_of(desk: Desk) -> dict[str, Any]:
    """Return what the page shows now.

    `parts` has the texts and frames that a model would be given, in order: `{"text": ...}` or
    `{"frame": n}`, n being the frame's place among all frames.
    """
    version = desk.version
    question = desk.question
    return {
        "version": version,
        "closed": desk.is_closed,
        "stopped": desk.is_stopped,
        "answered": desk.n_answered,
        "question": None if question is None else _question(question),
    }


def _frames_of(turns: tuple[Turn, ...]) -> list[FrameRef]:
    """Return all frames, in the order in which a model is given them."""
    return [part for turn in turns for part in turn.parts if isinstance(part, FrameRef)]


def _parts(turns: tuple[Turn, ...]) -> Iterator[dict[str, Any]]:
    n_frames = 0
    for turn in turns:
        for part in turn.parts:
            if isinstance(part, FrameRef):
                yield {"frame": n_frames}
                n_frames += 1
            else:
                yield {"text": str(part)}


def _question(question: Question) -> dict[str, Any]:
    inquiry = question.inquiry
    notice = inquiry.notice
    return {
        "number": question.number,
        "seconds": round(question.clock.seconds or 0.0, 1),
        "title": notice.title,
        "unit": notice.unit,
        "position": inquiry.position,
        "facts": [list(fact) for fact in notice.facts],
        "news": notice.news,
        "words": list(notice.words),
        "replies": list(inquiry.decoding.choices or notice.replies),
        "only": bool(inquiry.decoding.choices),
        "parts": list(_parts(inquiry.turns)),
    }

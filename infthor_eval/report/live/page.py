"""The addresses of the page on a run: the page, its script and styles, and the state that it asks
for each second."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec

from infthor_eval.pages.server import file_route
from infthor_eval.report.live.state import LiveRun

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import Route

__all__ = ["live_routes"]


def live_routes(run: LiveRun) -> list[Route]:
    """Return the routes of the page on a run, which read it and nothing else; the extra `page` must
    be installed."""
    from starlette.responses import Response
    from starlette.routing import Route

    def state(_request: Request) -> Response:
        return Response(msgspec.json.encode(run.state()), media_type="application/json")

    own = __package__
    report = "infthor_eval.report.web"
    files = [("/", own, "live.html"), ("/live.js", own, "live.js"), ("/live.css", own, "live.css")]
    files.append(("/report.css", report, "report.css"))
    return [*(file_route(*file) for file in files), Route("/state.json", state)]

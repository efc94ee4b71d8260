"""Who may see a page, and what a page may do.

Everybody on a machine can reach its 127.0.0.1, and so can each page that is open in a browser on
it. Hence the address holds a token, and requests under another name (a name of elsewhere that is
made to point here) or from another page are refused.
"""

import secrets

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from infthor_eval.pages.policy import SERVED

_NAMES = ("127.0.0.1", "localhost")
_HEADERS = {
    "Content-Security-Policy": SERVED,
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",  # the address holds the token
    "Cache-Control": "no-store",
}


class Guard:
    """An application around another: it refuses requests of others, and adds every page's headers.

    Args:
        application: what answers the requests that are not refused.
        token: first part of the path of every address.
    """

    def __init__(self, application: ASGIApp, token: str) -> None:
        self._application = application
        self._token = token.encode()
        self._headers = [
            (name.lower().encode(), value.encode()) for name, value in _HEADERS.items()
        ]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See ASGI; only requests over HTTP arrive here."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message["headers"], *self._headers]}
            await send(message)

        problem = self._problem(Headers(scope=scope), scope["path"])
        answer = (
            PlainTextResponse(f"Refused: {problem}.\n", status_code=403)
            if problem
            else self._application
        )
        await answer(scope, receive, send_with_headers)

    def _problem(self, headers: Headers, path: str) -> str:
        """Return why a request is refused; empty if it is not."""
        host = headers.get("host", "")
        if host.partition(":")[0].lower() not in _NAMES:
            return f"these pages are at {_NAMES[0]}"
        # The port is not compared with the server's: it is another one where the port is forwarded
        # from elsewhere.
        if headers.get("origin", f"http://{host}") != f"http://{host}":
            return "another page asked"
        token = path.removeprefix("/").partition("/")[0]
        if not secrets.compare_digest(token.encode(), self._token):
            return (
                "the address does not hold the token of this server; open the address that the "
                "command printed"
            )
        return ""

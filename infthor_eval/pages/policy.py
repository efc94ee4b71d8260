"""Content security policies: what a page may run and load, as its browser enforces it.

No page may run a script or apply a style that is not the project's own, and none may make markup
of text: what a run, a set or a server calls itself stays text even where a script errs.
"""

import base64
import hashlib

_ALWAYS = {
    "default-src": "'none'",
    "base-uri": "'none'",
    # A script that gives text to innerHTML, or to whatever else parses or runs it, is stopped.
    "require-trusted-types-for": "'script'",
    "trusted-types": "'none'",
}


def _written(sources: dict[str, str]) -> str:
    return "; ".join(f"{name} {source}" for name, source in (_ALWAYS | sources).items())


# Served pages have their scripts and styles in files, of which the server has no other than the
# project's: all else below its address is JSON or an image, which no browser runs (nosniff).
SERVED = _written(
    {
        "img-src": "'self' data:",
        "style-src": "'self'",
        "script-src": "'self'",
        "connect-src": "'self'",
        "form-action": "'self'",
        "frame-ancestors": "'none'",
    }
)


def file_policy(*, style: str, script: str, images: str = "data:") -> str:
    """Return the policy of a page that is one file, for its `<meta http-equiv>`.

    Args:
        style: text of its only style element, to the letter.
        script: text of its only script element, to the letter.
        images: sources of images.
    """
    return _written(
        {
            "img-src": images,
            "style-src": _hash(style),
            "script-src": _hash(script),
            "form-action": "'none'",
        }
    )


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"

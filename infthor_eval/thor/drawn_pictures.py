"""Pictures that were drawn for earlier recordings, so that none is drawn and encoded twice."""

from pathlib import Path
from typing import Any

from infthor_eval.errors import SimulatorError
from infthor_eval.formats.pictures.png import PngWriter
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView


class DrawnPictures:
    """Keeps pictures by what the embedded simulator says of them before it draws them.

    Recordings of nearly the same episode, as of twins, have most pictures in common. No other
    simulator tells that (`imageDigest`).
    """

    def __init__(self, simulator: Simulator, folder: Path) -> None:
        """Keep the pictures of an embedded simulator in a folder, which must exist."""
        self._simulator = simulator
        self._folder = folder
        self._known: set[str] = set()
        self._is_new = True

    @property
    def arguments(self) -> dict[str, Any]:
        """Further arguments of an action after which a frame is recorded."""
        # After a new picture the next one is likely to be new, and comes with the reply.
        return {"imageDigest": True, "renderImage": self._is_new}

    def write(self, images: PngWriter, name: str, view: SimulatorView, digest: str) -> None:
        """Write a view's picture, by its digest, as one of a recording's files.

        Raises:
            SimulatorError: the simulator fails.
        """
        kept = self._folder / f"{digest}.png"
        self._is_new = digest not in self._known
        if not self._is_new:
            images.link(kept, images.folder / name)
            return
        frame = view.frame
        if frame is None:
            # Nothing happens in it, so that its picture is that of the action before.
            frame = self._simulator.query("Pass", renderImage=True).frame
        if frame is None:
            raise SimulatorError(f"{name}: the simulator sent no frame; run the command again")
        images.write(name, frame)
        images.link(images.folder / name, kept)
        self._known.add(digest)

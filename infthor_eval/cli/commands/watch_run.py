"""`infthor-eval watch-run`: a page on a run as it goes."""

from contextlib import suppress
from pathlib import Path

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH


@example_command("watch-run", "infthor-eval watch-run results/qwen2.5-vl-nano")
@click.argument("run", type=PATH)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    help="Port on 127.0.0.1.  [default: one that is free]",
)
def command(run: Path, port: int) -> None:
    """Open a page on the run in the folder RUN: progress, accuracy so far, tokens and seconds,
    failures, new samples.

    RUN may be a folder above the run's, also before the run starts: the run below it that was
    written last is shown. The page is read only, and the run does not notice it. It needs the extra
    `page`. Ctrl-C ends the page, not the run.
    """
    from infthor_eval.errors import UsageError
    from infthor_eval.pages.server import require_page_extra, serve_pages
    from infthor_eval.report.live.state import LiveRun, live_routes
    from infthor_eval.terminal import print_line

    if run.exists() and not run.is_dir():
        raise UsageError(f"{run}: is a file; give the folder of a run, or one above it")
    require_page_extra()
    with (
        serve_pages(live_routes(LiveRun(run)), port=port) as server,
        suppress(KeyboardInterrupt),
    ):
        print_line(f"{run}: {server.address}")
        server.wait()

"""`infthor-eval scenes`: draw a scene, export it for machines without Unity, or fetch it."""

from pathlib import Path

import click

from infthor_eval.cli.help import ExampleGroup
from infthor_eval.cli.options.values import PATH, SceneName, default_option, floor_plans_option
from infthor_eval.storage.files import hold_folder, prepare_file, refuse_overwrite, write_output
from infthor_eval.terminal import print_line

_PICTURES = (".png", ".jpg", ".jpeg")


@click.group("scenes", cls=ExampleGroup, example="infthor-eval scenes show kitchen-3")
def command() -> None:
    """Draw a scene (show); get scenes for machines without Unity (dump from Unity, or fetch)."""


@command.command("show", example="infthor-eval scenes show kitchen-3 --out kitchen.png")
@click.argument("name", type=SceneName())
@floor_plans_option
@click.option("--out", type=PATH, help="Image to write; default: NAME.png.")
@default_option("--size", click.IntRange(64, 2048), 600, "Width and height of each view, pixels.")
@click.option("--overwrite", is_flag=True, help="Replace a file with other content.")
def show(name: str, data: Path | None, out: Path | None, size: int, overwrite: bool) -> None:
    """Draw scene NAME from above and from where an agent sees most of it, side by side."""
    import io

    from PIL import Image

    from infthor_eval.thor.launch import embedded_launch
    from infthor_eval.thor.scenes import scene_pictures
    from infthor_eval.thor.simulator import Simulator

    path = prepare_file(out or Path(f"{name}.png"))
    if path.suffix.lower() not in _PICTURES:
        raise click.UsageError(f"--out {path}: not an image; use {', '.join(_PICTURES)}")
    with Simulator(embedded_launch(data), width=size, height=size, quality="Ultra") as simulator:
        above, room = scene_pictures(simulator, name)
    sheet = Image.new("RGB", (2 * size, size))
    sheet.paste(Image.fromarray(above), (0, 0))
    sheet.paste(Image.fromarray(room), (size, 0))
    picture = io.BytesIO()
    sheet.save(picture, format=Image.registered_extensions()[path.suffix.lower()])
    if not overwrite:
        refuse_overwrite(path, picture.getvalue())
    with write_output(path, "give another place with --out") as partial:
        partial.write_bytes(picture.getvalue())
    print_line(f"{name}: {path} (from above; from where most is seen)")


@command.command("dump", example="infthor-eval scenes dump FloorPlan1 FloorPlan201 --out scenes")
@click.argument("names", nargs=-1, required=True)
@click.option("--out", type=PATH, required=True, help="Folder of floor plans, new or existing.")
@click.option(
    "--unity",
    type=PATH,
    help="Unity executable to use instead of the build that ai2thor downloads.",
)
@click.option(
    "--embedded",
    "is_embedded",
    is_flag=True,
    help="Export scenes of the embedded simulator instead.",
)
@click.option("--overwrite", is_flag=True, help="Replace other recordings of these scenes.")
@floor_plans_option
def dump(
    names: tuple[str, ...],
    out: Path,
    unity: Path | None,
    is_embedded: bool,
    overwrite: bool,
    data: Path | None,
) -> None:
    """Export the metadata of the scenes NAMES from Unity into a folder.

    Other commands take that folder as --data, to run these scenes in the embedded simulator.
    """
    from infthor_eval.thor import launch
    from infthor_eval.thor.scenes import dump_scene
    from infthor_eval.thor.simulator import Simulator

    start = launch.embedded_launch(data) if is_embedded else launch.unity_launch(unity)
    with hold_folder(out), Simulator(start) as simulator:
        for name in names:
            print_line(f"{name}: {dump_scene(simulator, name, out, overwrite)} objects in {out}")


@command.command("fetch", example="infthor-eval scenes fetch FloorPlan1 FloorPlan201 --out scenes")
@click.argument("names", nargs=-1)
@click.option("--out", type=PATH, required=True, help="Folder of floor plans, new or existing.")
@click.option("--overwrite", is_flag=True, help="Replace other recordings of these scenes.")
@click.option("--endpoint", hidden=True, help="Another host of the repositories' files.")
def fetch(names: tuple[str, ...], out: Path, overwrite: bool, endpoint: str | None) -> None:
    """Download AI2-THOR's floor plans NAMES, or all 120, from public repositories (MIT license).

    Other commands take that folder as --data, to run these scenes in the embedded simulator.
    """
    from infthor_eval.thor.published_scenes import HOST, PUBLISHED_SCENES, fetch_scene

    unknown = [name for name in names if name not in PUBLISHED_SCENES]
    if unknown:
        raise click.UsageError(
            f"{unknown[0]}: not published; there are FloorPlan1 to 30, 201 to 230, 301 to 330 and "
            "401 to 430"
        )
    with hold_folder(out):
        for name in names or PUBLISHED_SCENES:
            n_objects = fetch_scene(name, out, endpoint or HOST, overwrite)
            print_line(f"{name}: {n_objects} objects in {out}")

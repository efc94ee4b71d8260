"""What is kept of the files of runs: their text, but for what no two runs have in common."""

import hashlib
import io
import json
import re
import tarfile
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

# Patterns, and what stands in their places. Nothing else is lost.
_RULES: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    # pictures in pages and exports: their bytes are still compared
    (r"[A-Za-z0-9+/]{400,}={0,2}", lambda found: f"sha256:{_digest(found[0].encode())}"),
    # when a run ended: names of the lm-eval files in its folder, and `date` in them
    (r"\d{4}-\d\d-\d\dT\d\d-\d\d-\d\d\.\d{6}", "TIME"),
    (r'("date": )\d+\.\d+', r"\g<1>0"),
    # how long it took: usage.json
    (r'("seconds": )\d+(\.\d+)?(e-\d+)?(?=,\n  "written")', r"\g<1>0"),
    # the same of memories: the last two columns of their table
    (r"(?m) +\d+\.\d{3} +\d+\.\d{3}  $", " SECONDS"),
    # made of a run's identity: names of Every Eval Ever's files, names and ids of inspect's logs
    (r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", "UUID"),
    (r"_[0-9a-f]{16}(?=\.eval)", "_ID"),
    (r'("(?:eval_id|task_id)": ")[0-9a-f]{16}', r"\g<1>ID"),
    # lm-eval's of a sample's `doc`, which has the folder of its set, and of a task: both are
    # compared themselves
    (r'("(?:doc_hash|(?:nieh|infthor|manipulathor)_\w+)": ")[0-9a-f]{64}', r"\g<1>HASH"),
)
_COMPILED = [(re.compile(pattern), put) for pattern, put in _RULES]
_DATA = re.compile(r'(<script id="(\w+)" type="application/json">)(.*?)(</script>)', re.DOTALL)


def normalise(folder: Path, root: Path) -> dict[str, bytes]:
    """Return the files below a folder by their normalised paths; pages in parts.

    Args:
        folder: has a folder for each case.
        root: where the code is.
    """
    kept: dict[str, bytes] = {}
    for case in sorted(folder.iterdir()):
        runs = [path.parent for path in sorted(case.rglob("results.json"))]
        identities = {str(run.parent.relative_to(case / "runs")): run.name for run in runs}
        kept[f"{case.name}/identities.json"] = json.dumps(identities, indent=1).encode()
        places = {name.rpartition("-")[2]: "IDENTITY" for name in identities.values()}
        places |= {str(folder): "WORK", str(root): "ROOT"}
        for path in sorted(path for path in case.rglob("*") if path.is_file()):
            for name, content in _parts(str(path.relative_to(folder)), path.read_bytes()):
                normal = normalise_text(name, places)
                assert normal not in kept, f"two files are {normal}"
                kept[normal] = _normalise_content(content, places)
    return kept


def normalise_text(text: str, places: Mapping[str, str]) -> str:
    """Put placeholders for strings of this run (`places`), and for what the rules name."""
    for found, put in places.items():
        text = text.replace(found, put)
    for pattern, put in _COMPILED:
        text = pattern.sub(put, text)
    return text


def _normalise_content(content: bytes, places: Mapping[str, str]) -> bytes:
    try:
        return normalise_text(content.decode(), places).encode()
    except UnicodeDecodeError:
        return f"sha256:{_digest(content)}\n".encode()


def _parts(name: str, content: bytes) -> list[tuple[str, bytes]]:
    """A log of inspect as one JSON object; a page's data apart from it, which has a line a tag."""
    if name.endswith(".eval"):
        with zipfile.ZipFile(io.BytesIO(content)) as log:
            members = [f"{json.dumps(it)}: {log.read(it).decode()}" for it in log.namelist()]
        return [(f"{name}.json", ("{" + ",\n".join(members) + "}").encode())]
    if name.endswith(".html"):
        page = content.decode()
        data = [(f"{name}/{found[2]}.json", found[3].encode()) for found in _DATA.finditer(page)]
        rest = _DATA.sub(r"\1\4", page).replace("><", ">\n<")
        return [(name + "/page.txt", rest.encode()), *data]
    return [(name, content)]


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:24]


def write_golden(files: Mapping[str, bytes], target: Path) -> None:
    """Write files into a folder, or into an archive if its name ends in .tar.xz."""
    if not target.name.endswith(".tar.xz"):
        for name, content in files.items():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            (target / name).write_bytes(content)
        return
    with tarfile.open(target, "w:xz", preset=9) as archive:
        for name, content in sorted(files.items()):
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))


def read_golden(source: Path) -> dict[str, bytes]:
    """Read what `write_golden` has written."""
    if source.is_dir():
        paths = [path for path in sorted(source.rglob("*")) if path.is_file()]
        return {str(path.relative_to(source)): path.read_bytes() for path in paths}
    with tarfile.open(source) as archive:
        members = [(it.name, archive.extractfile(it)) for it in archive]
        return {name: content.read() for name, content in members if content is not None}

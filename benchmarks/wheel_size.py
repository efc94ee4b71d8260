"""How large is the wheel? Build it away from the checkout, and print its megabytes as JSON.

python benchmarks/wheel_size.py
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCES = ("infthor_eval", "infthor_sim", "model_adapters", "tasks", "results/published")
FILES = ("results/README.md", "README.md", "LICENSE", "pyproject.toml", "setup.py")
QUIETLY = ("--quiet", "--disable-pip-version-check", "--no-index", "--no-deps")


def build_wheel(scratch: Path) -> Path:
    """Return the path of a wheel built from a copy of the sources in an empty folder: setuptools
    writes into it."""
    source, out = scratch / "source", scratch / "wheel"
    for name in SOURCES:
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in FILES:
        (source / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, source / name)
    pip("wheel", "--no-build-isolation", "--wheel-dir", out, source)
    (found,) = out.iterdir()
    return found


def pip(*words: str | Path) -> None:
    """Run pip without the network."""
    subprocess.run([sys.executable, "-m", "pip", words[0], *QUIETLY, *words[1:]], check=True)


def main() -> None:
    """Build and print."""
    with tempfile.TemporaryDirectory() as scratch:
        print(json.dumps({"megabytes": round(build_wheel(Path(scratch)).stat().st_size / 1e6, 2)}))


if __name__ == "__main__":
    main()

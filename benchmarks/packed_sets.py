"""What a packed set costs against the folder that it is unpacked to: bytes, files, and time.

    python -m benchmarks.packed_sets [infthor_eval/sets/nieh_mini_twins]

Times are processor seconds of a fresh process: to the first question's first frame, and to decode
all frames of all trajectories in order.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from infthor_eval.formats.packed.writing import unpack_set
from infthor_eval.storage.folders import packaged_folder

_MEASURED = """
import json, sys, time
from pathlib import Path
from infthor_eval.formats.nieh_set import NiehSet
data = NiehSet(Path(sys.argv[1]))
data.clue_frames(data.questions[0])[0].load()
first = time.process_time()
names = sorted({question.traj_id for question in data.questions})
n = sum(len([frame.load() for frame in data.frames(name)]) for name in names)
print(json.dumps([first, time.process_time() - first, n, data.fingerprint]))
"""


def main() -> None:
    """Print a table of both forms."""
    packed = Path(sys.argv[1]) if sys.argv[1:] else packaged_folder("sets/nieh_mini_twins")
    with tempfile.TemporaryDirectory() as folder:
        unpack_set(packed, Path(folder), skip_damaged=False)
        for name, root in (("packed", packed), ("folder", Path(folder))):
            files = [path for path in root.rglob("*") if path.is_file()]
            size = sum(path.stat().st_size for path in files)
            runs = [
                json.loads(
                    subprocess.run(
                        [sys.executable, "-c", _MEASURED, str(root)],
                        check=True,
                        capture_output=True,
                    ).stdout
                )
                for _ in range(3)
            ]
            first, rest = (min(run[at] for run in runs) for at in range(2))
            print(
                f"{name}: {len(files):,} files, {size / 1e6:.1f} MB; first frame after {first:.2f}"
                f" s; {runs[0][2]:,} frames in {rest:.2f} s ({1e3 * rest / runs[0][2]:.2f} ms"
                f" each); fingerprint {runs[0][3]}"
            )


if __name__ == "__main__":
    main()

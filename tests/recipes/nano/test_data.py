"""The data of the small model, made for one room."""

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.workers import WorkerSettings
from recipes.nano.data import generate_training_data
from recipes.nano.settings import SceneSettings


def test_a_set_and_its_twins_are_made_once(tmp_path):
    scenes = SceneSettings(kinds=("bathroom",), first=901, count=2, min_steps=20, twins=1)
    folders = generate_training_data(scenes, 0, tmp_path, WorkerSettings())
    data, twins = map(NiehSet, folders)
    names = {question.traj_id for question in data.questions}
    assert names == {"bathroom-901-seed0", "bathroom-902-seed0"}
    pairs = {question.pair for question in twins.questions}
    assert {pair.floor_plan for pair in twins.twins.values()} == {"bathroom-901"}
    assert len(twins.questions) == 2 * len(pairs) > 2
    written = {path: path.stat().st_mtime_ns for path in (tmp_path / "twins").rglob("*.json.xz")}
    assert generate_training_data(scenes, 0, tmp_path, WorkerSettings()) == folders
    assert written == {path: path.stat().st_mtime_ns for path in written}

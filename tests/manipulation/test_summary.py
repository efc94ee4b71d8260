"""Numbers and tables of runs made by hand: no simulator, no model."""

import msgspec
import pytest

from infthor_eval.manipulation.config import ManipulationConfig
from infthor_eval.manipulation.records import ArmRecord, ArmStep
from infthor_eval.manipulation.suite import ManipulationSuite
from infthor_eval.manipulation.summary import summarise_manipulation
from infthor_eval.runs import RunHeader, RunSummary, UnitRecord

PICK, PUT = "manipulathor_pickup", "manipulathor_put"
COLLIDED = "Collided with static sim object: 'Table|1', could not reach target: 'x'."
EMBEDDED = (
    "Made in the embedded simulator: not comparable with the published rows, which are of AI2-THOR "
    "in Unity."
)


def about(kind, radius=0.5, broken=()):
    return {"kind": kind, "radius": radius, "broken": [list(item) for item in broken]}


def identity(simulator="embedded", frames="shown", radius=0.5, broken=(), tasks=None):
    both = {PICK: about("pickup", radius, broken), PUT: about("put", radius, broken)}
    return {"simulator": simulator, "frames": frames, "tasks": both if tasks is None else tasks}


def config(**changes):
    return msgspec.convert(identity(**changes), ManipulationConfig)


def step(distance=1.0, *refusals):
    return ArmStep(distance=distance, refusals=refusals)


def episode(trajectory, index, ended="done", task=PICK, failure=None, excluded=None, **payload):
    kind = "pickup" if task == PICK else "put"
    record = ArmRecord(index=index, kind=kind, instruction="", ended=ended, **payload)
    return UnitRecord(
        task=task, id=f"{trajectory}/{index:04d}", cluster=trajectory, fingerprint="f",
        payload=record,
        failure=failure, excluded=excluded,
    )  # fmt: skip


MET_TWICE = step(1.0, COLLIDED, COLLIDED)
MET_AND_EMPTY = step(1.0, COLLIDED, "no objects in the sphere")
RECORDS = [
    episode("a", 1, starts_inside=True, closest=0.1, reward=2.0, steps=(step(), MET_TWICE)),
    episode("a", 5, "step limit", closest=0.4, steps=(MET_AND_EMPTY,) * 4),
    episode("b", 2, "gave up", starts_inside=True, closest=0.7),
    episode("b", 3, "", failure="out of memory"),
    episode("b", 9, "", excluded="no such scene"),
    episode("a", 7, task=PUT, closest=0.2, reward=2.0, steps=(step(),)),
    episode("b", 4, "released elsewhere", task=PUT, closest=0.6, steps=(step(),) * 3),
    episode("b", 8, "", task=PUT, excluded="no such scene"),
]


def summed(records=RECORDS, **changes):
    return summarise_manipulation(config(**changes), records)


def run(name="a policy", records=RECORDS, **changes):
    about = msgspec.structs.replace(config(**changes), model={"name": name})
    header = RunHeader(suite="manipulation", name=name, config=about)
    return RunSummary(header, ManipulationSuite().summarise(header, records))


def table(title, *runs):
    tables = ManipulationSuite().tables(runs)
    (matching,) = [table for table in tables if table.title.startswith(title)]
    return matching


def cells(row, printed_table):
    return dict(zip((column.name for column in printed_table.columns), row.cells, strict=False))


def own(printed_table):
    return [cells(row, printed_table) for row in printed_table.rows if not row.is_published]


def test_the_numbers_of_pick_ups():
    task = summed().tasks[PICK]
    assert (task.kind, task.radius, task.n_trajectories, task.n_failed) == ("pickup", 0.5, 2, 1)
    assert task.excluded == {"no such scene": 1}
    # A failure of the policy's is no result.
    assert (task.success.mean, task.success.n, task.success.n_all) == (pytest.approx(1 / 3), 3, 4)
    # It is not known of the failed one.
    assert (task.inside.mean, task.inside.n) == (pytest.approx(2 / 3), 3)
    assert task.closest == pytest.approx((0.1 + 0.4 + 0.7) / 3)
    assert task.steps == pytest.approx((2 + 4 + 0) / 3)
    assert task.collisions == pytest.approx((2 + 4 + 0) / 3)  # an empty grasp is none
    assert task.endings == {"done": 1, "failed": 1, "gave up": 1, "step limit": 1}


def test_the_numbers_of_puts():
    task = summed().tasks[PUT]
    assert (task.success.mean, task.success.n, task.n_trajectories) == (0.5, 2, 2)
    assert (task.released.mean, task.at_rest.mean) == (1.0, 0.5)
    assert (task.closest, task.steps, task.collisions) == (pytest.approx(0.4), 2, 0)
    assert task.endings == {"done": 1, "released elsewhere": 1}


def test_a_put_may_count_when_it_is_released():
    replace = msgspec.structs.replace
    records = [
        replace(record, payload=replace(record.payload, put_criterion="release"))
        for record in RECORDS
    ]
    task = summed(records).tasks[PUT]
    assert (task.success.mean, task.released.mean, task.at_rest.mean) == (1.0, 1.0, 0.5)
    assert list(task.outcomes.values()) == [1.0, 1.0]
    assert summed(records).tasks[PICK].success == summed().tasks[PICK].success


def test_a_summary_knows_no_order():
    assert summed(RECORDS[::-1]) == summed()


def test_nothing_counts_where_all_is_left_out():
    records = [
        episode("a", 1, "", excluded="no such scene"),
        episode("a", 2, "", excluded="no such scene", task=PUT),
    ]
    task = summed(records).tasks[PICK]
    assert (task.success, task.inside, task.closest, task.steps, task.collisions) == (None,) * 5
    assert (task.n_trajectories, task.endings, task.excluded) == (0, {}, {"no such scene": 1})
    (row,) = own(table("Low-level", run(records=records)))
    assert (row["Pick-up"], row["Put"], row["pick-ups"], row["excluded"]) == ("-", "-", "0", "2")


def test_table_6_has_the_published_columns_and_rows():
    printed_table = table("Low-level manipulation, success %", run())
    names = [column.name for column in printed_table.columns]
    assert names == ["model", "radius, m", "Pick-up", "Put", "pick-ups", "puts", "trajectories",
                     "excluded", "skipped",
                     "failed", "not asked", "Put, released", "Put, at rest",
                     "Pick-up above still", "Put above still"]  # fmt: skip
    published = [cells(row, printed_table) for row in printed_table.rows if row.is_published]
    assert [(row["model"], row["radius, m"], row["Pick-up"], row["Put"]) for row in published] == [
        ("OpenVLA 7B", "published, Table 6", "3.82", "6.38"),
        ("SpatialVLA 4B", "published, Table 6", "4.68", "9.14"),
    ]
    (row,) = own(printed_table)
    assert (row["model"], row["radius, m"]) == ("a policy", "0.5")
    assert row["Pick-up"].startswith("33.3 of 3 answered [") and row["Put"].startswith("50.0 [")
    assert row["Put, released"].startswith("100.0") and row["Put, at rest"] == row["Put"]
    assert [row[name] for name in ("pick-ups", "puts", "trajectories", "excluded", "skipped",
                                   "failed")] == [
        "4", "2", "2", "2", "0", "1",
    ]  # fmt: skip


def test_numbers_of_the_embedded_simulator_say_so_and_others_do_not():
    assert EMBEDDED in table("Low-level", run()).notes
    assert EMBEDDED in table("Low-level", run(simulator="unity"), run("other")).notes
    assert EMBEDDED not in table("Low-level", run(simulator="unity")).notes


def test_there_is_a_row_per_run_and_radius():
    runs = [
        run(radius=radius, frames=frames) for radius in (0.06, 0.5) for frames in ("shown", "blank")
    ]
    assert [(row["model"], row["radius, m"]) for row in own(table("Low-level", *runs))] == [
        ("a policy", "0.06"), ("a policy, blank frames", "0.06"),
        ("a policy", "0.5"), ("a policy, blank frames", "0.5"),
    ]  # fmt: skip


def test_tasks_of_one_run_with_several_radii_have_a_row_each():
    tasks = {"near": about("pickup", 0.06), "far": about("pickup", 0.5), PUT: about("put", 0.5)}
    records = [
        episode("a", 1, task="near"),
        episode("a", 2, "gave up", task="far"),
        episode("a", 7, task=PUT),
    ]
    rows = own(table("Low-level", run(records=records, tasks=tasks)))
    assert [(row["radius, m"], row["Pick-up"], row["Put"]) for row in rows] == [
        ("0.06, 0.5", "100.0", "100.0"), ("0.5", "0.0", "-"),
    ]  # fmt: skip


def test_episodes_and_endings_have_a_row_per_task():
    printed_table = table("Episodes", run())
    pick, put = own(printed_table)
    assert (pick["model"], pick["task"], pick["radius, m"]) == ("a policy", PICK, "0.5")
    assert pick["in the sphere at the start, %"].startswith("66.7 [")
    assert put["in the sphere at the start, %"] == "-"  # it is in the hand
    assert (pick["closest, m"], pick["steps"], pick["collisions"]) == ("0.40", "2.0", "2.0")
    pick, put = own(table("How episodes ended", run()))
    assert pick["step limit"] == "1"
    assert (pick["released elsewhere"], put["released elsewhere"]) == ("0", "1")


def test_success_above_the_floor_is_that_of_the_same_episodes():
    endings = {("a", 1): "done", ("a", 2): "done", ("b", 1): "gave up", ("b", 2): "done"}
    policy = [episode(*key, ended) for key, ended in endings.items()]
    gave_up = (episode(*key, "gave up") for key in [("a", 2), ("b", 1)])
    still = [episode("a", 1), *gave_up, episode("b", 7)]
    own_row, floor = own(table("Low-level", run(records=policy), run("still", still)))
    # Of the three that both have: 2 against 1.
    assert own_row["Pick-up above still"].startswith("33.3 of 3 answered [")
    assert (own_row["Put above still"], floor["Pick-up above still"]) == ("-", "-")
    (alone,) = own(table("Low-level", run(records=policy)))
    assert alone["Pick-up above still"] == "-"
    elsewhere, _ = own(table("Low-level", run(records=policy), run("still", still, radius=0.06)))
    assert elsewhere["Pick-up above still"] == "-"


def test_what_is_left_out_is_told_with_its_reason():
    broken = [("b.json", "b.json: not a trajectory"), ("c.json", "c.json: not a trajectory")]
    printed_table = table("Low-level", run(broken=broken))
    assert printed_table.notes[1:-2] == (
        "1 left out: b.json: not a trajectory",  # once, though both tasks read the file
        "1 left out: c.json: not a trajectory",
        "2 left out: no such scene",  # a pick-up and a put
    )
    assert own(printed_table)[0]["skipped"] == "2"
    both = table("Low-level", run(broken=broken), run("other", broken=broken))
    assert both.notes == printed_table.notes


def test_many_reasons_are_counted_at_the_end():
    records = [episode("a", index, "", excluded=f"reason {index}") for index in range(8)]
    notes = table("Low-level", run(records=records)).notes
    assert notes[1:-2] == (
        *(f"1 left out: reason {index}" for index in range(5)),
        "3 more reasons to leave out",
    )


def test_an_episode_that_ended_scores_and_no_other_does():
    suite = ManipulationSuite()
    assert suite.scores(RECORDS[0]) == {"success": 1.0, "reward": 2.0}
    assert suite.scores(RECORDS[1]) == {"success": 0.0, "reward": 0.0}
    assert suite.scores(RECORDS[3]) == {}

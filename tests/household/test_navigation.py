from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.household.navigation import GRID, Grid, GridPose

cells = st.frozensets(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=1, max_size=25)


def grid_of(chosen):
    return Grid((x * GRID + 0.125, z * GRID - 1.0) for x, z in chosen)


@given(cells, st.data())
def test_paths_lead_where_they_should_and_are_shortest(chosen, data):
    grid = grid_of(chosen)
    stands = sorted(GridPose(cell, facing) for cell in grid.cells for facing in (0, 90, 180, 270))
    start, goal = data.draw(st.sampled_from(stands)), data.draw(st.sampled_from(stands))
    distances = grid.distances(start)
    path = grid.path(start, goal)
    assert (path is None) == (goal not in distances)
    if path is not None:
        assert len(path) == distances[goal]
        assert walk(grid, start, path) == goal


@given(cells, st.data())
def test_distances_to_a_goal_are_the_lengths_of_the_paths_there(chosen, data):
    grid = grid_of(chosen)
    facing = st.sampled_from((0, 90, 180, 270))
    goal = GridPose(data.draw(st.sampled_from(sorted(grid.cells))), data.draw(facing))
    x, z = data.draw(st.sampled_from(sorted(grid.cells)))
    beside = st.integers(-1, 1)
    start = GridPose((x + data.draw(beside), z + data.draw(beside)), data.draw(facing))
    path = grid.path(start, goal)
    assert grid.distances_to(goal).get(start) == (None if path is None else len(path))


def test_a_goal_off_the_grid_is_stepped_onto():
    grid = grid_of([(0, 0), (0, 1)])
    goal = GridPose(max(grid.cells), 0)
    beyond = GridPose(goal.ahead, 0)
    assert grid.path(goal, beyond) is None
    distances = grid.distances_to(beyond)
    assert distances[goal] == 1 and distances[GridPose(min(grid.cells), 180)] == 4


def test_distances_to_a_goal_are_searched_for_once():
    grid = grid_of([(0, 0), (0, 1)])
    goal = GridPose(min(grid.cells), 0)
    assert grid.distances_to(goal) is grid.distances_to(goal)
    assert grid.distances_to(goal) != grid.distances_to(GridPose(goal.cell, 90))


def walk(grid, stand, path):
    ahead = {0: (0, 1), 90: (1, 0), 180: (0, -1), 270: (-1, 0)}
    for action in path:
        turn = {"RotateLeft": -90, "RotateRight": 90, "MoveAhead": 0}[action]
        cell = stand.cell
        if action == "MoveAhead":
            dx, dz = ahead[stand.facing]
            cell = (cell[0] + dx, cell[1] + dz)
            assert cell in grid.cells
        stand = GridPose(cell, (stand.facing + turn) % 360)
    return stand


@given(cells)
def test_positions_and_cells_agree(chosen):
    grid = grid_of(chosen)
    assert len(grid.cells) == len(chosen)
    assert all(grid.cell(*grid.position(cell)) == cell for cell in grid.cells)


def test_no_cells():
    assert not Grid([]).cells

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from infthor_eval.thor.segmentation import Segmentation, instances_of


@given(
    hnp.arrays(
        np.uint32, hnp.array_shapes(min_dims=2, max_dims=2, max_side=12), elements=st.integers(0, 3)
    )
)
def test_instances_count_and_box_every_code(codes):
    instances = instances_of(codes)
    assert set(instances) == set(np.unique(codes).tolist())
    for code, instance in instances.items():
        rows, columns = np.nonzero(codes == code)
        assert instance.pixels == len(rows)
        assert instance.box == (columns.min(), rows.min(), columns.max(), rows.max())


@given(
    hnp.arrays(
        np.uint32, hnp.array_shapes(min_dims=2, max_dims=2, max_side=12), elements=st.integers(0, 3)
    ),
    st.integers(1, 5),
)
def test_pixels_of_cells_are_those_of_the_named_codes_in_them(codes, grid):
    names = {0: "Mug|0", 2: "Bowl|1", 9: "Cup|2"}
    height, width = codes.shape
    expected = {
        name: [
            [
                sum(
                    codes[y, x] == code
                    for y in range(height)
                    for x in range(width)
                    if (y * grid // height, x * grid // width) == (row, column)
                )
                for column in range(grid)
            ]
            for row in range(grid)
        ]
        for code, name in names.items()
        if code in codes
    }
    cells = Segmentation(codes, names).cell_pixels(grid)
    assert {name: counts.tolist() for name, counts in cells.items()} == expected

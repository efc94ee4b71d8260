import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from infthor_eval.thor.segmentation import instances_of


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

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from controller.median import mean, median


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("axis", [None, 0, 1])
@given(data=st.data())
@settings(deadline=None, max_examples=30)
def test_median_is_numpys_to_the_last_bit(
    dtype: type[np.floating], axis: int | None, data: st.DataObject
) -> None:
    shape = data.draw(arrays.array_shapes(min_dims=2, max_dims=2, max_side=6))
    numbers = st.one_of(
        st.floats(-1e9, 1e9, width=32), st.just(float("nan")), st.sampled_from([0.0, 1.0])
    )
    values = data.draw(arrays.arrays(dtype, shape, elements=numbers))
    ours, theirs = median(values, axis), np.median(values, axis=axis)
    np.testing.assert_array_equal(ours, theirs)
    assert ours.dtype == theirs.dtype


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@given(data=st.data())
@settings(deadline=None, max_examples=50)
def test_mean_is_numpys_to_the_last_bit(dtype: type[np.floating], data: st.DataObject) -> None:
    shape = data.draw(arrays.array_shapes(min_dims=2, max_dims=2, max_side=12))
    numbers = st.floats(-1e9, 1e9, width=32)
    values = data.draw(arrays.arrays(dtype, shape, elements=numbers))
    for given_so in (values, values.T, values[::2]):
        np.testing.assert_array_equal(mean(given_so), float(given_so.mean()))

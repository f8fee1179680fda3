"""Tables that are written as TOML are read as they were, by Python's own reader."""

import datetime
import tomllib
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller import toml_text
from controller.bundles import bundle

words = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
plain = st.one_of(
    words, st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False)
)
values = st.recursive(
    plain,
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(words, inner, max_size=3)),
    max_leaves=12,
)


@settings(deadline=None)
@given(st.dictionaries(words, values, max_size=5))
def test_every_table_comes_back(table: dict[str, Any]) -> None:
    assert tomllib.loads(toml_text.dumps(table)) == table


def test_the_shipped_manifest_comes_back() -> None:
    table = bundle.manifest(bundle.unpack(bundle.default_path().read_bytes())[bundle.MANIFEST])
    assert tomllib.loads(toml_text.dumps(table)) == table


def test_times_come_back() -> None:
    table = {"a": [datetime.date(1979, 5, 27), datetime.time(7, 32)]}
    table["b"] = [datetime.datetime(1979, 5, 27, 7, 32, tzinfo=datetime.UTC)]
    assert tomllib.loads(toml_text.dumps(table)) == table


def test_what_toml_has_not_is_refused() -> None:
    with pytest.raises(TypeError, match="NoneType"):
        toml_text.dumps({"a": None})

"""Notices: every code that is used has a template, and as many arguments as it has fields."""

import ast
import copy
import pickle
import re
from collections.abc import Iterator

import pytest

from controller.adapt.few_shot import AdaptError
from controller.shared.notices import TEMPLATES, Notice, listed, notice
from tests.support import ROOT

PRODUCT = [
    ast.parse(path.read_text("utf-8"))
    for folder in ("controller", "host", "models")
    for path in (ROOT / folder).rglob("*.py")
]


def starred(node: ast.Call) -> bool:
    return any(isinstance(one, ast.Starred) for one in node.args)


def calls() -> Iterator[tuple[str, int]]:
    """Yield the code and the number of values of each call of `notice` with a code."""
    for tree in PRODUCT:
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "notice":
                code = node.args[0]
                if isinstance(code, ast.Constant) and not starred(node):
                    yield str(code.value), len(node.args) - 1


def test_every_call_has_a_value_for_each_field_of_its_template() -> None:
    found = set(calls())
    assert len(found) > 60
    fields = {code: len(re.findall(r"\{", template)) for code, template in TEMPLATES.items()}
    assert [(code, count, fields.get(code)) for code, count in found if fields[code] != count] == []


def test_every_code_is_used() -> None:
    words = {
        node.value
        for tree in PRODUCT
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    dynamic = {"rows", "columns", "stiff_advice", "turned_advice", "mirrored_advice"}
    assert set(TEMPLATES) - words - dynamic == set()


def test_a_notice_is_its_english_sentence_with_code_and_arguments() -> None:
    made = notice("suffer", 0.934)
    assert made.startswith("the other gestures would suffer: 93% of those")
    assert (made.code, made.arguments) == ("suffer", ("93%",))
    assert notice("no_gesture", "tap") == "there is no gesture 'tap'"
    assert listed(["a", 2, notice("row", 3)]) == "a, 2 and row 3"
    assert listed([1]) == "1"


@pytest.mark.parametrize(("code", "values"), [("row", ()), ("row", (1, 2)), ("undone", (1,))])
def test_too_few_or_too_many_values_are_refused(code: str, values: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="argument"):
        notice(code, *values)


def test_an_error_a_copy_and_another_process_keep_the_notice() -> None:
    inner = notice("line_drifted", notice("row", 2), 20.0)
    for kept in (
        str(AdaptError(inner)),
        copy.deepcopy(inner),
        pickle.loads(pickle.dumps(inner)),
        notice("the_bundle", AdaptError(inner)).arguments[0],
    ):
        assert isinstance(kept, Notice)
        assert (kept.code, kept.arguments) == (inner.code, inner.arguments)
        assert isinstance(kept.arguments[0], Notice)

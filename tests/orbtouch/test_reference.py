"""The reference: every public name is in an example, and those of its page run."""

import ast
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import orbtouch
from orbtouch import plugins
from tests.support import ROOT

BLOCKS = re.findall(
    r"^```python\n(.*?)^```", (ROOT / "docs" / "api.md").read_text(encoding="utf-8"), re.S | re.M
)


def names_of(code: str, module: str) -> Iterator[str]:
    """Yield names that code takes from `orbtouch` or `plugins`, as attributes or by import."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == module:
            yield node.attr
        elif isinstance(node, ast.ImportFrom) and (node.module or "").endswith(module):
            yield from (alias.name for alias in node.names)


@pytest.mark.parametrize(("module", "names"), [("orbtouch", orbtouch), ("plugins", plugins)])
def test_every_public_name_is_in_an_example(module: str, names: Any) -> None:
    examples = (path.read_text(encoding="utf-8") for path in (ROOT / "examples").rglob("*.py"))
    used = {name for code in (*BLOCKS, *examples) for name in names_of(code, module)}
    assert sorted({*names.__all__} - used) == []


@pytest.mark.train
def test_the_examples_of_the_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    space: dict[str, Any] = {}
    for block in BLOCKS:
        exec(block, space)
    assert float(space["mine"].recall) > 0.5
    file = io.StringIO()
    space["FileTap"](file).gesture("press", 40)
    assert file.getvalue() == "40 press\n"
    link = space["create"]("file:messages.txt", None, plugins.Access())
    link.send(plugins.ContactState(7), 40)
    link.close()
    assert (tmp_path / "messages.txt").read_text().startswith("40 ContactState(frame=7")
    assert space["sentence"](plugins.Lost("gone")) == "gone"

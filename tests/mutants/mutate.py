"""List the mutations of a source file: single edits that a test should notice.

Operators, `not`, numbers, booleans, slice bounds, conditions and return values are mutated.
Docstrings, texts, annotations, decorators, assertions, raised errors and log calls are not. Nor
is `daemon` of threads: tests/project/test_threads.py holds it everywhere. Nor are named constants
and `timeout`: another limit is a decision, and a test that repeats its value shows nothing.
"""

import ast
import copy
import random
import re
from collections.abc import Iterator
from typing import Final, NamedTuple

_OTHERS: Final = {  # each operator, and what replaces it
    "Lt": "LtE GtE", "LtE": "Lt Gt", "Gt": "GtE LtE", "GtE": "Gt Lt", "Eq": "NotEq", "NotEq": "Eq",
    "Is": "IsNot", "IsNot": "Is", "In": "NotIn", "NotIn": "In", "And": "Or", "Or": "And",
    "Add": "Sub", "Sub": "Add", "Mult": "Div", "Div": "Mult", "FloorDiv": "Mult", "Mod": "Mult",
    "Pow": "Mult", "LShift": "RShift", "RShift": "LShift", "BitAnd": "BitOr", "BitOr": "BitAnd",
    "BitXor": "BitAnd",
}  # fmt: skip
_RETURNS: Final = (  # annotation, what is returned instead
    (r"\| None$", "None"), (r"^bool$", "not ({})"), (r"^(int|float)$", "({}) + 1"),
    (r"^(list|tuple|bytes|str)\b", "({})[:0]"),
)  # fmt: skip
_SKIPPED: Final = ("annotation", "returns", "decorator_list", "bases", "type_params")
_LOG: Final = re.compile(r"_?log(ging|ger)?\.(debug|info|warning|error|exception|log)|TypeVar|cast")
_CONSTANT: Final = re.compile(r"_?[A-Z][A-Z0-9_]*(: Final)? = ")
_FIXED: Final = re.compile(r"TYPE_CHECKING|__name__ == '__main__'|.*\bsys\.platform\b.*")


class Mutation(NamedTuple):
    """One edit of one file: bytes from `start` to `end` are replaced by a text."""

    file: str  # path from the repository's root
    line: int  # number of its first line, from 1
    was: str  # the lines that it changes, joined by spaces
    becomes: str  # the same lines afterwards
    start: int
    end: int
    text: str

    def applied(self, source: bytes) -> bytes:
        """Return the file after the edit."""
        return source[: self.start] + self.text.encode() + source[self.end :]


def mutations(file: str, source: bytes) -> list[Mutation]:
    """Return every mutation of a file, in the order of the text."""
    starts = [0, *(match.end() for match in re.finditer(rb"\n", source))]
    found = set()
    for node, text in _walk(ast.parse(source), ""):
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        start = starts[node.lineno - 1] + node.col_offset
        end = starts[node.end_lineno - 1] + node.end_col_offset
        text = text.replace("{}", source[start:end].decode())
        first, last = starts[node.lineno - 1], source.find(b"\n", end)
        was, becomes = (
            " ".join(part.decode().split())
            for part in (
                source[first:last],
                source[first:start] + text.encode() + source[end:last],
            )
        )
        found.add(Mutation(file, node.lineno, was, becomes, start, end, text))
    return sorted(found)


def draw(found: list[Mutation], seed: int, count: int) -> list[Mutation]:
    """Return `count` mutations drawn at random, at most one of a line; every line is as likely."""
    lines: dict[tuple[str, int], list[Mutation]] = {}
    for mutation in found:
        lines.setdefault((mutation.file, mutation.line), []).append(mutation)
    chance = random.Random(seed)
    places = chance.sample(sorted(lines), min(count, len(lines)))
    return [chance.choice(lines[place]) for place in places]


def _walk(node: ast.AST, returns: str) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    """Yield the expressions below a node and their replacements; {} is what they were."""
    if isinstance(node, (ast.JoinedStr, ast.Raise, ast.Assert)) or (
        (isinstance(node, ast.Call) and _LOG.fullmatch(ast.unparse(node.func)))
        or (isinstance(node, ast.keyword) and node.arg in ("strict", "daemon", "timeout"))
        or (isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__slots__")
        or (isinstance(node, (ast.BinOp, ast.AugAssign)) and _is_union(node))
        or (isinstance(node, (ast.Assign, ast.AnnAssign)) and _CONSTANT.match(ast.unparse(node)))
        or (isinstance(node, ast.If) and _FIXED.fullmatch(ast.unparse(node.test)))
    ):
        return
    if isinstance(node, ast.FunctionDef):
        returns = ast.unparse(node.returns) if node.returns else ""
    if isinstance(node, (ast.expr, ast.AugAssign)):
        yield from ((node, text) for text in _operators(node))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield node, f"({ast.unparse(node.operand)})"
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield node, str(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        yield from ((node, repr(node.value + step)) for step in (1, -1))
    elif isinstance(node, (ast.If, ast.IfExp)):
        yield node.test, "not ({})"
    elif isinstance(node, ast.Slice):
        yield from ((bound, "None") for bound in (node.lower, node.upper) if bound)
    elif isinstance(node, ast.Return) and not isinstance(
        node.value, (ast.Constant, ast.JoinedStr, type(None))
    ):
        new = next((new for kind, new in _RETURNS if re.search(kind, returns)), "")
        if new and ast.unparse(node.value) not in ("[]", "()"):
            yield node.value, new
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and name not in _SKIPPED:
                yield from _walk(child, returns)


def _operators(node: ast.expr | ast.AugAssign) -> Iterator[str]:
    """Yield an expression with each of its operators replaced."""
    kinds = node.ops if isinstance(node, ast.Compare) else [getattr(node, "op", None)]
    for index, kind in enumerate(kinds):
        for other in _OTHERS.get(type(kind).__name__, "").split():
            changed = copy.deepcopy(node)
            if isinstance(changed, ast.Compare):
                changed.ops[index] = getattr(ast, other)()
            else:
                changed.op = getattr(ast, other)()  # type: ignore[union-attr]
            text = ast.unparse(changed)
            yield text if isinstance(node, ast.AugAssign) else f"({text})"


def _is_union(node: ast.BinOp | ast.AugAssign) -> bool:
    """Return whether an operator joins classes, or texts."""
    sides = (node.value,) if isinstance(node, ast.AugAssign) else (node.left, node.right)
    return any(
        isinstance(side, ast.JoinedStr)
        or (isinstance(side, ast.Constant) and isinstance(side.value, (str, bytes)))
        or (isinstance(side, ast.Name) and bool(re.match(r"[A-Z][A-Za-z]*[a-z]", side.id)))
        for side in sides
    )

"""List the mutations of a source file: single edits that a test should notice.

Operators (comparison, arithmetic, `and`/`or`), removed `not`, constants (a number plus and minus
one, negated booleans), slice bounds, return values and swapped branches. Docstrings, texts,
annotations, `__slots__`, decorators, assertions, raised errors and log calls are not changed.
"""

from __future__ import annotations

import ast
import random
import re
from itertools import pairwise
from typing import Final, NamedTuple

_OPERATORS: Final[dict[type[ast.AST], tuple[str, ...]]] = {  # each, and what replaces it
    ast.Lt: ("<", "<=", ">="), ast.LtE: ("<=", "<", ">"), ast.Eq: ("==", "!="),
    ast.Gt: (">", ">=", "<="), ast.GtE: (">=", ">", "<"), ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"),
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"), ast.Mod: ("%", "*"), ast.Pow: ("**", "*"),
    ast.LShift: ("<<", ">>"), ast.RShift: (">>", "<<"),
    ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"), ast.BitXor: ("^", "&"),
    ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
_BEFORE_OPERATOR: Final = re.compile(rb"(?:[\s()\\]|#[^\n]*\n)*")
_LOG_METHODS: Final = ("debug", "info", "warning", "error", "exception", "log")


class Edit(NamedTuple):
    """Bytes from `start` to `end` of a source file are replaced by a text."""

    start: int
    end: int
    new: str

    def applied(self, source: bytes) -> bytes:
        """Return the file after the edit."""
        return source[: self.start] + self.new.encode() + source[self.end :]


class Mutation(NamedTuple):
    """One edit of one file."""

    file: str  # path from the repository's root
    line: int  # number of its first line, from 1
    was: str  # the lines that it changes, each stripped, joined by spaces
    becomes: str  # the same lines afterwards
    edit: Edit  # the change


def mutations(file: str, source: bytes) -> list[Mutation]:
    """Return every mutation of a file, in the order of the text."""
    walk = _Walk(source)
    walk.visit(ast.parse(source))
    return [_mutation(file, source, edit) for edit in sorted(set(walk.edits))]


def draw(found: list[Mutation], seed: int, count: int) -> list[Mutation]:
    """Return `count` mutations drawn at random, at most one of a line; every line is as likely."""
    lines: dict[tuple[str, int], list[Mutation]] = {}
    for mutation in found:
        lines.setdefault((mutation.file, mutation.line), []).append(mutation)
    chance = random.Random(seed)
    places = chance.sample(sorted(lines), min(count, len(lines)))
    return [chance.choice(lines[place]) for place in places]


def _mutation(file: str, source: bytes, edit: Edit) -> Mutation:
    first, last = source.rfind(b"\n", 0, edit.start) + 1, source.find(b"\n", edit.end)
    mutated = edit.applied(source)
    becomes = mutated[first : last + len(mutated) - len(source)]
    line = source.count(b"\n", 0, edit.start) + 1
    return Mutation(file, line, _joined(source[first:last]), _joined(becomes), edit)


def _joined(lines: bytes) -> str:
    return " ".join(line.strip() for line in lines.decode().splitlines())


class _Walk(ast.NodeVisitor):
    """Collects the edits of a syntax tree."""

    def __init__(self, source: bytes) -> None:
        self.edits: list[Edit] = []
        self._source = source
        self._lines = [0, *(match.end() for match in re.finditer(rb"\n", source))]
        self._returns = ""  # annotation of the function around

    def _skip(self, node: ast.AST) -> None:
        """Leave a part of the tree alone."""

    visit_JoinedStr = visit_Raise = visit_Assert = _skip  # noqa: N815

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for statement in node.body:
            self.visit(statement)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        outer, self._returns = self._returns, ast.unparse(node.returns) if node.returns else ""
        for child in (node.args, *node.body):
            self.visit(child)
        self._returns = outer

    def visit_arg(self, node: ast.arg) -> None:
        """Leave annotations alone."""

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_Assign(self, node: ast.Assign) -> None:
        if ast.unparse(node.targets[0]) != "__slots__":
            self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        name = ast.unparse(node.func)
        if re.fullmatch(rf"_?log(ging|ger)?\.({'|'.join(_LOG_METHODS)})", name):
            return
        typed = {"cast": slice(1, None), "isinstance": slice(0, 1)}.get(name, slice(None))
        keywords = () if name == "zip" else node.keywords  # strict=True is an assertion
        for child in (node.func, *node.args[typed], *keywords):
            self.visit(child)

    def visit_Compare(self, node: ast.Compare) -> None:
        operands = pairwise((node.left, *node.comparators))
        for kind, (left, right) in zip(node.ops, operands, strict=True):
            self._operator(left, kind, right)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if isinstance(node.op, ast.BitOr) and _is_type(node.left):
            return
        if not (_is_text(node.left) or _is_text(node.right)):
            self._operator(node.left, node.op, node.right)
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        if not _is_text(node.value):
            self._operator(node.target, node.op, node.value)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        for left, right in pairwise(node.values):
            self._operator(left, node.op, right)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.Not):
            start, _ = self._span(node)
            self.edits.append(Edit(start, start + len("not"), ""))
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, bool):
            self._replace(node, str(not node.value))
        elif isinstance(node.value, (int, float)):
            self._replace(node, repr(node.value + 1))
            self._replace(node, repr(node.value - 1))

    def visit_Slice(self, node: ast.Slice) -> None:
        for bound in (node.lower, node.upper):
            if bound is not None:
                self._replace(bound, "")
                if not any(isinstance(part, ast.Constant) for part in ast.walk(bound)):
                    self._replace(bound, "({}) + 1")
        self.generic_visit(node)

    def visit_If(self, node: ast.If) -> None:
        if ast.unparse(node.test) not in ("TYPE_CHECKING", "__name__ == '__main__'"):
            self._replace(node.test, "not ({})")
            self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._replace(node.test, "not ({})")
        self.generic_visit(node)

    def visit_Return(self, node: ast.Return) -> None:
        if not (node.value is None or _is_text(node.value) or _is_trivial(node.value)):
            for pattern, new in _RETURNS:
                if re.search(pattern, self._returns):
                    self._replace(node.value, new)
                    break
        self.generic_visit(node)

    def _operator(self, left: ast.expr, kind: ast.AST, right: ast.expr) -> None:
        """Replace the operator that stands between two operands."""
        old, *others = _OPERATORS.get(type(kind), ("",))
        before = _BEFORE_OPERATOR.match(self._source, self._span(left)[1], self._span(right)[0])
        assert before is not None
        start = before.end()
        self.edits += [Edit(start, start + len(old), new) for new in others]

    def _replace(self, node: ast.expr, new: str) -> None:
        """Replace an expression; {} stands for what it was."""
        start, end = self._span(node)
        self.edits.append(Edit(start, end, new.replace("{}", self._source[start:end].decode())))

    def _span(self, node: ast.expr) -> tuple[int, int]:
        """Return where a node begins and ends, bytes."""
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        start = self._lines[node.lineno - 1] + node.col_offset
        return start, self._lines[node.end_lineno - 1] + node.end_col_offset


_RETURNS: Final = (  # annotation, what is returned instead
    (r"\| None$", "None"),
    (r"^bool$", "not ({})"),
    (r"^(int|float)$", "({}) + 1"),
    (r"^(list|tuple|bytes|str)\b", "({})[:0]"),
)


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, (str, bytes))
    )


def _is_trivial(node: ast.AST) -> bool:
    """Return whether a value is mutated as a constant, or is empty."""
    return isinstance(node, ast.Constant) or ast.unparse(node) in ("[]", "()")


def _is_type(node: ast.AST) -> bool:
    """Return whether the left side of `|` is a class: a union of types."""
    return isinstance(node, ast.Name) and node.id[:1].isupper() and not node.id.isupper()

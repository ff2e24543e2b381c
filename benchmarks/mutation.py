"""Mutants of Python source: one sign, comparison or index changed, at its exact place.

Only expressions inside functions change: numbers and tables at the level of a module, defaults, annotations and text
stay. A mutant is known by its function and its expression, so that it can be found again in another version of the
code, whatever file or line it stands on there.
"""

import ast
import io
import tokenize
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

COMPARISONS = {
    "<": ("<=", ">"),
    "<=": ("<", ">="),
    ">": (">=", "<"),
    ">=": (">", "<="),
    "==": ("!=",),
    "!=": ("==",),
}
"""Comparison: its replacements."""
SIGNS: dict[type[ast.operator], tuple[str, str]] = {ast.Add: ("+", "-"), ast.Sub: ("-", "+")}
"""Operator: its text, and the text that replaces it."""
TEXT_OR_LIST = (ast.JoinedStr, ast.List, ast.Tuple, ast.ListComp)
"""Operands that are joined, not added: without a sign to change."""


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """One change, by names that outlive a move to another file or line."""

    file: str
    """Path relative to the repository, with slashes."""
    line: int
    function: str
    """Name of the function with the classes and functions around it: `Body.mass`."""
    statement: str
    """The statement, of a compound one its first line, as `ast.unparse` writes it."""
    expression: str
    """The changed expression before the change, as `ast.unparse` writes it."""
    change: str
    """Such as "+ to -"."""
    occurrence: int
    """0 for the first such change of such an expression in the function."""

    def __str__(self) -> str:
        return f"{self.file}:{self.line} {self.function}: {self.expression} [{self.change}]"


@dataclass(frozen=True, kw_only=True)
class Site:
    """A mutant with its place in one source text."""

    mutant: Mutant
    start: int
    """Offset of the first replaced character."""
    end: int
    """Offset after the last replaced character."""
    text: str
    """The replacement."""
    lines: range
    """Lines of the statement, of a compound one without its body."""

    def applied(self, source: str) -> str:
        """Return the source with this one change."""
        return source[: self.start] + self.text + source[self.end :]


def sites_of_rooms(repository: Path, rooms: Sequence[str]) -> list[Site]:
    """Return the sites of every source file in the rooms, by file and position."""
    files = sorted(path for room in rooms for path in (repository / room).rglob("*.py"))
    return [
        site
        for path in files
        for site in sites_of(path.read_text(encoding="utf-8"), path.relative_to(repository).as_posix())
    ]


def sites_of(source: str, file: str) -> list[Site]:
    """Return the sites of one source text, by position."""
    place = _Places(source)
    seen: Counter[tuple[str, str, str]] = Counter()
    sites: list[Site] = []
    changes = [
        (start, end, text, node, change, scope)
        for node, scope in _expressions(ast.parse(source), _Scope())
        for start, end, text, change in _changes(node, scope, place)
    ]
    for start, end, text, node, change, scope in sorted(changes, key=lambda found: found[:3]):
        assert scope.statement is not None
        expression = ast.unparse(node)
        name = (scope.function, expression, change)
        mutant = Mutant(
            file=file,
            line=place.line_of(start),
            function=scope.function,
            statement=ast.unparse(scope.statement).partition("\n")[0],
            expression=expression,
            change=change,
            occurrence=seen[name],
        )
        seen[name] += 1
        sites.append(Site(mutant=mutant, start=start, end=end, text=text, lines=_lines(scope.statement)))
    return sites


def find(mutant: Mutant, sites: Sequence[Site]) -> Site | None:
    """Return the site of a mutant that was drawn from another version of the code, or None.

    The function and the expression have to be the same. Among several the file of the same path decides, then of the
    same name. Where the function has another name, the same statement decides if there is only one.
    """

    def name(each: Mutant) -> tuple[str, str, str, int]:
        return each.function, each.expression, each.change, each.occurrence

    def meaning(each: Mutant) -> tuple[str, str, str]:
        return each.statement, each.expression, each.change

    same = [site for site in sites if name(site.mutant) == name(mutant)]
    here = [site for site in same if site.mutant.file == mutant.file]
    nearby = [site for site in same if Path(site.mutant.file).name == Path(mutant.file).name]
    elsewhere = [site for site in sites if meaning(site.mutant) == meaning(mutant)]
    for found in (here, nearby, same, [] if same else elsewhere):
        if len(found) == 1:
            return found[0]
    return None


@dataclass(frozen=True, kw_only=True)
class _Scope:
    """Where an expression stands."""

    names: tuple[str, ...] = ()
    inside_function: bool = False
    counters: frozenset[str] = frozenset()
    """Names that hold whole numbers in this function."""
    statement: ast.stmt | None = None

    @property
    def function(self) -> str:
        return ".".join(self.names)


def _expressions(node: ast.AST, scope: _Scope) -> Iterator[tuple[ast.expr | ast.stmt, _Scope]]:
    """Yield the expressions below a node that may be changed, with their scope."""
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
        counters = scope.counters | _counters(node)
        inner = _Scope(names=(*scope.names, node.name), inside_function=True, counters=counters)
        for child in node.body:
            yield from _expressions(child, inner)
        return
    if isinstance(node, ast.ClassDef):
        for child in node.body:
            yield from _expressions(child, _Scope(names=(*scope.names, node.name)))
        return
    if isinstance(node, (ast.JoinedStr, ast.arguments, ast.pattern)):  # of f-strings Python 3.11 tells no place
        return
    if isinstance(node, ast.stmt):
        scope = _Scope(
            names=scope.names, inside_function=scope.inside_function, counters=scope.counters, statement=node
        )
    if scope.inside_function and isinstance(node, (ast.expr, ast.AugAssign)):
        yield node, scope
    for field, value in ast.iter_fields(node):
        if field == "annotation":
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _expressions(child, scope)


def _changes(node: ast.AST, scope: _Scope, place: "_Places") -> Iterator[tuple[int, int, str, str]]:
    """Yield start, end, new text and name of each change of one expression."""
    if isinstance(node, ast.BinOp) and type(node.op) in SIGNS and not (_joins(node.left) or _joins(node.right)):
        old, new = SIGNS[type(node.op)]
        start = place.operator(old, place.end(node.left), place.start(node.right))
        yield start, start + len(old), new, f"{old} to {new}"
    elif isinstance(node, ast.AugAssign) and type(node.op) in SIGNS and not _joins(node.value):
        old, new = (sign + "=" for sign in SIGNS[type(node.op)])
        start = place.operator(old, place.end(node.target), place.start(node.value))
        yield start, start + len(old), new, f"{old} to {new}"
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        if place.start(node) not in place.indices:
            yield place.start(node), place.start(node) + 1, "", "- dropped"
    elif isinstance(node, ast.Compare):
        operands = [node.left, *node.comparators]
        for left, right in zip(operands, node.comparators, strict=False):
            start = place.end(left)
            old, start = place.comparison(start, place.start(right))
            for new in COMPARISONS.get(old, ()):
                yield start, start + len(old), new, f"{old} to {new}"
    elif isinstance(node, ast.Subscript):
        for index in _indices(node.slice):
            old = ast.unparse(index)
            value = _whole(index)
            if value is not None:
                place.indices.add(place.start(index))
                new = "1" if value == 0 else str(value - 1)
            elif isinstance(index, ast.Name) and index.id in scope.counters:
                new = f"{old} - 1"
            else:
                continue
            yield place.start(index), place.end(index), new, f"[{old}] to [{new}]"


def _joins(operand: ast.expr) -> bool:
    """Tell text and lists, which `+` joins, from numbers."""
    if isinstance(operand, ast.BinOp):
        return _joins(operand.left) or _joins(operand.right)
    return isinstance(operand, TEXT_OR_LIST) or (
        isinstance(operand, ast.Constant) and isinstance(operand.value, (str, bytes))
    )


def _indices(index: ast.expr) -> Iterator[ast.expr]:
    """Yield the single indices of a subscript: of each axis, and both ends of a slice."""
    for axis in index.elts if isinstance(index, ast.Tuple) else [index]:
        if isinstance(axis, ast.Slice):
            yield from (end for end in (axis.lower, axis.upper) if end is not None)
        else:
            yield axis


def _whole(node: ast.expr) -> int | None:
    """Return the value of a literal whole number, or None."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        value = _whole(node.operand)
        return None if value is None else -value
    return node.value if isinstance(node, ast.Constant) and type(node.value) is int else None


def _counters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> frozenset[str]:
    """Return the names that hold whole numbers: of loops over ranges, and of arguments annotated so."""
    arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    names = {each.arg for each in arguments if isinstance(each.annotation, ast.Name) and each.annotation.id == "int"}
    for node in ast.walk(function):
        if not isinstance(node, (ast.For, ast.comprehension)) or not isinstance(node.iter, ast.Call):
            continue
        called = ast.unparse(node.iter.func)
        target = node.target
        if called == "enumerate" and isinstance(target, ast.Tuple):
            target = target.elts[0]
        elif called not in ("range", "prange"):
            continue
        if isinstance(target, ast.Name):
            names.add(target.id)
    return frozenset(names)


def _lines(statement: ast.stmt) -> range:
    """Return the lines of a statement, of a compound one those before its body."""
    last = statement.end_lineno or statement.lineno
    inner = [node.lineno for node in ast.walk(statement) if isinstance(node, ast.stmt) and node is not statement]
    if inner:
        last = max(statement.lineno, min(inner) - 1)
    return range(statement.lineno, last + 1)


class _Places:
    """Offsets of nodes and operators in a source text."""

    def __init__(self, source: str) -> None:
        self._lines = list(io.StringIO(source))  # as ast and tokenize count lines
        self._starts = [0]
        for line in self._lines:
            self._starts.append(self._starts[-1] + len(line))
        tokens = tokenize.generate_tokens(io.StringIO(source).readline)
        kinds = (tokenize.OP, tokenize.NAME)
        self._tokens = [
            (self._starts[token.start[0] - 1] + token.start[1], token.string) for token in tokens if token.type in kinds
        ]
        self.indices: set[int] = set()
        """Offsets of the literal indices met so far; their own sign is part of the number."""

    def start(self, node: ast.expr) -> int:
        return self._offset(node.lineno, node.col_offset)

    def end(self, node: ast.expr) -> int:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return self._offset(node.end_lineno, node.end_col_offset)

    def line_of(self, offset: int) -> int:
        return bisect_left(self._starts, offset + 1)

    def operator(self, text: str, start: int, end: int) -> int:
        """Return the offset of the only operator `text` between two offsets."""
        (found,) = (at for at, token in self._between(start, end) if token == text)
        return found

    def comparison(self, start: int, end: int) -> tuple[str, int]:
        """Return the comparison between two offsets, and where it starts; of `is not` and `not in` the first word."""
        at, token = next((at, token) for at, token in self._between(start, end) if token not in "()")
        return token, at

    def _between(self, start: int, end: int) -> list[tuple[int, str]]:
        return self._tokens[bisect_left(self._tokens, (start, "")) : bisect_left(self._tokens, (end, ""))]

    def _offset(self, line: int, column: int) -> int:
        """Return the offset of a line and a column that counts bytes, as `ast` does."""
        return self._starts[line - 1] + len(self._lines[line - 1].encode()[:column].decode())

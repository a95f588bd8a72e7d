"""Check templates against the classes of their contents.

Every name must be a field, through attributes, loops and properties, in branches that no run takes,
too. A condition tests one field or property; conditions nest at most one deep.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import importlib
import inspect
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jinja2 import nodes

from ..errors import did_you_mean
from .templates import FILTERS, PageContent, environment, signature_of

# What a template calls; the fields of its arguments are checked, their number is not.
_MACROS = (
    "table",
    "titled",
    "block",
    "blocks",
    "items",
    "code_block",
    "verdict",
    "small",
    "question",
    "written_table",
    "section",
)
_DEEPEST = 2  # conditions inside each other: one, and one in it


@dataclass(frozen=True)
class TemplateFault:
    """What is wrong in a template.

    Attributes:
        template: Name of the file.
        line: Of the template.
        text: What is wrong.
    """

    template: str
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.template}:{self.line}: {self.text}"


def faults_of(content: type[PageContent], source: str | None = None) -> list[TemplateFault]:
    """Return what is wrong in the template of a content, from its syntax tree alone.

    Args:
        content: A dataclass.
        source: Text of the template; by default that of its file.
    """
    jinja = environment(content.__module__)
    if source is None:
        assert jinja.loader is not None
        source = jinja.loader.get_source(jinja, content.template)[0]
    checker = _Checker(content.template)
    names = {field: types_ for field, types_ in members_of(content).items() if field != "template"}
    checker.visit_all(jinja.parse(source).body, names, 0)
    return checker.faults


def label_faults(source: str, template: str) -> list[TemplateFault]:
    """Return what is wrong in a template of labels: it has macros alone, which name what they take.

    Args:
        source: Text of the template.
        template: Name of the file.
    """
    checker = _Checker(template)
    for node in environment(__name__).parse(source).body:
        if isinstance(node, nodes.Macro):
            checker.visit_all(node.body, {argument.name: str for argument in node.args}, 0)
        elif not (isinstance(node, nodes.Output) and _is_blank(node)):
            checker.add_fault(node, "a template of labels has macros alone")
    return checker.faults


def _is_blank(node: nodes.Output) -> bool:
    """Tell whether a part of a template is only the space between others."""
    texts = [part for part in node.nodes if isinstance(part, nodes.TemplateData)]
    return len(texts) == len(node.nodes) and not any(text.data.strip() for text in texts)


@functools.cache
def members_of(kind: type) -> dict[str, Any]:
    """Return the types of the fields and properties of a class, by name."""
    names = _names_for_checking(kind.__module__) if dataclasses.is_dataclass(kind) else {}
    members: dict[str, Any] = {}
    if dataclasses.is_dataclass(kind):
        members = typing.get_type_hints(kind, localns=names)
    for base in reversed(kind.__mro__):
        for name, member in vars(base).items():
            if isinstance(member, property) and member.fget is not None:
                members[name] = typing.get_type_hints(member.fget, localns=names).get("return", Any)
            elif isinstance(member, functools.cached_property):
                members[name] = typing.get_type_hints(member.func, localns=names).get("return", Any)
    return members


@functools.cache
def _names_for_checking(module: str) -> dict[str, Any]:
    """Return what a module imports for type checkers alone, by name."""
    names: dict[str, Any] = {}
    tree = ast.parse(inspect.getsource(importlib.import_module(module)))
    for node in tree.body:
        if not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            continue
        for imported in node.body:
            if isinstance(imported, ast.ImportFrom) and imported.level:
                path = f"{'.' * imported.level}{imported.module}"
                source = importlib.import_module(path, module.rpartition(".")[0])
                names |= {alias.name: getattr(source, alias.name) for alias in imported.names}
    return names


class _Checker:
    """Walk a template's syntax tree with the type of each name that is in scope."""

    def __init__(self, template: str) -> None:
        self.template = template
        self.faults: list[TemplateFault] = []

    def visit_all(self, body: Sequence[nodes.Node], names: Mapping[str, Any], depth: int) -> None:
        """Check statements in their order; what one of them sets, the next may name."""
        scope = dict(names)
        for node in body:
            self._visit(node, scope, depth)

    def _visit(self, node: nodes.Node, scope: dict[str, Any], depth: int) -> None:
        match node:
            case nodes.Output():
                for part in node.nodes:
                    if isinstance(part, nodes.Const) and not isinstance(part.value, str):
                        self.add_fault(part, f"a page shows no {part.value!r}")
                    self._check_shown(part, self._type_of(part, scope, depth))
            case nodes.If():
                self._check_condition(node.test, scope, depth)
                branches = [node.body, node.else_, *(branch.body for branch in node.elif_)]
                for branch in node.elif_:
                    self._check_condition(branch.test, scope, depth)
                for branch in branches:
                    self.visit_all(branch, scope, depth + 1)
            case nodes.For():
                element = _element_of(self._type_of(node.iter, scope, depth))
                inside = scope | self._bound(node.target, element)
                if node.test is not None:
                    self._check_condition(node.test, inside, depth)
                self.visit_all(node.body, inside | {"loop": Any}, depth)
                self.visit_all(node.else_, scope, depth)
            case nodes.Assign():
                scope |= self._bound(node.target, self._type_of(node.node, scope, depth))
            case nodes.CallBlock():
                self._type_of(node.call, scope, depth)
                self.visit_all(node.body, scope, depth)
            case nodes.TemplateData():
                pass
            case _:
                self.add_fault(node, f"{type(node).__name__} has no place in a template")

    def _check_shown(self, node: nodes.Node, kind: Any) -> None:
        """Report a value that a page shows through a filter alone: a figure, a flag, a list."""
        kind = _without_none(kind)
        plain = typing.get_origin(kind) or kind
        if plain is Any or not isinstance(plain, type):
            return
        if plain is bool or not issubclass(plain, (str, int)):
            self.add_fault(node, f"a page shows no {plain.__name__} without a filter")

    def _bound(self, target: nodes.Node, kind: Any) -> dict[str, Any]:
        """Return the names that a loop or an assignment makes, with their types."""
        if isinstance(target, nodes.Name):
            return {target.name: kind}
        bound: dict[str, Any] = {}
        if isinstance(target, nodes.Tuple):
            if kind is str:
                self.add_fault(target, "a text is no pair: a loop over a table takes its keys")
            parts = _parts_of(kind, len(target.items))
            for item, part in zip(target.items, parts, strict=True):
                bound |= self._bound(item, part)
        return bound

    def _check_condition(self, test: nodes.Node, scope: Mapping[str, Any], depth: int) -> None:
        if depth >= _DEEPEST:
            self.add_fault(test, "a condition stands in a condition that stands in a condition")
        tested = test.node if isinstance(test, nodes.Not) else test
        if isinstance(tested, nodes.Test) and tested.name == "none":
            tested = tested.node
        if isinstance(tested, nodes.Compare):
            (operand, *others) = tested.ops
            is_constant = isinstance(operand.expr, nodes.Const) and isinstance(
                operand.expr.value, str
            )
            if others or operand.op not in ("eq", "ne") or not is_constant:
                self.add_fault(test, "a condition compares a field with a constant text alone")
            self._check_literal(tested.expr, operand.expr, scope, depth)
            tested = tested.expr
        if not isinstance(tested, (nodes.Name, nodes.Getattr)):
            self.add_fault(test, "a condition tests one field or named property")
            return
        self._type_of(tested, scope, depth)

    def _check_literal(
        self, field: nodes.Node, constant: nodes.Node, scope: Mapping[str, Any], depth: int
    ) -> None:
        """Report a text that a field of a Literal type never has."""
        kind = _without_none(self._type_of(field, scope, depth))
        is_literal = typing.get_origin(kind) is typing.Literal
        if not is_literal or not isinstance(constant, nodes.Const):
            return
        if constant.value not in typing.get_args(kind):
            self.add_fault(constant, f"no value {constant.value!r} of {typing.get_args(kind)}")

    def _type_of(self, node: nodes.Node | None, scope: Mapping[str, Any], depth: int) -> Any:
        """Return the type of an expression, and report what is wrong in it."""
        match node:
            case nodes.Name():
                if node.name not in scope:
                    self.add_fault(node, f"no field {node.name!r}{did_you_mean(node.name, scope)}")
                    return Any
                return scope[node.name]
            case nodes.Getattr():
                return self._attribute(node, self._type_of(node.node, scope, depth))
            case nodes.Filter():
                if node.name not in FILTERS:
                    self.add_fault(
                        node, f"no filter {node.name!r}{did_you_mean(node.name, FILTERS)}"
                    )
                self._type_of(node.node, scope, depth)
                self._arguments(node.args, scope, depth)
                self._arguments([keyword.value for keyword in node.kwargs], scope, depth)
                return str
            case nodes.Call():
                if isinstance(node.node, nodes.Name) and node.node.name in _MACROS:
                    self._check_arguments(node, node.node.name)
                else:
                    self.add_fault(node, f"a template calls {', '.join(_MACROS)} alone")
                self._arguments(node.args, scope, depth)
                self._arguments([keyword.value for keyword in node.kwargs], scope, depth)
                return str
            case nodes.CondExpr():
                self._check_condition(node.test, scope, depth)
                self._type_of(node.expr1, scope, depth + 1)
                self._type_of(node.expr2, scope, depth + 1)
                return str
            case nodes.Const() | nodes.TemplateData():
                return str
            case None:
                return Any
        self.add_fault(node, f"{type(node).__name__} has no place in a template: name a property")
        return Any

    def _check_arguments(self, node: nodes.Call, macro: str) -> None:
        """Report arguments that a macro does not take, or that it lacks."""
        keywords = [keyword.key for keyword in node.kwargs]
        try:
            signature_of(macro).bind(*node.args, **dict.fromkeys(keywords))
        except TypeError as error:
            self.add_fault(node, f"{macro}: {error}")

    def _arguments(
        self, arguments: Sequence[nodes.Node], scope: Mapping[str, Any], depth: int
    ) -> None:
        for argument in arguments:
            self._type_of(argument, scope, depth)

    def _attribute(self, node: nodes.Getattr, owner: Any) -> Any:
        owner = _without_none(owner)
        if owner is Any:
            return Any
        found: list[Any] = []
        for kind in _alternatives(owner):
            plain = typing.get_origin(kind) or kind
            members = members_of(plain) if isinstance(plain, type) else {}
            if node.attr not in members:
                name = getattr(plain, "__name__", plain)
                hint = did_you_mean(node.attr, members)
                self.add_fault(node, f"{name} has no field {node.attr!r}{hint}")
                return Any
            found.append(members[node.attr])
        return found[0]

    def add_fault(self, node: nodes.Node, text: str) -> None:
        """Add a fault, at the line of a node."""
        self.faults.append(TemplateFault(self.template, node.lineno, text))


def _alternatives(kind: Any) -> Iterator[Any]:
    """Yield the members of a union, or the type itself."""
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        yield from (part for part in typing.get_args(kind) if part is not type(None))
    else:
        yield kind


def _without_none(kind: Any) -> Any:
    parts = list(_alternatives(kind))
    return parts[0] if len(parts) == 1 else kind


def _element_of(kind: Any) -> Any:
    """Return the type of what a loop over a value takes."""
    arguments = typing.get_args(_without_none(kind))
    return arguments[0] if arguments else Any


def _parts_of(kind: Any, number: int) -> Sequence[Any]:
    """Return the types of the parts of a tuple of some length."""
    arguments = typing.get_args(kind)
    if typing.get_origin(kind) is tuple and len(arguments) == number:
        return arguments
    return [Any] * number

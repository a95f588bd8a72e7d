"""The right's file, written anew so that it becomes like the left.

Attributes of elements are changed in the text of the file. What was written is compiled and
compared with the left again: a change after which the compiled model still differs is taken back,
and told with its reason.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ...atomic_files import beside, check_place
from ...engines import raw_engine_of
from ...engines.description.file_changes import AttributeChange, UnwrittenChange
from ...engines.description.file_form import FileForm, NotWrittenError
from ...engines.description.xml_source import AttributeText, XmlSource
from ...engines.records import ModelDifference
from ...errors import BadInputError, EngineWarning, StateMachineError, one_line
from ...installed import DEFAULT
from ...interface import Model
from ..compare.matching import Matched, match_models
from .causes import Cause, causes, differences_of, reason_of_option

_ROUNDS = 3  # what follows from a change is looked at again once it is compiled
_SUFFIXES = (".xml", ".mjcf", ".urdf")
_EXTRA = "one side has the element and the other does not: only attributes are changed"
_ONLY_LEFT = "only the left could be brought to the right"
_STILL_DIFFERS = "the model that is compiled of the file still differs in it"
_NEW = "it differs once the rest is written"


@dataclass(frozen=True, eq=False)
class RewriteRequest:
    """Question what the right's file becomes where it is brought to the left.

    Attributes:
        left: The left side.
        right: The right side; its file is read, and not changed.
        target: The file that is written.
        load: Loads a file as the right is loaded.
        names: Joints, bodies, sites and actuators of the left that go by other names on the right.
        options: Options of the right side, as they are typed, by the titles of the differences that
            they make; its file cannot undo those.
    """

    left: Model
    right: Model
    target: Path
    load: Callable[[Path], Model]
    names: Mapping[str, str]
    options: Mapping[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True)
class RewrittenFile:
    """The right's file, written anew.

    Attributes:
        file: The file that was written; that was to be, where `written` is empty.
        of: Name of the right's file.
        written: Each attribute that was changed.
        not_written: Each difference that stays, and why.
        gap: How far the sides are apart now, by the quantity that was explained, in `unit`; None
            where nothing was run, or a run did not reach its end.
        before: How far they were apart.
        quantity: What the gap is measured in; "" where nothing was run.
        unit: Of the quantity.
    """

    file: str
    of: str
    written: tuple[AttributeChange, ...]
    not_written: tuple[UnwrittenChange, ...]
    gap: float | None = None
    before: float | None = None
    quantity: str = ""
    unit: str = ""


def check_target(target: Path, left: Path, right: Path, inputs: Collection[Path] = ()) -> None:
    """Refuse a file that cannot be written, before anything is run.

    Args:
        target: The file.
        left: The left's file.
        right: The right's.
        inputs: Other files that are read.

    Raises:
        BadInputError: It is there already, ends otherwise than the right's file, its folder is not
            there, or the files that the right's names would not be found from it.
        ModelError: The right's file is no XML.
    """
    suffix = right.suffix.lower()
    if suffix not in _SUFFIXES:
        raise BadInputError(
            f"--write changes the text of an MJCF or a URDF; {right.name} is none of them"
        )
    check_place(target, (suffix,), what="what --write writes")
    source = XmlSource(right)
    for path in (left, right, *source.files, *inputs):
        if target.exists() and path.exists() and target.samefile(path):
            raise BadInputError(
                f"--write {target} would overwrite a file that is read; name another one"
            )
    if target.exists() or target.is_symlink():
        raise BadInputError(
            f"--write replaces no file, and {target} is there already: name another one, or delete "
            "that one first"
        )
    if not _is_same_folder(target, right):
        source.check_can_move()


def _is_same_folder(target: Path, right: Path) -> bool:
    return target.parent.resolve() == right.parent.resolve()


def text_at(source: XmlSource, target: Path) -> bytes:
    """Return the text of a file with its changes, as it stands at another place."""
    if _is_same_folder(target, source.path):
        return source.changed_text()
    return source.moved_text(target.parent)


def rewrite(request: RewriteRequest) -> tuple[RewrittenFile, Model]:
    """Write the right's file so that it becomes like the left, and load it.

    Where nothing can be changed no file is written.

    Returns:
        What was written, and the model that was compiled of it; the right itself where nothing was.

    Raises:
        StateMachineError: The right's file cannot be read.
    """
    if request.left.compiled is None or request.right.compiled is None:
        raise BadInputError("--write needs two sides that have a compiled model")
    return _Rewriter(request).run()


class _NothingChangedError(Exception):
    """No attribute of a file is changed, so that the file is not written."""


@dataclass
class _Accepted:
    """A difference that is written.

    Attributes:
        titles: Of the differences that it undoes.
        texts: The attributes that do.
    """

    titles: frozenset[str]
    texts: list[AttributeText]


class _Rewriter:
    """Writes a file, compiles it, and looks at what still differs.

    Args:
        request: What is written.
    """

    def __init__(self, request: RewriteRequest) -> None:
        self._request = request
        self._source = XmlSource(request.right.path)
        self._accepted: dict[str, _Accepted] = {}
        self._reasons: dict[str, str] = {}

    def run(self) -> tuple[RewrittenFile, Model]:
        """Write the file."""
        try:
            with beside(self._request.target) as (part,):
                model = self._written_in_rounds(Path(part))
                if not changes_of(self._texts()):
                    raise _NothingChangedError
        except _NothingChangedError:
            model = self._request.right
        return self._result(), model

    def _written_in_rounds(self, part: Path) -> Model:
        """Write what can be written, round by round; return the model of the file."""
        model = self._request.right
        rows = self._differences(model)
        first = {row.title for row in rows}
        for _ in range(_ROUNDS):
            before = changes_of(self._texts())
            self._plan(model, rows)
            if changes_of(self._texts()) == before:
                break
            model = self._compiled(part)
            rows = self._differences(model)
        if self._take_back(rows, first) or model is self._request.right:
            model = self._compiled(part)
        return model

    def _differences(self, model: Model) -> Sequence[ModelDifference]:
        """Return all that the left and a model of the right's file differ in."""
        request = self._request
        matched = match_models(request.left, model, request.names)
        return differences_of(request.left, model, matched)

    def _plan(self, model: Model, rows: Sequence[ModelDifference]) -> None:
        """Enter the attributes of each difference, or why none undoes it."""
        request = self._request
        matched = match_models(request.left, model, request.names)
        form = form_of_right(request.left, model, matched, self._source)
        for cause in causes(rows):
            reason = reason_of_option(cause, request.options) or reason_not_written(cause)
            if reason:
                self._reasons[cause.name] = reason
                continue
            try:
                texts = form.texts(cause.edits(1), cause.spec_edits(1))
            except NotWrittenError as error:
                self._reasons[cause.name] = str(error)
                continue
            self._accepted.pop(cause.name, None)  # what is written last counts
            titles = frozenset(row.title for row in cause.differences)
            self._accepted[cause.name] = _Accepted(titles, texts)
            self._reasons.pop(cause.name, None)

    def _texts(self) -> list[AttributeText]:
        """Return all attributes that are written."""
        texts: list[AttributeText] = []
        for accepted in self._accepted.values():
            texts += accepted.texts
        return texts

    def _compiled(self, part: Path) -> Model:
        """Write the file, and load it; what cannot be loaded is taken back.

        Raises:
            StateMachineError: The file cannot even be loaded without a change.
        """
        try:
            return self._loaded(part, self._texts())
        except StateMachineError:
            pass
        accepted_texts: list[AttributeText] = []
        for name, accepted in [*self._accepted.items()]:
            try:
                self._loaded(part, [*accepted_texts, *accepted.texts])
            except StateMachineError as error:
                self._reasons[name] = one_line(error).replace(
                    os.fspath(part), self._request.target.name
                )
                del self._accepted[name]
            else:
                accepted_texts += accepted.texts
        return self._loaded(part, accepted_texts)

    def _loaded(self, part: Path, texts: Sequence[AttributeText]) -> Model:
        """Write the file with some attributes, and load it."""
        self._source.forget()
        for text in texts:
            self._source.set(text)
        request = self._request
        part.write_bytes(text_at(self._source, request.target))
        with warnings.catch_warnings():  # of the right they were given when it was loaded
            warnings.simplefilter("ignore", EngineWarning)
            return request.load(part)

    def _take_back(self, rows: Sequence[ModelDifference], first: Collection[str]) -> bool:
        """Take back what was written in vain; tell whether anything was.

        Args:
            rows: What still differs.
            first: Titles of what differed at first.
        """
        remaining = {row.title for row in rows}
        in_vain = [name for name, each in self._accepted.items() if each.titles & remaining]
        for name in in_vain:
            if self._accepted[name].texts:
                self._reasons.setdefault(name, _STILL_DIFFERS)
            del self._accepted[name]
        for cause in causes(rows):
            is_new = not any(row.title in first for row in cause.differences)
            self._reasons.setdefault(cause.name, _NEW if is_new else _STILL_DIFFERS)
        self._reasons = {
            name: reason for name, reason in self._reasons.items() if name not in self._accepted
        }
        return bool(in_vain)

    def _result(self) -> RewrittenFile:
        """Return what was written."""
        return RewrittenFile(
            file=os.fspath(self._request.target),
            of=self._request.right.path.name,
            written=changes_of(self._texts()),
            not_written=tuple(UnwrittenChange(*pair) for pair in self._reasons.items()),
        )


def reason_not_written(cause: Cause) -> str:
    """Return why a cause is nothing that attributes undo; "" where they may."""
    if cause.refused:
        return cause.refused
    if any(row.subject.startswith("extra ") for row in cause.differences):
        return _EXTRA
    if not all(row.edits or row.spec_edits for row in cause.differences):
        return _ONLY_LEFT
    return ""


def changes_of(texts: Sequence[AttributeText]) -> tuple[AttributeChange, ...]:
    """Return what attributes become, without those that are so already; what is last counts."""
    last: dict[Hashable, AttributeChange] = {}
    for text in texts:
        last[text.element, text.child, text.attribute] = text.change
    return tuple(change for change in last.values() if change.old != change.new)


def geoms_of_left(matched: Matched) -> dict[int, int]:
    """Return for each geom of the right its counterpart on the left."""
    left, right = matched.left.compiled, matched.right.compiled
    pairs = raw_engine_of(DEFAULT).shown_elements(left, right, matched)["geom"]
    return {right_geom: left_geom for left_geom, right_geom in pairs}


def form_of_right(left: Model, right: Model, matched: Matched, source: XmlSource) -> FileForm:
    """Return what writes differences as attributes of the right's file.

    Args:
        left: The left side.
        right: The right side.
        matched: What of one is what of the other.
        source: The right's file.

    Raises:
        ModelError: The left's file is no XML.
    """
    geoms = geoms_of_left(matched)
    return raw_engine_of(DEFAULT).file_form(source, right.compiled, left.path, left.compiled, geoms)

"""The verdict of a comparison in two sentences, from the fields of its `Finding`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import on_label, quantity
from ...show.blocks import Headline, Text
from ...show.markdown import plain_text
from ...show.templates import PageContent, render_blocks
from ..compare import Agreement, Comparison
from ..compare.instead import Instead
from ..compare.motion import MotionExtent
from ..compare.outcomes import FORWARD
from ..compare.series import SETTLED
from ..runs.floating import Bases
from .compared_names import name_of, noun_phrase, short_labels, shortened
from .finding import Divergence, EarlyEnd, Falls, Finding

_NAME = 30  # characters of a name within a sentence
_LABEL = 24  # of what a side is called within one
_REASON = 100  # of why a run ended


@dataclass(frozen=True)
class _Verdict:
    """What the sentences of each verdict may name.

    Attributes:
        finding: What the comparison comes to.
        comparison: The figures.
        left: What the left side is called in a sentence.
        right: What the right side is called.
    """

    finding: Finding
    comparison: Comparison
    left: str
    right: str

    @property
    def lead(self) -> Agreement:
        """Return the quantity that is farthest beyond its tolerance, or nearest to it."""
        return self.finding.lead

    @property
    def lead_name(self) -> str:
        """Return the name of that quantity, as a sentence has it."""
        return _noun_phrase(self.lead)

    @property
    def divergence(self) -> Divergence | None:
        """Return when the runs diverge; None where they do not."""
        return self.finding.divergence


@dataclass(frozen=True)
class DifferVerdict(_Verdict, PageContent):
    """The runs differ."""

    template = "compare_differ.md.j2"

    @property
    def window(self) -> float:
        """Return the time at the end over which the final figures are a mean [s]."""
        return SETTLED * self.comparison.until

    @property
    def bodies(self) -> str:
        """Return the two bodies of a first touch, where the lead is one."""
        return _short(self.lead.name.partition(", ")[0])

    @property
    def is_number(self) -> bool:
        """Tell whether the lead has a largest difference: it may be NaN at some moments."""
        return self.lead.max == self.lead.max

    @property
    def noticed_name(self) -> str | None:
        """Return the name of the quantity that one would see apart, as a sentence has it.

        None where that is the lead, or there is none.
        """
        noticed = self.finding.noticed
        return None if noticed is None else _noun_phrase(noticed)

    @property
    def event(self) -> tuple[str, str] | None:
        """Return the body that touches another when the runs diverge, and the other.

        None where nothing touches then.
        """
        at = self.finding.divergence
        if at is None or not at.body:
            return None
        return _short(at.body), _short(at.ground)

    @property
    def falls(self) -> Falls:
        """Return which sides fell; "none" of a policy, whose verdict begins with that."""
        return "none" if self.comparison.is_of_policy() else self.finding.falls


@dataclass(frozen=True)
class PolicyVerdict(_Verdict, PageContent):
    """What came of a policy on both sides, which is said before how far apart they are."""

    template = "compare_policy.md.j2"

    @property
    def on_left(self) -> str:
        """Return where the left is, as a sentence has it."""
        return on_label(self.left)

    @property
    def on_right(self) -> str:
        """Return where the right is, as a sentence has it."""
        return on_label(self.right)

    @property
    def left_speed(self) -> float | None:
        """Return the mean speed forward of the left [m/s]; None where the run is too short."""
        speed = self.comparison.outcome_named(FORWARD)
        return None if speed is None else speed.left

    @property
    def right_speed(self) -> float | None:
        """Return the mean speed forward of the right [m/s]; None where the run is too short."""
        speed = self.comparison.outcome_named(FORWARD)
        return None if speed is None else speed.right


@dataclass(frozen=True)
class BasesVerdict(_Verdict, PageContent):
    """The base of one side floats, that of the other is fixed."""

    template = "compare_bases.md.j2"

    @property
    def bases(self) -> Bases:
        """Return whether the base of each side floats."""
        return self.comparison.bases


@dataclass(frozen=True)
class AgreeVerdict(_Verdict, PageContent):
    """Every quantity stays within its tolerance."""

    template = "compare_agree.md.j2"

    @property
    def moved(self) -> bool:
        """Tell whether a coordinate moved, and not only a force or the energy."""
        return self.comparison.motion.moved

    @property
    def extents(self) -> list[str]:
        """Return the largest motion of both sides, a phrase for each unit."""
        return extents_of(self.comparison.motion)


@dataclass(frozen=True)
class EndedVerdict(_Verdict, PageContent):
    """A run ended before its time."""

    template = "compare_ended.md.j2"

    @property
    def ended(self) -> EarlyEnd:
        """Return the run that ended first."""
        return min(self.finding.ended, key=lambda early_end: early_end.time)

    @property
    def who(self) -> str:
        """Return the label of the side that ended first."""
        return (self.left, self.right)[self.ended.side]

    @property
    def reason(self) -> str:
        """Return why it ended, without the end of the sentence."""
        return shortened([self.ended.reason.rstrip(".")], _REASON)[0]

    @property
    def other(self) -> str | None:
        """Return the label of the other side, where its run ended early, too; else None."""
        return (self.right, self.left)[self.ended.side] if len(self.finding.ended) > 1 else None

    @property
    def first(self) -> str | None:
        """Return the name of the quantity that leaves its tolerance first; None where none does."""
        return None if self.divergence is None else _short(name_of(self.divergence.quantity))


@dataclass(frozen=True)
class StillVerdict(_Verdict, PageContent):
    """Nothing moved, so that nothing was compared.

    Attributes:
        instead: What moves the model; None where that was not looked for.
    """

    template = "compare_still.md.j2"
    instead: Instead | None

    @property
    def motion(self) -> MotionExtent:
        """Return the largest motion of both sides."""
        return self.comparison.motion

    @property
    def extents(self) -> list[str]:
        """Return the largest motion of both sides, a phrase for each unit."""
        return extents_of(self.motion)


def headline_of(
    finding: Finding, comparison: Comparison, instead: Instead | None, causes: Sequence[str] = ()
) -> Headline:
    """Return the verdict of a comparison.

    Args:
        finding: What it comes to.
        comparison: The figures.
        instead: What to run where nothing moved; None where that was not looked for.
        causes: What explains it, in sentences, where that was asked.
    """
    sides = sentence_labels(comparison)
    content: PageContent
    match finding.outcome:
        case "differs" if comparison.bases.differ:
            content = BasesVerdict(finding, comparison, *sides)
        case "differs":
            content = DifferVerdict(finding, comparison, *sides)
        case "agrees":
            content = AgreeVerdict(finding, comparison, *sides)
        case "ended":
            content = EndedVerdict(finding, comparison, *sides)
        case "nothing moved":
            content = StillVerdict(finding, comparison, *sides, instead)
    blocks = render_blocks(content)
    if comparison.is_of_policy():
        blocks = [*render_blocks(PolicyVerdict(finding, comparison, *sides)), *blocks]
    texts = [plain_text(block.text) for block in blocks if isinstance(block, Text)]
    lead, *rest = texts
    return Headline(lead.removesuffix("."), tuple(causes), " ".join(rest), finding.holds)


def sentence_labels(comparison: Comparison) -> tuple[str, str]:
    """Return what the sides are called in a sentence: "the left" where their names are long."""
    left, right = short_labels(comparison)
    if max(len(left), len(right)) > _LABEL:
        return "the left", "the right"
    return left, right


def extents_of(motion: MotionExtent) -> list[str]:
    """Return how far both sides move at most: an angle, a length, or both."""
    extents: list[str] = []
    if motion.angle is not None:
        extents.append(quantity(motion.angle, "rad"))
    if motion.length is not None:
        extents.append(quantity(motion.length, "m"))
    return extents


def _noun_phrase(agreement: Agreement) -> str:
    return noun_phrase(agreement, _NAME)


def _short(name: str) -> str:
    return shortened([name], _NAME)[0]

"""What stands under the first screen of an identification: everything that is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import degrees, fixed
from ...show.blocks import Table
from ...show.templates import PageContent
from .considered import UNCERTAIN_PLACE, UNCERTAIN_RATE
from .hypotheses import EVIDENCE
from .parameter_table import determined_table, share_table, undetermined_table
from .parameter_texts import name_of_parameter, size_text
from .recording_page import gap_table
from .results import IdentificationResult, StartOutcome
from .unknown import TellingMotion, motions_of, undeterminable


@dataclass(frozen=True)
class IdentificationDetails(PageContent):
    """What stands under the first screen of an identification.

    Attributes:
        result: What was computed.
    """

    template = "identification_details.md.j2"
    result: IdentificationResult

    @property
    def shares(self) -> Table:
        """Return a table of the causes."""
        return share_table(self.result)

    @property
    def determined(self) -> Table:
        """Return a table of what the recording determines."""
        return determined_table(self.result.parameters)

    @property
    def undetermined(self) -> Table:
        """Return a table of what the recording cannot tell, and what each lacks."""
        return undetermined_table(self.result.parameters)

    @property
    def has_undetermined(self) -> bool:
        """Tell whether there is something that the recording cannot tell."""
        return bool(self.undetermined.rows)

    @property
    def motions(self) -> Sequence[TellingMotion]:
        """Return the motions that would tell what this recording cannot."""
        return motions_of(self.result.parameters)

    @property
    def undeterminable(self) -> list[str]:
        """Return what no motion would tell."""
        return undeterminable(self.result.parameters)

    @property
    def joints(self) -> Table:
        """Return how far each joint is from the arm on what was not fitted."""
        return gap_table(self.result.gap)

    @property
    def hypotheses(self) -> Table:
        """Return a table of the other readings that were tried."""
        headers = ("reading", "size", "RMS", "evidence", "verdict")
        rows: list[tuple[str, ...]] = []
        for each in self.result.hypotheses:
            residual, evidence = degrees(each.residual, 3), fixed(each.evidence, 1)
            rows.append((each.name, size_text(each), residual, evidence, each.verdict))
        return Table(headers, rows, words=frozenset({0, 4}))

    @property
    def decisive(self) -> float:
        """Return the evidence above which a reading fits better."""
        return EVIDENCE

    @property
    def uncertain_rate(self) -> float:
        """Return how uncertain the rate of frames is taken to be, as a part of it."""
        return UNCERTAIN_RATE

    @property
    def uncertain_place(self) -> float:
        """Return how uncertain the place of a payload is taken to be [m]."""
        return UNCERTAIN_PLACE

    @property
    def has_hypotheses(self) -> bool:
        """Tell whether other readings were tried."""
        return bool(self.result.hypotheses)

    @property
    def has_sizes(self) -> bool:
        """Tell whether something was tried that has a size: play of joints, a tilted base."""
        return any(each.size is not None for each in self.result.hypotheses)

    @property
    def starts(self) -> Sequence[StartOutcome]:
        """Return where each start of the fit ended."""
        return self.result.starts

    @property
    def as_good(self) -> int:
        """Return how many starts fit as well as the best."""
        return sum(start.as_good for start in self.starts)

    @property
    def disagreeing(self) -> list[str]:
        """Return the parameters on which starts disagree that fit as well."""
        parameters = self.result.parameters
        return [name_of_parameter(p) for p in parameters if "starts disagree" in p.reasons]

    @property
    def starts_agree(self) -> bool:
        """Tell whether the starts that fit as well agree on every parameter."""
        return not self.disagreeing

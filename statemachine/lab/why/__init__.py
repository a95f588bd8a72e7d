"""Why two sides differ: one explanation for files, engines and settings.

- `request`, `explanation`: the question and the answer, as records; `explain` goes from one to the
  other
- `causes`: what differs; `run_differences`: in the start, the commands, the order of elements;
  `option_differences`: by what `Model.replace` takes; `written`: the line of the file that says it;
  `right_options`: the option of a side that does
- `settings`: what an engine as it comes sets, and what can be left out
- `setup`: how each side is run with some causes equalized; `order`: as a function of the user's
  sees it; `trials`: the runs, each made once
- `gap`: what runs are measured by, and what touches first; `explained_gap`: the one to divide
- `search`: the stages, in the order in which a reader wants their results, until a `deadline`;
  `assembly`: the answer from what is known so far
- `game`: the gap with each set of causes equalized; `shapley`: shares of a gap among causes, by the
  arithmetic in `shares`; `locate`: where the rest comes from
- `split`: the gap divided into import, joint dynamics and contact; `imported`: what the import of a
  file made, as the installed MuJoCo runs it
- `verdict`: what is answered, and whether that answers the question
"""

from __future__ import annotations

from .explain import explain
from .explanation import Effect, Explanation, FailedSet, InterruptedExplanation, Share
from .request import WhyRequest
from .shares import ADDS_UP
from .verdict import UNEXPLAINED, GapVerdict

__all__ = [
    "ADDS_UP",
    "UNEXPLAINED",
    "Effect",
    "Explanation",
    "FailedSet",
    "GapVerdict",
    "InterruptedExplanation",
    "Share",
    "WhyRequest",
    "explain",
]

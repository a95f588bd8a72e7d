"""`statemachine compare`: where two engines part, by how much, and why."""

from __future__ import annotations

import argparse
import shlex
from typing import Any

from ..errors import BadInputError, EndedEarlyError
from ..installed import PAIR
from . import _compare_files as files
from . import _compare_questions as questions
from ._common import (
    EXCLUDES,
    NEEDS,
    PARTS,
    PROGRAM,
    REPEATED,
    SECONDS,
    SIDES,
    Row,
    Rule,
    add_rules,
    add_table,
    backend_of,
    chosen_backends,
    complain,
    json_of,
    menagerie,
    pairs_of,
    refuse,
    refuse_given,
    seed_of,
    shorten_help,
    show,
)


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = (
        "Run something on two sides, or open recorded traces, and compare: each quantity\n"
        "with its tolerance and a verdict. An experiment alone, or with one FILE, runs on\n"
        "both engines; the ctrl of one trace is played on the other engine.\n\n"
        "A side is FILE, FILE@ENGINE or FILE@ENGINE:engine (as the engine's own users\n"
        "meet it), and options behind it, such as timestep=0.002 contacts=off:\n"
        f"  {PROGRAM} compare hold A.xml\n"
        f"  {PROGRAM} compare hold A.xml@mujoco B.urdf@pybullet\n"
        f"  {PROGRAM} compare hold so101 timestep=0.002 so101 timestep=0.001\n"
        f"  {PROGRAM} compare walk.py:policy A.xml B.xml --every 5 --keyframe home\n"
        f"  {PROGRAM} compare run.npz A.xml B.xml"
    )
    parser.epilog = (
        f"experiments:\n{experiments()}\n\n"
        "Exit code 1: something differs, or a run ends before its time; with --why, but\n"
        "without --html: something stays unexplained, or is only a weak hint."
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    add_table(
        parser,
        (
            "what",
            "WHAT",
            "what is run: an experiment, FILE.py:FUNCTION or a recorded TRACE; then nothing, a "
            "model for both engines, two sides, or a second trace",
            {"nargs": "*"},
        ),
        backend_of(
            "the left's engine, and once more the right's: mujoco, pybullet, pybullet:engine (as "
            "its own users meet it) or a release, mujoco==3.3.7 (default mujoco and pybullet)"
        ),
        *run_options(),
        (
            "--tolerance",
            "KIND=VALUE",
            "another tolerance, such as joint=0.5deg, tip=2mm, energy=0.1J",
            REPEATED,
        ),
        (
            "--uncertainty",
            "SIZE",
            "how uncertain the start of your robot is, such as 0.1mm or 0.1deg",
            REPEATED,
        ),
        ("--no-chaos", "", "do not look for the chaos floor: faster"),
        *files.OF_PAGE,
        json_of(),
        files.OF_TESTS,
    )
    add_table(
        parser.add_argument_group("two sides"),
        (
            "--map",
            "LEFT=RIGHT",
            "a joint, body, site or actuator of the left and its name on the right; of --models, "
            "too",
            REPEATED,
        ),
        (
            "--actuators",
            "SIDE",
            "both sides have those of the left, or of the right",
            {"choices": SIDES},
        ),
        ("--floor", "SIDE", "both have that of the left, or of the right", {"choices": SIDES}),
        ("--every", "N", "steps for which what FUNCTION(model, data) returned holds (1)"),
        ("--keyframe", "NAME", "where it starts, on both sides"),
    )
    for title, rows in (
        ("why", questions.OF_WHY),
        ("is it a difference, and of what?", questions.OF_STEPS),
        ("pictures", files.OF_PICTURES),
        ("comparing descriptions of a robot", questions.OF_MODELS),
    ):
        add_table(parser.add_argument_group(title), *rows)
    add_rules(parser, *RULES)
    shorten_help(
        parser,
        *(
            "what",
            "backend",
            "why",
            "html",
            "converge",
            "seconds",
            "tolerance",
            "one_step",
            "versions",
        ),
        *("models", "json"),
    )


_OF_RUN = (
    "why quantity html plot film seconds timestep tolerance uncertainty every keyframe "
    "actuators floor"
)
NEXT = (
    "Next: --why --quantity {name} tells which difference causes this gap, --one-step where in a "
    "step it begins, --converge whether it vanishes with the timestep."
)
RULES: tuple[Rule, ...] = (
    ("measure finer budget jobs", NEEDS, "why"),
    ("quantity", NEEDS, "why html"),
    ("no_why", NEEDS, "html"),
    ("frame all", NEEDS, "models"),
    ("uncertainty", EXCLUDES, "no_chaos"),
    ("one_step converge", EXCLUDES, "why html plot film models uncertainty tolerance"),
    ("versions", EXCLUDES, "why html film models uncertainty backend"),
    ("one_step", EXCLUDES, "converge"),
    ("junit", EXCLUDES, "why one_step converge models"),
    ("bisect", NEEDS, "versions"),
    ("versions", EXCLUDES, "one_step converge"),
    (_OF_RUN, EXCLUDES, "models", "{flag} is of a run, and --models runs nothing"),
)

# As `scenarios.SCENARIOS`, which needs NumPy; a test compares them.
EXPERIMENTS = {
    "hold": "the servos go to one pose and hold it",
    "gravity": "actuators off: what can move falls",
    "droop": "nobody writes ctrl: the servos keep their first targets",
    "fall": "actuators off, and nothing can touch",
    "box": "the SO-101 swings with a box in its jaws",
    "waves": "every actuator follows waves that a seed draws",
}


def experiments() -> str:
    """A line for each experiment."""
    return "\n".join(f"  {name:<9} {says}" for name, says in EXPERIMENTS.items())


def run_options() -> tuple[Row, ...]:
    """Options that change what is run."""
    return (
        *menagerie(),
        SECONDS,
        ("--timestep", "S", "length of a step [s]"),
        seed_of("what is drawn"),
    )


def request_of(options: argparse.Namespace) -> Any:
    """What was asked for, as a Request."""
    from ..compare import Request, split_words

    what, sides = split_words(options.what, options.menagerie)
    given = {} if options.timestep is None else {"timestep": options.timestep}
    model = None
    if len(sides) == 1:  # of both engines
        model, given, sides = sides[0].file, given | {**sides[0].options}, ()
    _check_sides(options, what, sides)
    names = pairs_of(options.map, "--map")
    if sides:
        back = {there: here for here, there in names.items()}
        taken = [[part for part in PARTS if getattr(options, part) == side] for side in SIDES]
        left, right = sides
        sides = left.taking(taken[1], right, back), right.taking(taken[0], left, names)
    return Request(
        what=what,
        backends=_backends(options, what),
        model=model,
        menagerie=options.menagerie,
        seconds=options.seconds,
        seed=options.seed,
        options=given,
        sides=sides,
        names=names,
        every=1 if options.every is None else options.every,
        keyframe=options.keyframe,
    )


def _backends(options: argparse.Namespace, what: tuple[str, ...]) -> tuple[str, str]:
    """Return the two backends; one that is named is where a trace is played.

    Raises:
        BadInputError: There are not two.
        UnknownNameError: There is no such backend.
    """
    from ..compare.sides import is_trace

    if not options.backend:
        return PAIR
    chosen = [str(backend) for backend in chosen_backends(options.backend)]
    if len(chosen) == 1 and len(what) == 1 and is_trace(what[0]):
        return chosen[0], chosen[0]
    if len(chosen) != 2:
        raise BadInputError(
            "compare takes two engines, as in --backend mujoco --backend pybullet:engine; "
            f"got {' and '.join(chosen)}"
        )
    return chosen[0], chosen[1]


def _check_sides(options: argparse.Namespace, what: tuple[str, ...], sides: Any) -> None:
    """Refuse an option that has no meaning for what was asked."""
    from ..runs.controllers import is_function

    if sides:
        refuse_given(
            options,
            ["backend"],
            "{} goes without sides: each side names its engine: FILE@ENGINE",
        )
    else:
        example = f"{PROGRAM} compare hold LEFT RIGHT"
        refuse_given(options, ("map", *PARTS), f"{{}} is of two sides: {example}")
    if not (len(what) == 1 and is_function(what[0])):
        refuse_given(options, ["every"], "{} goes with FILE.py:FUNCTION")
    refuse(
        (
            options.every is not None and options.every < 1,
            f"--every wants a number of steps, at least 1; got {options.every}",
        )
    )


def run(options: argparse.Namespace) -> int:
    """Compare, and show."""
    from ..compare.perturbed import parse_uncertainty

    uncertain, why = parse_uncertainty(options.uncertainty), options.why and not options.html
    refuse(
        (
            options.budget is not None and options.budget < 1,
            f"--budget wants a number of runs, at least 1; got {options.budget}",
        )
    )
    if options.models is not None:
        return questions.run_models(options)
    refuse(
        (
            not options.what,
            f"compare what? An experiment ({', '.join(EXPERIMENTS)}), FILE.py:FUNCTION or traces: "
            f"{PROGRAM} compare hold",
        ),
        (
            why and options.tolerance,
            "--why takes no --tolerance: it explains the gap, whatever its size",
        ),
        (
            why and (options.plot or options.film),
            "--why runs many times: --plot and --film go without it",
        ),
    )
    request, renderer = request_of(options), files.checked(options)
    if options.one_step or options.converge or options.versions is not None:
        return questions.run_steps(options, request)
    why_not = ""
    if why:
        try:
            return questions.run_why(options, request)
        except EndedEarlyError as error:  # what there is until then, and no cause
            why_not = f"No cause is named: {error}."
    return _run_compare(options, request, renderer, uncertain, why_not)


def _run_compare(
    options: argparse.Namespace, request: Any, renderer: Any, uncertain: Any, why_not: str
) -> int:
    from ..compare import compare, run_sides, witness
    from ..measures import QUANTITIES, parse_tolerances
    from ..report import compare as report
    from ..report.finding import leading, name_of
    from ..report.terminal import progress
    from ..runs.controllers import is_function

    tolerances = parse_tolerances(options.tolerance)
    if request.is_traces and len(request.what) == 2:
        refuse_given(options, ["backend"], "{} is of a run, and two traces are runs that were made")
    with progress("compare") as bar:
        run = run_sides(request, bar)
    comparison = compare(*run.traces, tolerances=tolerances)
    with_sides = request.sides or is_function(request.what[0])
    played = (
        compare(run.left, run.played, tolerances=tolerances)
        if run.played is not run.right
        else None
    )
    parts = {
        "witness": witness(*run.traces, run.file),
        "floor": _floor(options, comparison, run.reruns, uncertain),
    }
    if all(a.verdict == "agrees" for a in comparison.agreements if QUANTITIES[a.kind].moves):
        why_not = "Next: another experiment, such as gravity or waves, may move what this does not."
    lead = leading(comparison, parts["floor"])
    why_not = why_not or NEXT.format(name=shlex.quote(name_of(lead.name)))
    more = report.PageParts()
    if not comparison.ended and not comparison.agrees:  # else the page says it
        more = report.PageParts(why_not=why_not)
    if options.html:
        more = report.PageParts(
            **questions.for_page(options, request, run.traces, comparison.ended)
        )
    page = report.page(
        comparison,
        said=run.said,
        run=run if with_sides else None,
        played=played,
        **parts,
        parts=more,
    )
    if options.html:
        files.write_page(options, request, run.traces, page)
    files.write_tests(options, [comparison])
    result = {"comparison": comparison, "touches": comparison.touches, **parts}
    if with_sides:
        result |= {
            "sides": request.both_sides(""),
            "commands": run.commands,
            "open_loop": comparison if played is None else played,
            "unmatched": run.unmatched,
            "only": run.matched.only if run.matched else ({}, {}),
        }
    if options.json:
        for line in (*run.unmatched, *run.said):
            complain(line, 0)
    code = show(page, result, options.json)
    files.write_pictures(renderer, options, run.traces, request, comparison, parts["floor"])
    return code


def _floor(options: argparse.Namespace, comparison: Any, reruns: Any, uncertain: Any) -> Any:
    """Compute the chaos floor of a comparison; None where neither side was run here.

    Raises:
        BadInputError: An uncertainty was given, and neither side was run here.
    """
    if options.no_chaos:
        return None
    if reruns == (None, None):
        refuse(
            (
                options.uncertainty,
                "--uncertainty runs both sides again, and both are recorded runs",
            )
        )
        return None
    from ..compare import chaos_floor
    from ..report.terminal import progress

    with progress("chaos floor") as bar:
        return chaos_floor(comparison, reruns, seed=options.seed, uncertain=uncertain, progress=bar)

"""The comparison of two files, or of what two engines make of them, before anything moves."""

from __future__ import annotations

import os
import platform
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ... import __version__
from ...backends import load
from ...engines import raw_engine_of
from ...engines.description.match import Matching, Pair, alike_names
from ...engines.description.reading import ModelReading
from ...engines.description.tree import GroupTree
from ...errors import EngineWarning, StateMachineError, check_name
from ...measures.text import command, few, rounded
from ...release_names import engine_of
from ...rotations import HERE
from ..compare.matching import Matched, MatchedTrees, match_models, match_trees
from .agreement import agreements, compare_poses
from .changes import difference_changes
from .compiled import CompiledDifferences
from .declared import enter_declared
from .effects import Effects
from .faults import faults_of, not_compared
from .listing import Listing
from .locating import Locator
from .only_read import enter_only_read
from .reading import FileAsked, read_both
from .records import DifferenceChange, FileSide, ModelsComparison
from .starts import enter_starts
from .supplied import with_supplied
from .visuals import enter_visuals


def compare(
    left: str | os.PathLike[str],
    right: str | os.PathLike[str],
    engines: tuple[str | None, str | None] = (None, None),
    frames: Mapping[str, str] | None = None,
    rename: Mapping[str, str] | None = None,
    digits: int = 6,
    seed: int = 0,
    menagerie: str | os.PathLike[str] | None = None,
) -> ModelsComparison:
    """Find every difference between two files.

    Args:
        left: A name or a file.
        right: The other.
        engines: For each the engine that it is asked of; None for the file itself. What a backend
            supplies in a run does not matter, but of "pybullet:engine".
        frames: Frames of `left` that go by other names in `right`.
        rename: Joints, links and frames of `left` that go by other names in `right`.
        digits: Numbers that agree to so many count as equal, 1 to 17.
        seed: Of the poses at which both are compared.
        menagerie: A folder to look names up in.

    Raises:
        UnknownNameError: No such model, engine, joint or frame.
        MissingEngineError, ModelError, ModelFileError, UnsupportedError: As `read`.
    """
    sides = (
        FileAsked.typed(left, engines[0], menagerie),
        FileAsked.typed(right, engines[1], menagerie),
    )
    frames_by_name = {} if frames is None else dict(frames)
    renamed = {} if rename is None else dict(rename)
    both_frames = (frames_by_name.keys() | renamed.keys(), {*frames_by_name.values()})
    readings = read_both(sides, both_frames)
    _check_frames(readings, frames_by_name)
    names = _names(readings, renamed | frames_by_name)
    models = readings[0].model, readings[1].model
    one_world = not any(_has_no_world(reading) for reading in readings)
    matched = match_models(*models, names, one_world=one_world)
    trees = match_trees(*models, names, one_world=one_world)
    partners = {models[0].joint_names[a]: models[1].joint_names[b] for a, b in matched.joints}
    effects = Effects(readings, trees, _links_as_run(readings, trees, names), names, partners)
    locator = Locator(readings, matched)
    listing = Listing(digits)
    skipped = CompiledDifferences(listing, readings, matched, effects, locator).enter()
    skipped += not_compared(readings)
    enter_starts(listing, readings, matched, locator, effects.reach)
    enter_declared(listing, readings, matched, locator)
    enter_only_read(listing, matched, locator)
    enter_visuals(listing, readings, trees, locator)
    listing.differences = with_supplied(listing.differences, sides, readings, names)
    differences, faults = listing.ordered(), tuple(faults_of(readings))
    declared = [reading.declared for reading in readings]
    agreeing = agreements(trees, declared, listing.tolerance)
    left_side = _side(readings[0], trees.left, sides[0])
    right_side = _side(readings[1], trees.right, sides[1])
    notes = tuple(dict.fromkeys(_notes(readings, matched, trees)))
    gap, versions = compare_poses(trees, seed), _versions(readings)
    has_actuators = models[0].nu > 0
    labels = sides[0].label, sides[1].label
    changes: tuple[DifferenceChange, ...] = ()
    if engines == (None, None):
        acting = {row.cause for row in differences if row.matters}
        changes = difference_changes(*models, matched, acting)
    return ModelsComparison(
        left=left_side,
        right=right_side,
        faults=faults,
        differences=differences,
        agreements=agreeing,
        posed=gap,
        notes=notes,
        digits=digits,
        has_actuators=has_actuators,
        versions=versions,
        skipped=tuple(skipped),
        labels=labels,
        renamed=matched.renamed,
        changes=changes,
    )


def _links_as_run(
    readings: Sequence[ModelReading], trees: MatchedTrees, names: Mapping[str, str]
) -> MatchedTrees:
    """Return the rigid parts with the masses and inertias that a run has, paired as those stated.

    Args:
        readings: Both sides.
        trees: The rigid parts with the masses and inertias that the files state.
        names: Which name on the left is which on the right.
    """
    if all(reading.mended is None for reading in readings):
        return trees
    run = match_trees(readings[0].run_model, readings[1].run_model, names)
    pairs: list[Pair] = []
    for pair in trees.matching.pairs:
        left, right = run.left.groups[pair.left.number], run.right.groups[pair.right.number]
        pairs.append(replace(pair, left=left, right=right))
    return replace(run, matching=replace(trees.matching, pairs=tuple(pairs)))


def _has_no_world(reading: ModelReading) -> bool:
    """Tell whether a side does not say where its base stands in the world."""
    return reading.format == "URDF" or reading.model.path.suffix.lower() == ".urdf"


def _check_frames(readings: Sequence[ModelReading], frames: Mapping[str, str]) -> None:
    """Refuse names of frames that are not there.

    Raises:
        UnknownNameError: A frame that was named is not there.
    """
    for pair in frames.items():
        for reading, name in zip(readings, pair, strict=True):
            check_name(f"frame in {_name(reading)}", name, _named_sites(reading))


def _named_sites(reading: ModelReading) -> list[str]:
    return [name for name in reading.model.site_names if name]


def _names(readings: Sequence[ModelReading], names: Mapping[str, str]) -> dict[str, str]:
    """Return which name on the left is which on the right: those told, and those of alike frames.

    Two MJCF have sites of their own, which are one by their names or their places alone.
    """
    if all(reading.declared is None for reading in readings):
        return dict(names)
    sites = [_named_sites(reading) for reading in readings]
    told = {a: b for a, b in names.items() if a in sites[0] and b in sites[1]}
    alike = alike_names(sites[0], sites[1], told)
    return {a: b for a, b in alike.items() if a != b} | dict(names)


def _name(reading: ModelReading) -> str:
    return "/".join(reading.model.path.parts[-2:])


def _side(reading: ModelReading, tree: GroupTree, asked: FileAsked) -> FileSide:
    """Return a side as it was read."""
    raw = reading.model.compiled
    engine, emulated = asked.engine, ""
    if engine is not None and raw_engine_of(engine_of(engine)).emulated:
        emulated = engine_of(engine)
    links, joints = int(raw.nbody) - 1, int(raw.njnt) - reading.floats
    shapes = sum(len(group.shapes) for group in tree.groups)
    visuals, mass = len(reading.visuals), float(raw.body_mass[1:].sum())
    name, unlike_its_users = _name(reading), _unlike_its_users(reading, engine)
    return FileSide(
        file=name,
        format=reading.format,
        reader=reading.reader,
        links=links,
        joints=joints,
        shapes=shapes,
        visuals=visuals,
        mass=mass,
        notes=reading.notes,
        emulated=emulated,
        is_mjcf=not asked.is_urdf,
        unlike_its_users=unlike_its_users,
    )


def _unlike_its_users(reading: ModelReading, engine: str | None) -> str:
    """Say what a run behind the contract has that its engine's users do not have, if anything."""
    if not engine or not raw_engine_of(engine_of(engine)).emulated:
        return ""
    try:
        with warnings.catch_warnings(action="ignore", category=EngineWarning):
            model = load(reading.model.path, backend=engine)
    except StateMachineError:  # it has no such run
        return ""
    return "; ".join(raw_engine_of(engine_of(engine)).unlike_its_users(model))


def _versions(readings: Sequence[ModelReading]) -> dict[str, str]:
    """Return the versions of what computed a comparison."""
    versions = {
        "statemachine": __version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
    for reading in readings:
        engine, _, version = reading.reader.partition(" ")
        versions[engine] = version
    return versions


def _notes(
    readings: Sequence[ModelReading], matched: Matched, trees: MatchedTrees
) -> Iterator[str]:
    """Yield what a reader should know, in sentences."""
    yield from matched.other_notes
    yield from _moved_frames(trees)
    yield from _suggestions(trees.matching)
    formats = [reading.format for reading in readings]
    if formats.count("URDF") == 1:
        yield (
            "a URDF says nothing of timestep, gravity and solver: the engine that loads it decides "
            "(--backend shows what it takes)"
        )
    if any(reading.floats for reading in readings):
        yield "a URDF does not say whether its base floats: here it does, so that its mass counts"
    for side, which in enumerate(("left", "right")):
        if any(reading.declared is not None for reading in readings):
            sites = matched.only[side].get("site", ())
            if sites:
                yield (
                    f"only the {which} has the frames {few(list(sites), 8)} "
                    "(--frame LEFT=RIGHT pairs two)"
                )


def _moved_frames(trees: MatchedTrees) -> Iterator[str]:
    """Yield that the frame of a link is put elsewhere on the same solid, or has another name."""
    pairs = [pair for pair in trees.matching.pairs if pair.by != "root"]
    for pair in pairs:
        if pair.align is not HERE:
            far, turn = pair.align.distance(HERE), pair.align.angle(HERE)
            yield (
                f"the frame of link {pair.left.name!r} is put elsewhere on the same solid, "
                f"{rounded(far, 'm')} and {rounded(turn, 'rad')} off: it moves alike, and its pose "
                "reads otherwise"
            )
    names: dict[str, None] = {}
    for pair in pairs:
        # A body with several joints is several groups, of which the last goes by its name.
        left, right = trees.left.of_body(pair.left)[-1], trees.right.of_body(pair.right)[-1]
        if left.name != right.name and pair.left.name != pair.right.name:
            names[f"{left.name} is {right.name}"] = None
    if names:
        yield f"links go by other names: {', '.join(names)}"


def _suggestions(matching: Matching) -> Iterator[str]:
    """Yield joints that may be one: of one kind, each the only one left on the same part."""
    for a in matching.only_left:
        above = matching.of(a.parent)
        ours = [group for group in matching.only_left if group.parent == a.parent]
        theirs = [
            group
            for group in matching.only_right
            if above is not None and group.parent == above.right.number
        ]
        if len(ours) != 1 or len(theirs) != 1:
            continue
        left, right = a.joint, theirs[0].joint
        if left is not None and right is not None and left.kind == right.kind:
            option = command(["--map", f"{left.name}={right.name}"])
            yield (
                f"joints {left.name!r} of the left and {right.name!r} of the right hang on the "
                f"same part, by other axes: {option} takes them for one"
            )

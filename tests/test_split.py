"""What of a gap is import, joint dynamics and contact: each where it is known to be all of it."""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.engines import raw_engine_of
from statemachine.errors import EngineWarning
from statemachine.installed import require
from statemachine.interface import Model
from statemachine.lab.compare import Request, Side
from statemachine.lab.compare.matching import match_alike, match_models
from statemachine.lab.compare.prepared_sides import on_left
from statemachine.lab.questions.requests.causes import ExplainRequest, answer
from statemachine.lab.recordings import Rerun, Trace
from statemachine.lab.runs.scenarios import scenario
from statemachine.lab.why import WhyRequest
from statemachine.lab.why.deadline import Deadline
from statemachine.lab.why.explained_gap import explained_gap
from statemachine.lab.why.page import page
from statemachine.lab.why.setup import NONE
from statemachine.lab.why.split import GapSplit, SplitPart, split_of
from statemachine.lab.why.split_page import SplitParagraphs, split_blocks
from statemachine.lab.why.trials import Trials
from statemachine.show.blocks import Page
from statemachine.show.templates import render_blocks

from .support.backends import RELEASES, registered
from .support.claims import assert_in
from .support.explained import ARM, explained
from .support.files import written
from .support.hidden_world import ExampleModel
from .support.hidden_world import load as load_hidden
from .support.pages import shown
from .support.processes import Cli
from .support.requirements import ROOT, need_engine
from .support.small_models import IMPLICIT, mjcf

OLD = RELEASES[0]
KP = 'kp="998.22" kv="2.731" '


def load_in_contact(path: Path, defaults: str = "model") -> ExampleModel:
    """Load a backend of another package that cannot leave contacts out."""
    model = load_hidden(path, defaults)
    options = tuple(name for name in model.capabilities.options if name != "contacts")
    vars(model)["capabilities"] = replace(model.capabilities, options=options)
    return model


def divided(left: Model, right: Model, what: str = "hold", **asked: Any) -> tuple[Any, float]:
    """Return the split of a gap, or None, and the gap: without looking for its causes."""
    request = WhyRequest(left, right, scenario(what), uncertain=None, jobs=1, **asked)
    if not request.recordings:
        request = replace(request, scenario=on_left(request.scenario, left, right))
    match = match_models if request.are_compiled else match_alike
    trials = Trials(request, match(left, right), Deadline(None))
    causes, first = trials.setup.causes(finer=False), trials.gaps(NONE)
    gap = explained_gap(trials, request, request.quantity, first)
    return split_of(trials, gap, causes), gap.size


def parts(split: GapSplit | None) -> dict[str, Any]:
    """Return the shares of a split by their names: numbers, or None."""
    assert split is not None
    return {part.name: part.share for part in split.parts}


@pytest.fixture(scope="module")
def arm() -> Model:
    """Return the arm above its floor, on MuJoCo."""
    return sm.load("so101/scene")


@pytest.fixture(scope="module")
def lost(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the arm's file whose servos lose their kp and kv on the way."""
    text = (ROOT / "models/so101/so101.xml").read_text("utf-8")
    assert text.count(KP) == 1
    text = text.replace(KP, "").replace('meshdir="look"', f'meshdir="{ROOT}/models/so101/look"')
    return written(tmp_path_factory.mktemp("lost") / "so101.xml", text)


# Where one of the three is known to be all of the gap.


def test_behind_the_contract_pybullet_differs_in_contact_alone(arm: Model) -> None:
    need_engine("pybullet")
    split, gap = divided(arm, sm.load("so101/scene", backend="pybullet"))
    assert math.degrees(gap) == pytest.approx(2.58, abs=0.01)
    assert parts(split) == pytest.approx({"import": 0, "joint dynamics": 0, "contact": 1}, abs=1e-6)
    assert split.reads_alike


def test_an_older_release_differs_in_joint_dynamics(arm: Model, old_releases: None) -> None:
    """MuJoCo 3.3.7 has kv of a clamped servo in its derivative: 6.20 degrees without contact."""
    split, gap = divided(arm, sm.load("so101/scene", backend=OLD))
    share = parts(split)
    assert math.degrees(gap) == pytest.approx(6.12, abs=0.01)
    assert math.degrees(gap * share["joint dynamics"]) == pytest.approx(6.20, abs=0.01)
    assert share["import"] == 0
    assert share["contact"] == 1 - share["joint dynamics"] < 0, "nothing is clipped"


def test_pybullet_as_it_comes_differs_in_joint_dynamics(arm: Model) -> None:
    need_engine("pybullet")
    split, gap = divided(arm, sm.load("so101/scene", backend="pybullet", defaults="engine"))
    assert math.degrees(gap) == pytest.approx(46.8, abs=0.1)
    assert parts(split) == pytest.approx({"import": 0, "joint dynamics": 1, "contact": 0}, abs=0.01)
    assert not split.reads_alike, "inertias of shapes"
    assert parts(split)["import"] > 0.003


@pytest.mark.parametrize("backend", ["mujoco", "pybullet", OLD])
def test_a_file_that_loses_kp_on_the_way_differs_in_its_import(
    backend: str, lost: Path, old_releases: None
) -> None:
    need_engine(backend.partition("=")[0])
    split, gap = divided(sm.load("so101"), sm.load(lost, backend=backend))
    assert math.degrees(gap) > 40
    assert parts(split) == pytest.approx({"import": 1, "joint dynamics": 0, "contact": 0}, abs=1e-5)


def test_what_one_of_two_releases_reads_is_import(tmp_path: Path, old_releases: None) -> None:
    """MuJoCo 3.3.7 leaves the <mimic> of a URDF out."""
    links = ['<robot name="grip"><link name="palm"/>']
    for name, place, mimic in (("a", 0.1, ""), ("b", -0.1, '<mimic joint="a_j" multiplier="-1"/>')):
        links.append(
            f'<link name="{name}"><inertial><origin xyz="0.1 0 0"/><mass value="{0.2 + place}"/>'
            '<inertia ixx="1e-4" iyy="2e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="{name}_j" type="continuous"><parent link="palm"/><child link="{name}"/>'
            f'<origin xyz="0 {place} 0"/><axis xyz="0 1 0"/>{mimic}</joint>'
        )
    file = written(tmp_path / "grip.urdf", "".join(links) + "</robot>")
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        split, _ = divided(sm.load(file), sm.load(file, backend=OLD), "fall")
    assert parts(split) == pytest.approx({"import": 1, "joint dynamics": 0, "contact": 0}, abs=1e-9)
    assert split.readers == (f"mujoco {sm.load(file).engine_version}", "mujoco 3.3.7")


# What counts as import.


def test_the_import_of_loadurdf_has_the_masses_of_the_loaded_engine(tmp_path: Path) -> None:
    """PyBullet gives a link without <inertial> 1 kg, and takes inertias from the shapes."""
    need_engine("pybullet")
    pb = require("pybullet")
    file = written(
        tmp_path / "two.urdf",
        '<robot name="two"><link name="base"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<link name="bob"><collision><origin xyz="0 0 -0.5"/><geometry><box size="0.2 0.2 0.2"/>'
        '</geometry></collision></link><joint name="swing" type="continuous">'
        '<parent link="base"/><child link="bob"/><axis xyz="0 1 0"/></joint></robot>',
    )
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        model = sm.load(file, backend="pybullet", defaults="engine")
    room = raw_engine_of("pybullet")
    figures, of_file = room.figures_as_read(model), sm.load(file).compiled
    client = pb.connect(pb.DIRECT)
    body = pb.loadURDF(str(file), useFixedBase=1, physicsClientId=client)
    mass, _, inertia = pb.getDynamicsInfo(body, 0, client)[:3]
    pb.disconnect(client)
    bob = model.body_id("bob")
    assert of_file.body_mass[bob] == pytest.approx(8)  # of the density of water
    assert figures.body_mass[bob] == mass == 1
    assert np.sort(figures.body_inertia[bob]) == pytest.approx(np.sort(inertia))
    assert room.reader(model) == f"pybullet {model.engine_version}"


def test_gravity_and_timestep_of_a_fresh_world_are_not_read_from_a_file(arm: Model) -> None:
    need_engine("pybullet")
    model = sm.load("so101/scene", backend="pybullet", defaults="engine")
    figures = raw_engine_of("pybullet").figures_as_read(model)
    assert (figures.opt.timestep, figures.opt.gravity[2]) == (arm.timestep, arm.gravity[2])
    assert model.timestep != arm.timestep
    assert model.compiled.opt.timestep == model.timestep, "the Model stays as it is"


def test_an_option_that_one_side_is_given_is_no_import(lost: Path, old_releases: None) -> None:
    arm, right = sm.load("so101"), sm.load(lost, backend=OLD)
    as_read, gap = divided(arm, right)
    with_option, other_gap = divided(arm, right.replace(gravity=[0, 0, -5]))
    imported = parts(as_read)["import"] * gap
    assert parts(with_option)["import"] * other_gap == pytest.approx(imported, rel=1e-9)
    assert abs(parts(with_option)["joint dynamics"]) > 1e-3


def test_one_engine_that_runs_one_file_leaves_nothing_to_divide(arm: Model) -> None:
    split, gap = divided(arm, arm.replace(damping=1.0))
    assert gap > 0
    assert split is None


def test_between_two_other_engines_the_figures_are_made_the_same(arm: Model) -> None:
    need_engine("pybullet")
    emulated = sm.load("so101/scene", backend="pybullet")
    as_it_comes = sm.load("so101/scene", backend="pybullet", defaults="engine")
    split, _ = divided(emulated, as_it_comes)
    assert parts(split) == pytest.approx({"import": 0, "joint dynamics": 1, "contact": 0}, abs=0.01)


def softer(lost: Path) -> Path:
    """Return the arm's file with softer servos, and dampers of their own."""
    text = lost.read_text("utf-8").replace("<position ", '<position kp="500" kv="2.731" ')
    return written(lost.parent / "softer.xml", text)


@pytest.mark.parametrize(
    ("located", "otherwise"), [(None, False), (-0.01, False), (0.05, False), (0.53, True)]
)
def test_another_part_of_contact_in_the_table_is_explained(
    located: float | None, otherwise: bool
) -> None:
    """As of MotrixSim beside MuJoCo 3.3.7 in `hold`."""
    shares = (
        SplitPart("import", 0.0),
        SplitPart("joint dynamics", 1.014),
        SplitPart("contact", -0.014),
    )
    split = GapSplit(("motrix 0.10.1", "mujoco 3.3.7"), True, shares)
    assert SplitParagraphs(split, "6.12°", "short", located).is_located_otherwise is otherwise


@pytest.mark.parametrize(
    ("left", "right", "figures_of"),
    [
        ("mujoco", OLD, "right"),
        (OLD, "mujoco", "left"),
        (OLD, "pybullet", "left"),
        ("mujoco", "mujoco", None),
    ],
)
def test_whose_figures_both_engines_have_is_told(
    left: str, right: str, figures_of: str | None, lost: Path, old_releases: None
) -> None:
    need_engine("pybullet")
    split, _ = divided(sm.load("so101", backend=left), sm.load(softer(lost), backend=right))
    assert split.figures_of == figures_of


def test_beside_the_installed_mujoco_the_order_of_sides_does_not_matter(
    lost: Path, old_releases: None
) -> None:
    one, other = sm.load("so101"), sm.load(softer(lost), backend=OLD)
    assert parts(divided(one, other)[0]) == pytest.approx(parts(divided(other, one)[0]), abs=1e-9)


def test_where_nothing_touches_no_part_is_called_contact(lost: Path, old_releases: None) -> None:
    """Import and joint dynamics make some of the gap together: the arm has no floor here."""
    split, _ = divided(sm.load("so101"), sm.load(softer(lost), backend=OLD))
    assert abs(parts(split)["contact"]) > 0.1
    assert not split.touches
    page = SplitParagraphs(split, "1°", "short")
    assert page.is_without_contact
    assert not replace(page, split=replace(split, touches=True)).is_without_contact


# What cannot be separated.


BAR = '<geom type="box" size=".15 .02 .02" pos=".15 0 0" mass=".3"/>'
SWING = '<joint name="j" axis="0 1 0" damping=".01"/>'
END = f'<body name="end" pos=".3 0 0"><joint name="k" axis="0 1 0"/>{BAR}</body>'


@pytest.fixture
def bars(tmp_path: Path, old_releases: None) -> GapSplit:
    """Return the split of a gap of which neither side runs on the installed MuJoCo.

    Only the right has a joint k.
    """
    need_engine("pybullet")
    left, right = (
        written(
            tmp_path / name,
            mjcf(
                f'<body><joint name="j" axis="0 1 0" damping=".01"/>{BAR}{end}</body>', "", IMPLICIT
            ),
        )
        for name, end in (("one.xml", ""), ("two.xml", END))
    )
    split, _ = divided(sm.load(left, backend="pybullet"), sm.load(right, backend=OLD), "fall")
    assert split is not None
    return split


def test_figures_that_cannot_be_made_the_same_leave_import_alone(bars: GapSplit) -> None:
    share = parts(bars)
    assert (bars.obstacle, share["joint dynamics"], share["contact"]) == ("figures", None, None)
    assert share["import"] + bars.together == 1


def test_a_page_names_the_figures_that_cannot_be_made_the_same(bars: GapSplit) -> None:
    text = shown(Page("", "", render_blocks(SplitParagraphs(bars, "70.8°", "short"))))
    assert bars.detail == "extra joint of k"
    assert_in(" ".join(text.split()), "Joint dynamics and contact cannot be separated", bars.detail)


def test_what_a_reader_does_not_tell_cannot_be_separated(arm: Model) -> None:
    """Import and joint dynamics are then one part; contact is known."""
    with registered("hidden", "tests.support.hidden_world:load"):
        right = sm.load("so101/scene", backend="hidden")
        right.raw.body_mass[:] *= 1.3  # which no compiled model tells
        split, _ = divided(arm, right)
    share = parts(split)
    assert (share["import"], share["joint dynamics"]) == (None, None)
    assert share["contact"] + split.together == 1
    assert split.obstacle == "not run"
    assert "hidden" in split.detail


def test_contacts_that_stay_on_cannot_be_separated(arm: Model) -> None:
    with registered("touching", f"{__name__}:load_in_contact"):
        right = sm.load("so101/scene", backend="touching")
        right.raw.body_mass[:] *= 1.3
        split, _ = divided(arm, right)
    assert set(parts(split).values()) == {None}


def test_other_starts_are_none_of_the_three(arm: Model, old_releases: None) -> None:
    pose = np.zeros(arm.nq)
    runs: list[Trace] = []
    for qpos in (pose, pose + 0.1):
        runs.append(Rerun(arm, lambda _: lambda _model, _data: None, 0.2, qpos=qpos).record())
    split, _ = divided(arm, sm.load("so101/scene", backend=OLD), "droop", recordings=tuple(runs))
    assert set(parts(split).values()) == {None}
    assert split.obstacle == "start or commands"
    assert split.together == 1


# As it is shown.


@pytest.fixture(scope="module")
def found(lost: Path) -> Any:
    """Return an explanation of two engines whose files differ."""
    need_engine("pybullet")
    sides = (Side("so101"), Side(str(lost), "pybullet"))
    return answer(ExplainRequest(Request(("hold",), sides=sides), uncertainty=None))


def test_the_result_has_the_split_as_plain_numbers(found: Any) -> None:
    assert parts(found.split) == pytest.approx(
        {"import": 1, "joint dynamics": 0, "contact": 0}, abs=1e-5
    )


def test_json_has_the_three_shares(lost: Path, here: Cli) -> None:
    need_engine("pybullet")
    done = here("compare", "hold", "so101", f"{lost}@pybullet", "--why", "--no-chaos", "--json")
    split = json.loads(done.stdout)["split"]
    names = {"readers", "reads_alike", "parts", "figures_of", "touches", "obstacle", "detail"}
    assert split.keys() == {*names, "together"}
    assert [part["name"] for part in split["parts"]] == ["import", "joint dynamics", "contact"]
    assert all(part.keys() == {"name", "share"} for part in split["parts"])


def test_a_terminal_shows_it_in_six_lines_at_most(found: Any) -> None:
    text = shown(Page("", "", split_blocks(found)))
    assert len(text.strip().splitlines()) <= 6
    assert text.strip() in shown(page(found))


def test_a_page_shows_it(lost: Path, here: Cli, tmp_path: Path) -> None:
    need_engine("pybullet")
    sides = ("so101", f"{lost}@pybullet")
    here("compare", "hold", *sides, "--why", "--no-chaos", "--html", "page.html")
    html = (tmp_path / "page.html").read_text("utf-8")
    assert "import 100.0" in html


def test_one_engine_says_it_in_the_details_alone(tmp_path: Path) -> None:
    heavy = ARM.replace('mass="0.5"', 'mass="0.9"', 1)
    result = explained(tmp_path, ARM, heavy, uncertain=None, jobs=1)
    assert parts(result.split) == {"import": 1, "joint dynamics": 0, "contact": 0}
    assert (list(split_blocks(result)), len(split_blocks(result, details=True))) == ([], 1)

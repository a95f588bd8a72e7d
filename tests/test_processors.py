"""The bits of a run are the same whichever processor's kernels NumPy chooses."""

from __future__ import annotations

import ast
import json
import platform
import re
from typing import Any

import pytest

from .support.processes import of_python
from .support.requirements import ROOT

_RUN = """
import hashlib, json, sys
import numpy as np
import statemachine as sm

random = np.random.default_rng(0)
matrix, vector = random.random((40, 7, 7)), random.random((40, 7))
numpy = hashlib.sha256()
for a, b in zip(matrix, vector):
    numpy.update((a @ b).tobytes())
    numpy.update(np.linalg.solve(a, b).tobytes())
numpy.update((vector ** (2 * vector)).tobytes())
found = {"NumPy": numpy.hexdigest()}
for backend, defaults in (("mujoco", "model"), ("pybullet", "model"), ("pybullet", "engine")):
    model = sm.load("so101/scene_box", backend=backend, defaults=defaults)
    digest = hashlib.sha256()
    with sm.make_data(model) as data:
        sm.reset(model, data, keyframe=0)
        for k in range(60):
            data.ctrl[:] = random.uniform(-2.5, 2.5, model.nu)  # into limits, and the floor
            sm.step(model, data, 10)
            digest.update(sm.get_state(model, data).blob)
            if k % 7 == 0:
                sm.forward(model, data)
            for name in ("xpos", "xquat", "site_xpos", "site_xmat", "qfrc_bias"):
                digest.update(getattr(data, name).tobytes())
            if defaults == "model":
                digest.update(data.qacc.tobytes())
                digest.update(data.qfrc_constraint.tobytes())
            contacts = data.contacts
            for array in (contacts.dist, contacts.pos, contacts.frame, contacts.force):
                digest.update(array.tobytes())
    found[f"{backend} {defaults}"] = digest.hexdigest()
print(json.dumps(found))
"""
# What NumPy does on other processors: its BLAS is told, its own loops are forbidden.
_PROCESSORS = [
    {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4"},
    {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4"},
]


def _digests(**environment: Any) -> dict[str, str]:
    return json.loads(of_python("-W", "ignore", "-c", _RUN, code=0, **environment).stdout)


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() != "x86_64", reason="the kernels are those of x86-64")
@pytest.mark.usefixtures("bullet")
def test_bits_do_not_depend_on_the_kernels_of_numpy() -> None:
    here, *others = (_digests(**environment) for environment in ({}, *_PROCESSORS))
    if {other.pop("NumPy") for other in others} == {here.pop("NumPy")}:
        pytest.skip("this NumPy has one set of kernels")
    assert others == [here, here]


# A part of what they find is rounded, or only compared with a limit.
_ROUNDED = {"_worst", "_padding_at", "Surfaces._solve", "Surfaces._frictions_of_solids"}
# Vertices of hulls are rounded when they are written.
_ROUNDED |= {"Hull.__init__", "roughness", "_planes", "_inset", "_sphere"}


@pytest.mark.slow
def test_dense_algebra_is_not_numpys() -> None:
    """`backends/dense.py` has what a backend with bits of its own to keep may use."""
    files = sorted((ROOT / "statemachine" / "backends" / "bullet").glob("[!_]*.py"))
    assert len(files) > 10
    numpys = []
    for file in files:
        for place, node in _nodes(ast.parse(file.read_text("utf-8")), ""):
            product = isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult)
            solution = re.match(r"np\.(.*\.)?(linalg|power|exp)$", ast.unparse(node))
            if place not in _ROUNDED and (product or solution):
                numpys.append(f"{file.stem}, {place}: {ast.unparse(node)}")
    assert numpys == []


def _nodes(tree: ast.AST, place: str) -> list[tuple[str, ast.AST]]:
    """Return each node of a syntax tree, with the function or class that it stands in."""
    found = []
    for node in ast.iter_child_nodes(tree):
        named = isinstance(node, (ast.FunctionDef, ast.ClassDef))
        inner = f"{place}.{node.name}".strip(".") if named else place
        found += [(inner, node), *_nodes(node, inner)]
    return found

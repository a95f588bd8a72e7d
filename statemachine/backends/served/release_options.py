"""Options with which a release of MuJoCo reads an MJCF, in the Python of its environment.

It needs MuJoCo only, on Python 3.9 or later, and imports nothing of this package: it runs the file
beside it.
"""

from __future__ import annotations

import os
import runpy

import mujoco

# The mass [kg] and inertia [kg m^2] of a body that moves without; as `repair_record.LEAST`.
_LEAST = 1e-12


def spec_with_options(file, balance_inertia, meshes, base, start, least_mass):
    """Return the spec of a file that is read with options.

    Raises:
        ValueError: The release is older than 3.2, and has no MjSpec.
    """
    if not hasattr(mujoco, "MjSpec"):
        raise ValueError("before 3.2 MuJoCo has no MjSpec: it reads an MJCF as it is written")
    spec = mujoco.MjSpec.from_file(file)
    if base is not None:
        place = os.path.join(os.path.dirname(os.path.abspath(__file__)), "release_base.py")
        runpy.run_path(place)["set_base"](spec, base, start)
    if balance_inertia:
        getattr(spec, "compiler", spec).balanceinertia = True
    if least_mass:
        compiler = getattr(spec, "compiler", spec)
        compiler.boundmass = max(compiler.boundmass, _LEAST)
        compiler.boundinertia = max(compiler.boundinertia, _LEAST)
    if not meshes:
        for element in [geom for geom in spec.geoms if geom.meshname] + list(spec.meshes):
            if hasattr(spec, "delete"):
                spec.delete(element)
            else:
                element.delete()
    return spec

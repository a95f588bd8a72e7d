"""What of a compiled model can change a motion, and what cannot: every array and every option.

`rows` are compared and can be copied from one model to another as they are; what lies in a frame
of its own, or belongs to several elements, is compared by `differences`. A test walks all that an
mjModel has and fails for what none of these tables knows.
"""

from __future__ import annotations

from dataclasses import dataclass
from fnmatch import fnmatchcase


def _words(text: str) -> tuple[str, ...]:
    return tuple(text.split())


@dataclass(frozen=True)
class FieldRow:
    """Entries of one element that are one thing.

    Attributes:
        subject: What it is called.
        fields: Arrays of the compiled model.
        unit: Of the first field.
        when: Arrays of which one must not be zero, on either side, for the rest to have an effect.
    """

    subject: str
    fields: tuple[str, ...]
    unit: str = ""
    when: str = ""


# A limited quantity is compared with its range; a range without the flag says nothing.
LIMITED = {
    "jnt_range": "jnt_limited",
    "jnt_actfrcrange": "jnt_actfrclimited",
    "actuator_ctrlrange": "actuator_ctrllimited",
    "actuator_forcerange": "actuator_forcelimited",
    "actuator_actrange": "actuator_actlimited",
    "tendon_range": "tendon_limited",
    "tendon_actfrcrange": "tendon_actfrclimited",
}

JOINT = (
    FieldRow("range", ("jnt_limited", "jnt_range"), "rad"),
    FieldRow("stop", ("jnt_solref", "jnt_solimp", "jnt_margin"), when="jnt_limited"),
    FieldRow("spring", ("jnt_stiffness", "jnt_stiffnesspoly", "jnt_springyield"), "N·m/rad"),
    FieldRow("force limit", ("jnt_actfrclimited", "jnt_actfrcrange"), "N·m"),
    FieldRow("weight carried by its motor", ("jnt_actgravcomp",)),
)
DOF = (
    FieldRow("armature", ("dof_armature",), "kg m²"),
    FieldRow("damping", ("dof_damping", "dof_dampingpoly"), "N·m·s"),
    FieldRow("dry friction", ("dof_frictionloss",), "N·m"),
    FieldRow("softness of dry friction", ("dof_solref", "dof_solimp"), when="dof_frictionloss"),
)
GEOM = (
    FieldRow("filter", ("geom_contype", "geom_conaffinity")),
    FieldRow("friction", ("geom_friction",)),
    FieldRow("friction dimensions", ("geom_condim",)),
    FieldRow("softness", ("geom_solref", "geom_solimp", "geom_solmix")),
    FieldRow("priority", ("geom_priority",)),
    FieldRow("margin", ("geom_margin", "geom_gap"), "m"),
    FieldRow("adhesion", ("geom_adhesion",)),
    FieldRow("moving surface", ("geom_surfacevel",), "m/s"),
)
ACTUATOR = (
    FieldRow(
        "gains",
        ("actuator_gaintype", "actuator_gainprm", "actuator_biastype", "actuator_biasprm"),
    ),
    FieldRow("gear", ("actuator_gear", "actuator_cranklength")),
    FieldRow("force range", ("actuator_forcelimited", "actuator_forcerange"), "N·m"),
    FieldRow("dynamics", ("actuator_dynprm", "actuator_actearly"), when="actuator_dyntype"),
    FieldRow("range of its activation", ("actuator_actlimited", "actuator_actrange")),
    FieldRow("rotor", ("actuator_armature",)),
    FieldRow("damping", ("actuator_damping", "actuator_dampingpoly")),
    FieldRow("length range", ("actuator_lengthrange",), when="actuator_gaintype actuator_biastype"),
)
DELAY = (FieldRow("delay", ("actuator_delay",), "s"),)
GROUP = (FieldRow("group", ("actuator_group",)),)
CONTROL = (FieldRow("range of ctrl", ("actuator_ctrllimited", "actuator_ctrlrange")),)
TENDON = (
    FieldRow("range", ("tendon_limited", "tendon_range"), "m"),
    FieldRow(
        "stop", ("tendon_solref_lim", "tendon_solimp_lim", "tendon_margin"), when="tendon_limited"
    ),
    FieldRow("spring", ("tendon_stiffness", "tendon_stiffnesspoly", "tendon_springyield")),
    FieldRow(
        "slack length",
        ("tendon_lengthspring",),
        "m",
        when="tendon_stiffness tendon_stiffnesspoly",
    ),
    FieldRow("damping", ("tendon_damping", "tendon_dampingpoly")),
    FieldRow("dry friction", ("tendon_frictionloss",)),
    FieldRow(
        "softness of dry friction",
        ("tendon_solref_fri", "tendon_solimp_fri"),
        when="tendon_frictionloss",
    ),
    FieldRow("armature", ("tendon_armature",)),
    FieldRow("force limit", ("tendon_actfrclimited", "tendon_actfrcrange")),
)
EQUALITY = (
    FieldRow("active", ("eq_active0",)),
    FieldRow("what it keeps", ("eq_data",)),
    FieldRow("softness", ("eq_solref", "eq_solimp")),
)
PAIR = (
    FieldRow("friction", ("pair_friction", "pair_dim")),
    FieldRow("softness", ("pair_solref", "pair_solimp", "pair_solreffriction")),
    FieldRow("margin", ("pair_margin", "pair_gap")),
    FieldRow("adhesion", ("pair_adhesion",)),
)
SENSOR = (
    FieldRow("sensor", ("sensor_intprm", "sensor_delay", "sensor_interval", "sensor_history")),
    FieldRow("cutoff", ("sensor_cutoff",)),
)
TREE = (FieldRow("sleep policy", ("tree_sleep_policy",)),)
BODY = (FieldRow("weight taken off", ("body_gravcomp",)),)

# What is compared with regard to frames, shapes and owners, element by element.
PLACED = _words(
    "body_mass body_ipos body_iquat body_inertia body_pos body_quat body_parentid jnt_type jnt_pos "
    "jnt_axis jnt_bodyid qpos0 qpos_spring geom_type geom_size geom_pos geom_quat geom_dataid "
    "geom_bodyid geom_fluid site_pos site_quat site_bodyid actuator_trntype actuator_trnid "
    "actuator_dyntype actuator_ctrlspec actuator_actnum actuator_ctrlnum actuator_outnum "
    "eq_type eq_obj1id eq_obj2id eq_objtype wrap_objid wrap_prm wrap_type tendon_adr "
    "tendon_num pair_geom1 pair_geom2 exclude_signature mesh_vert mesh_vertadr mesh_vertnum "
    "mesh_face mesh_faceadr mesh_facenum hfield_data hfield_size hfield_nrow hfield_ncol hfield_adr"
)

# Compared whole: a model that has any can be compared, but is not brought to another.
WHOLE = _words(
    "flex_* plugin plugin_attr plugin_attradr body_plugin geom_plugin actuator_plugin "
    "sensor_plugin actuator_history"
)

# The state that a run starts in, which the comparison of runs brings over itself.
STARTS = ("key_*",)

# Options of the engine: what they are called, and what is one thing.
OPTIONS = {
    "gravity": ("gravity",),
    "timestep": ("timestep",),
    "integrator": ("integrator",),
    "solver": (
        "solver",
        "iterations",
        "tolerance",
        "ls_iterations",
        "ls_tolerance",
        "jacobian",
        "noslip_iterations",
        "noslip_tolerance",
    ),
    "contact model": ("cone", "impratio"),
    "collision": (
        "ccd_iterations",
        "ccd_tolerance",
        "sdf_initpoints",
        "sdf_iterations",
    ),
    "medium": ("density", "viscosity", "wind"),
    "magnetic field": ("magnetic",),
    "contact override": ("o_friction", "o_margin", "o_solimp", "o_solref"),
    "actuator groups": ("disableactuator",),
    "sleep": ("sleep_tolerance",),
}
# Options that are one of a list, and the enumeration that names it.
CHOICES = {
    "integrator": "mjtIntegrator",
    "solver": "mjtSolver",
    "cone": "mjtCone",
    "jacobian": "mjtJacobian",
}
FLAGS = ("disableflags", "enableflags")
OPTION_UNITS = {"gravity": "m/s²", "timestep": "s", "wind": "m/s", "density": "kg/m³"}
# Flags without an effect on the motion, and why.
IDLE_FLAGS = {
    "mjDSBL_SENSOR": "sensors are read only",
    "mjDSBL_MIDPHASE": "it finds the same contacts, and sorts them alike",
    "mjDSBL_AUTORESET": "it only decides what follows a divergence, which is raised",
    "mjENBL_ENERGY": "the energy is computed beside the motion",
    "mjENBL_FWDINV": "it compares and changes nothing",
    "mjENBL_INVDISCRETE": "of inverse dynamics, which a step does not compute",
}

# What no motion depends on, and why; a star stands for the rest of a name.
IDLE = {
    "cam_*": "it shows the scene",
    "light_*": "it shows the scene",
    "mat_*": "it shows the scene",
    "tex_*": "it shows the scene",
    "skin_*": "it shows the scene",
    "*_rgba": "it shows the scene",
    "*_matid": "it shows the scene",
    "*_castshadow": "it shows the scene",
    "tendon_width": "it shows the scene",
    "mesh_normal*": "it shows the scene",
    "mesh_texcoord*": "it shows the scene",
    "mesh_facenormal": "it shows the scene",
    "mesh_facetexcoord": "it shows the scene",
    "flex_texcoord*": "it shows the scene",
    "*_group": "it groups elements for the viewer",
    "*_user": "a user's own data, which the engine does not read",
    "numeric_*": "a user's own data, which the engine does not read",
    "text_*": "a user's own data, which the engine does not read",
    "tuple_*": "a user's own data, which the engine does not read",
    "sensor_*": "only a controller reads them: `_sensors`, where there is one",
    "name*": "names pair elements, and act on nothing",
    "*_pathadr": "where a file was",
    "site_type": "it shows the site; of sensors it is read only",
    "site_size": "it shows the site; of sensors it is read only",
    "site_dataid": "it shows the site; of sensors it is read only",
    "mesh_pos": "how the compiler moved the vertices, which are compared where they are",
    "mesh_quat": "how the compiler turned the vertices, which are compared where they are",
    "mesh_scale": "how the compiler scaled the vertices, which are compared",
    "light_texid": "it shows the scene",
}

# What the compiler or `mj_setConst` computes from the rest.
DERIVED = _words(
    "B_* D_* M_* mapD2M mapM2D mapM2M bvh_* oct_* efm0_* efmC_perm flexedge_* ten_J_* tree_* "
    "actuator_acc0 actuator_actadr actuator_ctradr actuator_ctrladr actuator_historyadr "
    "actuator_length0 actuator_outadr body_bvhadr body_bvhnum body_conaffinity body_contype "
    "body_dofadr body_dofnum body_geomadr body_geomnum body_invweight0 body_jntadr body_jntnum "
    "body_margin body_mocapid body_rootid body_sameframe body_simple body_subtreemass body_treeid "
    "body_weldid dof_M0 dof_Madr dof_bodyid dof_invweight0 dof_jntid dof_length dof_parentid "
    "dof_simplenum dof_treeid geom_aabb geom_rbound geom_sameframe site_sameframe jnt_actuatorid "
    "jnt_dofadr jnt_qposadr jnt_plasticadr tendon_plasticadr tendon_actuatorid tendon_invweight0 "
    "tendon_length0 tendon_treeid tendon_treenum tendon_type mesh_bvhadr mesh_bvhnum mesh_extrema "
    "mesh_graph mesh_graphadr mesh_octadr mesh_octnum mesh_poly* pair_signature plugin_stateadr "
    "plugin_statenum"
)

ROWS = (
    *JOINT,
    *DOF,
    *GEOM,
    *ACTUATOR,
    *DELAY,
    *GROUP,
    *CONTROL,
    *TENDON,
    *EQUALITY,
    *PAIR,
    *BODY,
    *TREE,
)


def known(name: str) -> str:
    """What becomes of an array of a compiled model: compared, whole, start, idle, derived or "".

    Args:
        name: Of the attribute of an mjModel.
    """
    if name in PLACED or any(name in row.fields for row in ROWS):
        return "compared"
    for kind, names in (
        ("whole", WHOLE),
        ("start", STARTS),
        ("idle", tuple(IDLE)),
        ("derived", DERIVED),
    ):
        if any(fnmatchcase(name, pattern) for pattern in names):
            return kind
    return ""

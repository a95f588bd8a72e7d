"""What of a compiled model can change a motion, and what cannot: every array and every option.

`ROWS` are compared and can be copied from one model to another as they are; what lies in a frame
of its own, or belongs to several elements, is compared by `differences`. A test walks all that an
mjModel has and fails for what none of these tables knows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase


@dataclass(frozen=True)
class FieldRow:
    """Entries of one element that are one thing.

    Attributes:
        subject: What it is called.
        fields: Arrays of the compiled model.
        unit: SI unit of the fields, but for those in `units`.
        when: Arrays of which one must not be zero, on either side, for the rest to have an effect.
        units: SI unit of each field that has another unit, by its name without the kind of the
            element; "" of one without.
    """

    subject: str
    fields: tuple[str, ...]
    unit: str = ""
    when: str = ""
    units: Mapping[str, str] = field(default_factory=dict)

    def unit_of(self, array: str) -> str:
        """Return the SI unit of the entries of one of its arrays; "" without one."""
        if array in FLAGS_OF_ELEMENTS or array in CHOICES:
            return ""
        return self.units.get(word_of(array), self.unit)


def word_of(array: str) -> str:
    """Return what an array is called without the kind of its element: "solref"."""
    kind, _, rest = array.partition("_")
    return rest or kind


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

# The flags of these.
LIMITS = frozenset(LIMITED.values())

# What is compared entry by entry: of an element of some kind, or of another index of it. Units of
# joints, tendons and actuators are those of a rotation.
ROWS: dict[str, tuple[FieldRow, ...]] = {
    "joint": (
        FieldRow("range", ("jnt_limited", "jnt_range"), "rad"),
        FieldRow(
            "stop",
            ("jnt_solref", "jnt_solimp", "jnt_margin"),
            when="jnt_limited",
            units={"margin": "rad"},
        ),
        FieldRow(
            "spring",
            ("jnt_stiffness", "jnt_stiffnesspoly", "jnt_springyield"),
            "N·m/rad",
            units={"stiffnesspoly": "", "springyield": ""},
        ),
        FieldRow("force limit", ("jnt_actfrclimited", "jnt_actfrcrange"), "N·m"),
        FieldRow("weight carried by its motor", ("jnt_actgravcomp",)),
    ),
    "dof": (
        FieldRow("armature", ("dof_armature",), "kg m²"),
        FieldRow("damping", ("dof_damping", "dof_dampingpoly"), "N·m·s", units={"dampingpoly": ""}),
        FieldRow("dry friction", ("dof_frictionloss",), "N·m"),
        FieldRow("softness of dry friction", ("dof_solref", "dof_solimp"), when="dof_frictionloss"),
    ),
    "geom": (
        FieldRow("filter", ("geom_contype", "geom_conaffinity")),
        FieldRow("friction", ("geom_friction",)),
        FieldRow("friction dimensions", ("geom_condim",)),
        FieldRow("softness", ("geom_solref", "geom_solimp", "geom_solmix")),
        FieldRow("priority", ("geom_priority",)),
        FieldRow("margin", ("geom_margin", "geom_gap"), "m"),
        FieldRow("adhesion", ("geom_adhesion",)),
        FieldRow("moving surface", ("geom_surfacevel",), "m/s"),
    ),
    "actuator": (
        FieldRow(
            "gains",
            ("actuator_gaintype", "actuator_gainprm", "actuator_biastype", "actuator_biasprm"),
        ),
        FieldRow("crank", ("actuator_cranklength",), "m"),
        FieldRow("force range", ("actuator_forcelimited", "actuator_forcerange"), "N·m"),
        FieldRow("dynamics", ("actuator_dynprm", "actuator_actearly"), when="actuator_dyntype"),
        FieldRow("range of its activation", ("actuator_actlimited", "actuator_actrange")),
        FieldRow("rotor", ("actuator_armature",), "kg m²"),
        FieldRow(
            "damping",
            ("actuator_damping", "actuator_dampingpoly"),
            "N·m·s",
            units={"dampingpoly": ""},
        ),
    ),
    # Of each of its outputs, of which an actuator of a ball joint has three.
    "output": (
        FieldRow("gear", ("actuator_gear",)),
        FieldRow("length range", ("actuator_lengthrange",), "rad"),
    ),
    "delay": (FieldRow("delay", ("actuator_delay",), "s"),),
    "group": (FieldRow("group", ("actuator_group",)),),
    "control": (FieldRow("range of ctrl", ("actuator_ctrllimited", "actuator_ctrlrange")),),
    "tendon": (
        FieldRow("range", ("tendon_limited", "tendon_range"), "rad"),
        FieldRow(
            "stop",
            ("tendon_solref_lim", "tendon_solimp_lim", "tendon_margin"),
            when="tendon_limited",
            units={"margin": "rad"},
        ),
        FieldRow(
            "spring",
            ("tendon_stiffness", "tendon_stiffnesspoly", "tendon_springyield"),
            "N·m/rad",
            units={"stiffnesspoly": "", "springyield": ""},
        ),
        FieldRow(
            "slack length",
            ("tendon_lengthspring",),
            "rad",
            when="tendon_stiffness tendon_stiffnesspoly",
        ),
        FieldRow(
            "damping",
            ("tendon_damping", "tendon_dampingpoly"),
            "N·m·s",
            units={"dampingpoly": ""},
        ),
        FieldRow("dry friction", ("tendon_frictionloss",), "N·m"),
        FieldRow(
            "softness of dry friction",
            ("tendon_solref_fri", "tendon_solimp_fri"),
            when="tendon_frictionloss",
        ),
        FieldRow("armature", ("tendon_armature",), "kg m²"),
        FieldRow("force limit", ("tendon_actfrclimited", "tendon_actfrcrange"), "N·m"),
    ),
    "equality": (
        FieldRow("active", ("eq_active0",)),
        FieldRow("softness", ("eq_solref", "eq_solimp")),
    ),
    "pair": (
        FieldRow("friction", ("pair_friction", "pair_dim")),
        FieldRow("softness", ("pair_solref", "pair_solimp", "pair_solreffriction")),
        FieldRow("margin", ("pair_margin", "pair_gap"), "m"),
        FieldRow("adhesion", ("pair_adhesion",)),
    ),
    "sensor": (
        FieldRow("sensor", ("sensor_intprm", "sensor_delay", "sensor_interval", "sensor_history")),
        FieldRow("cutoff", ("sensor_cutoff",)),
    ),
    "flex": (
        FieldRow("filter", ("flex_contype", "flex_conaffinity")),
        FieldRow("friction", ("flex_friction",)),
        FieldRow("friction dimensions", ("flex_condim",)),
        FieldRow("softness", ("flex_solref", "flex_solimp", "flex_solmix")),
        FieldRow("priority", ("flex_priority",)),
        FieldRow("margin", ("flex_margin", "flex_gap"), "m"),
        FieldRow("radius", ("flex_radius",), "m"),
        FieldRow("self-collision", ("flex_selfcollide", "flex_activelayers", "flex_passive")),
        FieldRow(
            "damping", ("flex_damping", "flex_edgedamping"), "s", units={"edgedamping": "N·s/m"}
        ),
        FieldRow("edge stiffness", ("flex_edgestiffness",), "N/m"),
        FieldRow("yield", ("flex_yield",)),
    ),
    "tree": (FieldRow("sleep policy", ("tree_sleep_policy",)),),
    "body": (FieldRow("weight taken off", ("body_gravcomp",)),),
}

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
# Options and arrays whose entries are one of a list, and the enumeration that names it.
OPTION_CHOICES = {
    "integrator": "mjtIntegrator",
    "solver": "mjtSolver",
    "cone": "mjtCone",
    "jacobian": "mjtJacobian",
}
CHOICES = {
    "actuator_dyntype": "mjtDyn",
    "actuator_gaintype": "mjtGain",
    "actuator_biastype": "mjtBias",
    "tree_sleep_policy": "mjtSleepPolicy",
    "flex_selfcollide": "mjtFlexSelf",
}
# Arrays whose entries are on or off.
FLAGS_OF_ELEMENTS = frozenset(
    {
        *("jnt_limited", "jnt_actfrclimited", "jnt_actgravcomp", "tendon_limited"),
        *("tendon_actfrclimited", "actuator_ctrllimited", "actuator_forcelimited"),
        *("actuator_actlimited", "actuator_actearly", "eq_active0", "flex_passive"),
    }
)
# Arrays of an element of which a file may write the first numbers alone.
BEGINNINGS = (
    *("*_solref*", "*_solimp*", "*_friction", "*poly", "*prm", "actuator_gear", "eq_*"),
    *("opt.o_solref", "opt.o_solimp", "opt.o_friction", "geom_surfacevel", "fluidcoef"),
)
FLAGS = ("disableflags", "enableflags")
# SI unit of each of these that has one.
OPTION_UNITS = {
    "gravity": "m/s²",
    "timestep": "s",
    "wind": "m/s",
    "density": "kg/m³",
    "viscosity": "Pa·s",
    "magnetic": "T",
    "o_margin": "m",
}
# Flags without an effect on the motion, and why.
IDLE_FLAGS = {
    "mjDSBL_SENSOR": "sensors are read only",
    "mjDSBL_MIDPHASE": "it finds the same contacts, and sorts them alike",
    "mjDSBL_AUTORESET": "it only decides what follows a divergence, which is raised",
    "mjENBL_ENERGY": "the energy is computed beside the motion",
    "mjENBL_FWDINV": "it compares and changes nothing",
    "mjENBL_INVDISCRETE": "of inverse dynamics, which a step does not compute",
}

# What becomes of the other arrays; a star stands for the rest of a name.
FATES = {
    # What is compared with regard to frames, shapes and owners, element by element.
    "compared": (
        "body_mass body_ipos body_iquat body_inertia body_pos body_quat body_parentid jnt_type "
        "jnt_pos jnt_axis jnt_bodyid qpos0 qpos_spring geom_type geom_size geom_pos geom_quat "
        "geom_dataid geom_bodyid geom_fluid site_pos site_quat site_bodyid actuator_trntype "
        "actuator_trnid actuator_dyntype actuator_ctrlspec actuator_actnum actuator_ctrlnum "
        "actuator_outnum eq_data eq_type eq_obj1id eq_obj2id eq_objtype wrap_objid wrap_prm "
        "wrap_type tendon_adr tendon_num pair_geom1 pair_geom2 exclude_signature mesh_vert "
        "mesh_vertadr mesh_vertnum mesh_face mesh_faceadr mesh_facenum hfield_data hfield_size "
        "hfield_nrow hfield_ncol hfield_adr flex_dim flex_interp flex_cellnum flex_edgeequality "
        "flex_rigid flex_centered flex_plasticmode flex_vert flex_vert0 flex_vertnum flex_node "
        "flex_node0 flex_nodenum flex_stiffness flex_bending flex_elem flex_elemnum flex_edge "
        "flex_edgenum flexedge_rigid"
    ),
    # Compared whole: a model that has any can be compared, but is not equalized with another.
    "whole": (
        "plugin plugin_attr plugin_attradr body_plugin geom_plugin actuator_plugin "
        "sensor_plugin actuator_history"
    ),
    # The state that a run starts in, which the comparison of runs brings over itself.
    "start": "key_*",
    # What no motion depends on, and why.
    "idle": (
        # It shows the scene.
        "cam_* light_* mat_* tex_* skin_* *_rgba *_matid *_castshadow tendon_width "
        "mesh_normal* mesh_texcoord* mesh_facenormal mesh_facetexcoord flex_texcoord* "
        "flex_elemtexcoord flex_flatskin "
        "light_texid "
        # It groups elements for the viewer.
        "*_group "
        # A user's own data, which the engine does not read: `_readable`, where a function might.
        "*_user numeric_* text_* tuple_* "
        # Names pair elements, and act on nothing.
        "name* "
        # Where a file was.
        "*_pathadr "
        # It shows the site; of sensors it is read only.
        "site_type site_size site_dataid "
        # How the compiler moved the vertices, which are compared where they are.
        "mesh_pos "
        # How the compiler turned the vertices, which are compared where they are.
        "mesh_quat "
        # How the compiler scaled the vertices, which are compared.
        "mesh_scale "
        # Only a controller reads them: `_sensors`, where there is one.
        "sensor_*"
    ),
    # What the compiler or `mj_setConst` computes from the rest.
    "derived": (
        "B_* D_* M_* mapD2M mapM2D mapM2M bvh_* oct_* efm0_* efmC_perm flexedge_* ten_J_* "
        "tree_* actuator_acc0 actuator_actadr actuator_ctradr actuator_ctrladr "
        "actuator_historyadr actuator_length0 actuator_outadr body_bvhadr body_bvhnum "
        "body_conaffinity body_contype body_dofadr body_dofnum body_geomadr body_geomnum "
        "body_invweight0 body_jntadr body_jntnum body_margin body_mocapid body_rootid "
        "body_sameframe body_simple body_subtreemass body_treeid body_weldid dof_M0 dof_Madr "
        "dof_bodyid dof_invweight0 dof_jntid dof_length dof_parentid dof_simplenum dof_treeid "
        "geom_aabb geom_rbound geom_sameframe site_sameframe jnt_actuatorid jnt_dofadr "
        "jnt_qposadr jnt_plasticadr tendon_plasticadr tendon_actuatorid tendon_invweight0 "
        "tendon_length0 tendon_treeid tendon_treenum tendon_type mesh_bvhadr mesh_bvhnum "
        "mesh_extrema mesh_graph mesh_graphadr mesh_octadr mesh_octnum mesh_poly* "
        "pair_signature plugin_stateadr plugin_statenum flex_*adr flex_bvhnum flex_edgeflap "
        "flex_elemedge flex_elemlayer flex_nodebodyid flex_shell flex_shellnum flex_size "
        "flex_vertbodyid flex_vertcell"
    ),
}


def is_beginning(array: str) -> bool:
    """Tell whether a file may write the first numbers of an array's entries alone."""
    return any(fnmatchcase(array, pattern) for pattern in BEGINNINGS)


def known(name: str) -> str:
    """Return what becomes of an array of a compiled model: a key of `FATES`, or "".

    Args:
        name: Of the attribute of an mjModel.
    """
    if any(name in row.fields for rows in ROWS.values() for row in rows):
        return "compared"
    for fate, names in FATES.items():
        if any(fnmatchcase(name, pattern) for pattern in names.split()):
            return fate
    return ""

"""A tree that stands or floats, what ties it and what acts on it, for PyBullet against MuJoCo."""

from __future__ import annotations

BASES = {
    "fixed": "",
    "floating": "<freejoint/>",
    "dragged": '<joint type="free" armature=".1" damping=".3" frictionloss=".2"/>',
}
TREE = """<body name="base" pos=".1 .2 1" euler="10 20 30"> {base}
 <inertial pos=".02 -.01 .03" mass="3" fullinertia=".03 .04 .05 .002 .001 -.003"/>
 <body name="upper" pos=".2 0 .05" euler=".3 .2 .1">
  <joint name="a" axis="0 1 0" pos=".01 .02 0" armature=".01" damping=".05"/>
  <inertial pos=".1 0 0" mass=".7" diaginertia=".002 .003 .004"/>
  <geom name="drum" type="cylinder" size=".08 .05" zaxis="0 1 0" contype="0" conaffinity="0"/>
  <body name="lower" pos=".2 0 0">
   <joint name="s" type="slide" axis="1 0 .2" stiffness="40" damping="1"/>
   <joint name="b" axis="1 0 .2" frictionloss=".02" damping=".05" armature=".004"/>
   <inertial pos="0 .05 .1" quat="1 .2 .3 .1" mass=".4" diaginertia=".001 .0015 .002"/>
   <site name="tip" pos=".1 .1 .02" quat="1 .1 .2 .3"/>
  </body>
 </body>
 <body name="side" pos="-.2 0 .05"><joint name="c" axis="0 1 0" damping=".02"/>
  <inertial pos="-.1 .02 0" mass=".5" diaginertia=".002 .002 .003"/><site name="mark"/></body>
</body>
<body name="target" mocap="true" pos=".4 .5 1" quat="1 .3 .2 .1"><site name="held" pos=".1 0 0"/>
</body>
<site name="home" pos=".3 .2 .9"/>"""
DRUM = '<geom geom="drum"/>'
PATH = f'<site site="mark"/>{DRUM}<site site="tip"/></spatial></tendon>'
CURVES = " ".join(f'{name}prm=".8 1.1 -1 3 .5 1.6 1.5 1.3 1.2"' for name in ("gain", "bias"))
SUM = '<joint joint="a" coef="1"/><joint joint="c" coef="-.7"/></fixed>'
# What stands behind the tree.
TIES = {
    "nothing": "",
    "joints": '<equality><joint joint1="a" joint2="c" polycoef=".1 .5 .3 .2 .1"/></equality>',
    "one joint": '<equality><joint joint1="a" polycoef=".3 0 0 0 0" solref=".05 .7"/></equality>',
    "spring": f'<tendon><fixed stiffness="3" damping=".3" springlength="0 .1">{SUM}</tendon>',
    "armature": f'<tendon><fixed armature=".02">{SUM}</tendon>',
    "friction": f'<tendon><fixed frictionloss=".05">{SUM}</tendon>',
    "limit": f'<tendon><fixed range="-.1 .05" margin=".01">{SUM}</tendon>',
    "tendons": f'<tendon><fixed name="t">{SUM}<fixed name="u"><joint joint="b" coef="1"/></fixed>'
    '</tendon><equality><tendon tendon1="t" tendon2="u" polycoef=".1 1 .2 0 0"/></equality>',
    "path": f'<tendon><spatial stiffness="90" damping="3" springlength="0 .2">{PATH}',
    "rough path": f'<tendon><spatial range="0 .4" margin=".02" frictionloss=".7">{PATH}',
    "path to the mocap body": '<tendon><spatial stiffness="30" damping="2" range="0 .6"><site '
    'site="tip"/><site site="held"/></spatial></tendon>',
    "servo of a path": f'<tendon><spatial name="p">{PATH}<actuator><position tendon="p" kp="60" '
    'kv="4" gear="1.5" forcerange="-9 9"/><motor tendon="p" gear="3"/></actuator>',
    "muscles": f'<tendon><spatial name="p">{PATH}<actuator><muscle tendon="p" force="20" '
    'lengthrange=".3 .6"/><muscle joint="c" force="2" lengthrange="-1 1" gear=".7"/>'
    '<general joint="a" lengthrange="-2 2" forcerange="-1 0" actearly="true" dyntype="muscle" '
    f'dynprm=".02 .03 .5" gaintype="muscle" biastype="muscle" {CURVES}/></actuator>',
    "motor": f'<tendon><fixed name="t">{SUM}</tendon><actuator><position tendon="t" kp="3" kv=".3" '
    'gear="1.5" forcerange="-.4 .4"/><motor joint="b" gear=".2"/></actuator>',
    "filters": '<actuator><position joint="a" kp="5" kv=".2" timeconst=".1"/><general joint="b" '
    'dyntype="filter" dynprm=".05" gainprm=".3"/><intvelocity joint="c" kp="2" actrange="-.2 .3"/>'
    '<general joint="s" dyntype="integrator" actearly="true" gainprm="9"/></actuator>',
    "held": f'<tendon><fixed name="t">{SUM}</tendon><actuator><velocity tendon="t" kv=".5"/>'
    "</actuator>",
    "connect": '<equality><connect body1="lower" anchor="0 .1 0"/></equality>',
    "loop": '<equality><connect body1="lower" body2="side" anchor="0 .1 0"/></equality>',
    "weld": '<equality><weld body1="lower" body2="target" torquescale=".7"/></equality>',
    "mocap first": '<equality><weld body1="target" body2="lower" relpose=".1 0 .2 1 .2 .1 .1" '
    'anchor=".02 .03 .1"/></equality>',
    "weld within": '<equality><weld body1="side" body2="lower" solref=".03 1"/></equality>',
    "sites": '<equality><weld site1="tip" site2="home"/></equality>',
    "sites within": '<equality><connect site1="tip" site2="mark"/></equality>',
}  # fmt: skip
MEDIA = ('density="1000"', 'viscosity="2"', 'density="1000" viscosity="1" wind=".3 .1 0"')


def option(integrator: str, more: str = "") -> str:
    """Return the options of a model."""
    return f'<option timestep="0.002" integrator="{integrator}" {more}/>'

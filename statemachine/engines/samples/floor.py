"""What is put on a floor: a ball, where contacts are looked at, and a block that may slide."""

RADIUS = 0.1  # of the ball, 1 kg [m]
BALL = f"""<mujoco><option gravity="0 0 0"/><worldbody><geom type="plane" size="5 5 1"/>
<body pos="0 0 1"><freejoint/><geom size="{RADIUS}" mass="1"/></body></worldbody></mujoco>"""

BLOCK = (0.2, 0.2, 0.05)  # half its edges [m]
GRAVITY = 10.0  # on the block [m/s²]
REST, PULL = 0.5, 0.5  # for how long it lies, and is then pulled [s]

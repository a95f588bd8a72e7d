"""A controller of the balancer: it pushes the cart under the pole."""

GAINS = (4.0, 40.0, 6.0, 8.0)  # N for each m, rad, m/s, rad/s


def balance(model, data):
    """The force [N] on the cart, from where it is, how the pole leans, and how fast both move."""
    state = (*data.qpos, *data.qvel)
    return [sum(gain * value for gain, value in zip(GAINS, state, strict=True))]

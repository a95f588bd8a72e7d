"""A pile of boxes that fall on each other."""

HALF = 0.1  # an edge [m]
# Where the boxes begin, one over the other [m], and how the lowest is turned (w, x, y, z).
PLACES = ((0.0, 0.0, 0.25), (0.0, 0.02, 0.55), (0.0, 0.0, 0.85))
TILT = (0.92, 0.31, 0.21, 0.1)

"""A robot as its file describes it, whatever the format: what descriptions are compared by.

- `records`: a robot as frozen records, in one set of conventions
- `urdf`: from a URDF; what only an engine can read is read in that engine's room
- `shapes`: which is which, how they lie; corners, volumes and extents of meshes
"""

"""A robot, whatever its format: what compiled models are matched and compared by.

- `records`: a robot as frozen records, in one set of conventions
- `tree`: its rigid parts, and their plain mechanics
- `match`, `shapes`: which part of one is which of another, and how their frames and shapes lie
- `reading`: a file, or what an engine made of one, as a compiled model
- `urdf`: what the text of a URDF says, and no compiled model keeps
- `lines`: the line of a file at which an element stands
"""

"""The questions as functions of Python: keyword arguments that make a Request.

Each has the arguments that the command line has options for, and returns a Result. `lab` has all of
them by name.
"""

"""The fixtures of test_arm.py, so that `pytest exercises/test_arm.py` runs on the healthy arm."""

pytest_plugins = ["statemachine.course.grading.faults.plugin"]

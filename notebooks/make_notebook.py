"""Write notebooks/path.ipynb anew from the lessons: `make notebook`."""

from pathlib import Path

from statemachine.course.notebook import build

if __name__ == "__main__":
    Path(__file__).with_name("path.ipynb").write_text(build(), encoding="utf-8")

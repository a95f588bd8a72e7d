"""The course: its lessons, and how a student's work is graded."""

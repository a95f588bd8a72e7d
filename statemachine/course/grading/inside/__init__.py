"""What runs in a student's process: it calls a function, watches, and writes down what came of it.

Nothing in this folder knows what is right. It is all of `grading` that a student's process is shown
(`grading.shown`); the judges, which know, run in the teacher's process and get what was written
down. So nothing here imports anything of `grading` that is not in this folder.
"""

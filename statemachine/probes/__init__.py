"""Questions to an engine, answered by trying: nothing here is known beforehand.

- `conventions`: what each engine takes for granted; which of its calls does what
- `audit`: what exactly its state is, and what leaves it alone
- `calls`: which functions of an engine some lines of code made run
"""

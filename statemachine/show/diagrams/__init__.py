"""Diagrams of boxes, arrows and brackets: what they consist of, and how a terminal shows them."""

"""The parts of ``tools/pareto.py``: panels, methods, the front, the picture and its words."""

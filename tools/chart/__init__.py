"""The parts of ``tools/pareto.py``: panels, points, and what is drawn and said of them."""

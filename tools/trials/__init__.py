"""The scenes and sweeps of ``tools/stability.py``, one file each, and what judges them."""

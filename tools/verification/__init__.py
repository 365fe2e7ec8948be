"""The cases of ``tools/verify.py``: functions that take what is asked and yield figures."""

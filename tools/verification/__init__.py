"""The cases of ``tools/verify.py``: functions that yield figures; quick ones, fewer variants."""

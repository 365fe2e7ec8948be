"""The cases of ``tools/check.py``, one file each with ``run(quick)``, which yields rows."""

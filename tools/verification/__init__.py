"""The cases of ``tools/verify.py``, one file each with ``run(ask)``, which yields figures.

Each case has a closed form. A figure is an error against it, and reaches one of three levels, whose
limits stand in the file of the case next to their reason.
"""

"""The cases of ``tools/verify.py``, one file each with ``run(ask)``, which yields figures.

Most have a closed form: a figure is an error against it and reaches one of three levels, whose
limits stand in the file of the case next to their reason. Others are held to a target.
"""

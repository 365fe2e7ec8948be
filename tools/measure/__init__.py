"""What every tool shares: one figure, one way to run cases, one report.

``figure`` is a measured value with what is wanted of it, ``run`` runs named cases and prints their
figures as they come, ``report`` is the table on the screen and the file of figures, ``machine`` is
where and when they were measured.
"""

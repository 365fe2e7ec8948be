"""What ``tools/stability.py`` runs: scenes that try to break the simulator, and what judges them.

Each of ``shapes``, ``loads``, ``limits``, ``degenerate`` and ``figures`` has families of cases,
``sweeps`` has the cells of the maps. ``watch`` runs them, ``outcome`` says what became of them.
"""

"""What ``tools/stability.py`` runs: scenes that try to break the simulator, and what judges them.

Each of ``shapes``, ``loads``, ``limits``, ``degenerate`` and ``figures`` has families of cases,
``sweeps`` the cells of the maps, ``parts`` the cases of ``tools/ablation.py``. ``watch`` runs them,
``outcome`` says what became of them.
"""

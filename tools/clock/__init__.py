"""Where the time and the memory of a step go; see ``tools/bench.py`` and ``tools/economy.py``."""

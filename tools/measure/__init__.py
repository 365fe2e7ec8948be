"""What every tool shares: figures, runs of named cases, their report, the machine."""

"""Cases and the parts they need, of ``tools/ablation.py``."""

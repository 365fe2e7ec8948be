"""Cases and the parts they need, of ``tools/ablation.py``; a case returns figures by name.

Each figure is an error or a time, so that less is better.
"""

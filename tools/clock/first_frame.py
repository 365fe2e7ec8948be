"""Import the package and step one frame of a small scene; print the times of both [s]."""

import argparse
from time import perf_counter

start = perf_counter()
import warp_contact as wc  # noqa: E402

imported = perf_counter() - start

from warp_contact.scenes import squeezed_sphere  # noqa: E402

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--device")
wc.Simulation(squeezed_sphere.build(), device=parser.parse_args().device).step_frame()
print(imported, perf_counter() - start - imported)

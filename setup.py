"""Names the packages: kernels/ and scenes/ stand at the root and install inside warp_contact."""

from setuptools import find_packages, setup

INSIDE = "kernels", "scenes"

packages = set(find_packages(include=["warp_contact", "warp_contact.*"]))
for room in INSIDE:
    packages |= {f"warp_contact.{name}" for name in find_packages(include=[room, f"{room}.*"])}

setup(packages=sorted(packages), package_dir={f"warp_contact.{room}": room for room in INSIDE})

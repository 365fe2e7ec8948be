"""Scripts to start from, one file each: ``python -m warp_contact.scenes.examples.gripper``."""

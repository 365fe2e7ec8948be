"""The scenes of the paper, one file each: constants with units and ``build()``."""

if __name__ != "warp_contact.scenes":
    raise ImportError("import this package as warp_contact.scenes")

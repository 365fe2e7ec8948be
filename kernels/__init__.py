"""Device code: Warp functions and kernels, one family of formulas in a file."""

if __name__ != "warp_contact.kernels":
    raise ImportError("import this package as warp_contact.kernels")

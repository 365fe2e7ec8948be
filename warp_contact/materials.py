"""Constitutive models: what the user names, and the parameters the kernels read.

A model is one kernel file (``warp_contact/kernels/<model>.py``) and one class here with

* ``kernels``: that file; it provides ``add_forces``, ``apply_stiffness``, ``apply_damping``, ``energies``;
* ``density`` [kg/m^3] and ``damping`` [s];
* ``parameters(vertices, tets)``: one row per tet, in the order in which the kernels read it;
* ``check()``: raises ValueError with a reason.
"""

"""How kernels are compiled. The flags are for the CPU; a GPU ignores them.

On a CPU, a product and a sum are contracted into one rounding, as on a GPU, and vectors are no
wider than a ``vec4``. By Warp's default the compiler looks for vectors four operations deep, which
compiles fast. The formulas of a tet are deeper, and there a deeper search pays.
"""

_FLAGS = (
    "-march=native -ffp-contract=fast -mprefer-vector-width=128 -mllvm=-inline-threshold=9000"
    " -mllvm=-inline-cold-callsite-threshold=3000 -mllvm=-slp-recursion-max-depth="
)
OPTIONS = {"enable_backward": False, "cpu_compiler_flags": f"{_FLAGS}4"}
ARITHMETIC = {
    "enable_backward": False,
    "cpu_compiler_flags": f"{_FLAGS}30",
    "optimization_level": 3,
}

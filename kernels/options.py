"""How kernels are compiled; a GPU takes no notice of the flags.

On a CPU, products and sums are contracted into one rounding, as they are on a GPU, and vectors are
no wider than a ``vec4``. Warp lets the compiler look for vectors four operations deep, which is
quick to compile. The formulas of a tet are deeper: there it pays to look further.
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

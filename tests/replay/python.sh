# SPDX-License-Identifier: Apache-2.0
# The Python package as users and attackers called it. Its other rows are python/tests/test_package_errors.py and
# test_package_notebooks.py.

# in_python CODE: runs code with the package of the build tree. The row is skipped where that has none.
in_python() {
    [[ -e $build/python/ewa/__init__.py ]] || skip "the build has no Python package"
    local interpreter
    interpreter=$(sed -n 's/^Python_EXECUTABLE:[A-Z]*=//p' "$build/CMakeCache.txt")
    PYTHONPATH=$build/python "${interpreter:-python3}" -c "$1"
}

row_without_torch_the_hint_names_a_project_that_exists() {
    run 1 in_python "import sys; sys.modules['torch'] = None; import ewa.gsplat"
    says "pip install torch"
    silent_about "ewa-splatting["
}

row_a_mistyped_argument_gets_one_line_with_a_suggestion() {
    run 1 in_python "import ewa; ewa.Dataset('x', downscal=2)"
    says "TypeError: Dataset has no argument downscal; did you mean downscale?"
    silent_about "Invoked with types"
}

row_save_makes_its_folder() {
    cp "$SPLATS" a.ply
    run 0 in_python "import ewa; ewa.save('new/folder/b.ply', ewa.load('a.ply'))"
    exists new/folder/b.ply
}

row_errors_of_training_name_arguments() {
    run 1 in_python "import ewa; ewa.Trainer(ewa.Dataset('$DATASET'), bands=2, appearance='affine')"
    says "bands= and appearance= exclude each other"
    silent_about "--bands"
}

row_a_comment_that_no_reader_takes_is_not_written() {
    cp "$SPLATS" a.ply
    run 1 in_python "import ewa; ewa.save('x.ply', ewa.load('a.ply'), comments=['a' * 100000])"
    says "fit in the file"
    missing x.ply
}

row_a_list_of_a_large_tile_takes_the_memory_of_what_it_draws() {
    run 0 in_python "
import resource
import numpy as np
import ewa
from ewa._native import operators
resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
n, side = 50_000, 1024
f = np.float32
means = np.random.default_rng(1).uniform(0, side, (n, 2)).astype(f)
conics = np.tile(f([1, 0, 1]), (n, 1))
splats = operators.Footprints(means2d=means, conics=conics, opacities=np.full(n, 0.5, f), features=np.ones((n, 1), f))
lists = [(np.int32([0, n]), np.arange(n, dtype=np.int32))]
image = operators.Blending(splats, [(0, n)], side, side, side, lists=lists).blend(False)[0]
assert image.max() > 0.4
"
}

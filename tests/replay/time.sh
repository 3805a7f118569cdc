# SPDX-License-Identifier: Apache-2.0
# Ranks that agree before they begin, progress, the time of a run, and what a machine lacks.

on_two_nodes() {
    OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 run "$1" mpirun -q --oversubscribe --bind-to none "${@:2}"
}

needs_mpi() {
    command -v mpirun > /dev/null && [[ -e $build/modules/libewa_mpi.so ]] || skip "there is no MPI"
}

row_ranks_that_begin_with_other_splats_are_refused() {
    needs_mpi
    mkdir n0 n1
    cp "$SPLATS" n0/start.ply
    ewa convert "$SPLATS" n1/start.ply --transform move=0.1,0,0 > /dev/null
    on_two_nodes 2 -n 1 --wdir n0 ewa train "$DATASET" -o "$PWD/o" --steps 4 --batch 2 --init start.ply : \
        -n 1 --wdir n1 ewa train "$DATASET" -o "$PWD/o" --steps 4 --batch 2 --init start.ply
    says "other first splats"
    missing o/splats.ply
}

row_ranks_with_other_options_are_refused() {
    needs_mpi
    on_two_nodes 2 -n 1 ewa train "$DATASET" -o o --batch 2 --steps 4 : -n 1 ewa train "$DATASET" -o o --batch 2 --steps 6
    says "--steps is 6 on rank 1"
    says "4 on rank 0"
    missing o/splats.ply
}

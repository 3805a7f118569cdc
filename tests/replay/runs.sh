# SPDX-License-Identifier: Apache-2.0
# Training runs and their folders.

short() { ewa train "$DATASET" --quiet "$@"; }

row_a_runs_folder_with_resume_means_that_run() {
    run 0 short -o out/dataset --steps 3
    run 0 short -o out/ic --steps 4 --downscale 2
    cp -r out/dataset before
    run 0 ewa train out/ic --resume --steps 6 --quiet
    grep -q '"steps": 6' out/ic/summary.json || fail "out/ic was not continued"
    grep -q '"downscale": 2' out/ic/config.json || fail "the run's options were lost"
    diff -r before out/dataset > /dev/null || fail "another run was touched"
    (cd out && run 0 ewa train ic --resume --steps 7 --quiet) || exit 1
    missing out/out
    run 2 ewa train out/ic --resume -o out/dataset
    one_line
    says "out/ic is a run"
}

row_resume_takes_the_options_of_the_run() {
    run 0 short -o out/run --steps 4 --downscale 2
    run 0 ewa train --resume -o out/run --steps 5 --quiet
    run 0 short -o out/run --resume --steps 6
    run 2 short -o out/run --resume --downscale 1
    one_line
    says "was written with --downscale 2, not 1; with its own value the run continues"
}

row_outputs_never_land_among_photos() {
    cp -r "$DATASET" fox
    find fox | sort > before
    run 2 ewa render "$SPLATS" --cameras fox -o fox/images
    one_line
    run 2 ewa render "$SPLATS" --orbit 2 --size 16x16 -o fox/images
    run 2 ewa train fox -o fox/images
    run 2 ewa train fox -o fox
    one_line
    says "name another folder"
    find fox | sort > after
    same before after
}

row_a_full_disk_costs_no_training() {
    local faults=$build/tests/libewa_faults.so size
    [[ -e $faults ]] || skip "the tests are not built"
    run 0 short -o whole --steps 30 --strategy none --save-every 10
    size=$(stat -c %s whole/checkpoint.ewa)
    LD_PRELOAD=$faults EWA_FAULT_BYTES=$((size + size / 2)) run 1 short -o run --steps 30 --strategy none --save-every 10
    one_line
    says "free some space, then --resume"
    run 0 ewa train run --resume --quiet
    same run/splats.ply whole/splats.ply
    LD_PRELOAD=$faults EWA_FAULT_ROOM=1000 run 1 short -o small --steps 3
    one_line
    says "free some space"
}

row_metrics_are_not_written_through_a_link() {
    echo "dear diary" > diary.txt
    cp diary.txt before
    mkdir r
    ln -s ../diary.txt r/metrics.jsonl
    run 0 short -o r --steps 3
    same diary.txt before
}

row_a_config_holds_no_output_force_or_serve() {
    local line
    for line in '"output": "x"' '"force": true' '"serve": "0.0.0.0:0"'; do
        echo "{\"dataset\": \"$DATASET\", \"steps\": 1, $line}" > evil.json
        run 2 ewa train --config evil.json
        one_line
        says "belongs on the command line"
    done
    missing x out
}

row_limits_of_the_shell_are_named() {
    run 1 bash -c "ulimit -f 2; exec ewa convert '$SPLATS' o.ply"
    one_line
    says "File too large"
    [[ -z $(ls -A .ewa-* 2> /dev/null) ]] || fail "a temporary file is left"
    run 1 bash -c "ulimit -v 650000; exec ewa train '$DATASET' -o v --steps 1"
    one_line
    says "MiB of address space"
}

row_a_tilde_in_quotes_is_the_home_folder() {
    HOME=$PWD/home run 0 short -o '~/x' --steps 1
    exists home/x/splats.ply
    missing '~'
}

row_keep_and_inria_write_what_peers_write() {
    run 0 short -o r --steps 6 --save-every 2 --keep 2 --inria
    exists r/splats_000004.ply r/splats_000006.ply r/inria/cfg_args r/inria/cameras.json r/inria/input.ply
    missing r/splats_000002.ply
    same r/inria/point_cloud/iteration_6/point_cloud.ply r/splats.ply
}

# SPDX-License-Identifier: Apache-2.0
# Progress, the time of a run, and what a machine lacks.

# Prints what a terminal of so many columns gets from the command.
on_terminal() {
    command -v script > /dev/null || skip "there is no script(1)"
    SHELL=/bin/bash script -qec "stty cols $1; $2" /dev/null < /dev/null > screen || fail "$2: status $?"
}

row_a_terminal_gets_a_bar_with_the_time_left() {
    LC_ALL=C on_terminal 100 "ewa train $DATASET -o o --steps 30"
    grep -q '#----.* left  trained ' screen || fail "no bar: $(tail -c 300 screen)"
    LC_ALL=C.UTF-8 on_terminal 100 "ewa render $SPLATS --orbit 8 -o views --size 32x32"
    grep -q '━━━.*100 %  rendered 8/8 views' screen || fail "no bar: $(tail -c 300 screen)"
    LC_ALL=C on_terminal 100 "ewa eval $RUN"
    grep -q '%.*evaluated' screen || fail "no bar: $(tail -c 300 screen)"
}

row_a_file_gets_plain_lines() {
    run 0 ewa train "$DATASET" -o o --steps 30
    says "trained 15/30 steps, loss"
    silent_about "####"
    LC_ALL=C TERM=dumb on_terminal 100 "ewa train $DATASET -o p --steps 30"
    grep -q 'trained 15/30 steps' screen || fail "no lines"
    ! grep -q '####' screen || fail "a bar on a dumb terminal"
}

row_doctor_tells_what_works_and_how_to_get_the_rest() {
    run 0 ewa doctor
    says "yes  training"
    mkdir empty
    PATH=$build:$PWD/empty run 0 "$build/ewa" doctor
    says "there is neither the program colmap nor"
    VK_ICD_FILENAMES=/dev/null VK_DRIVER_FILES=/dev/null run 1 ewa doctor
    says "no   training"
    says "ewa cannot train on this machine"
}

row_a_long_run_says_early_how_long_it_takes() {
    ewa train "$DATASET" -o o --steps 1M > lines 2>&1 &
    local trainer=$! try status=0
    local line='the training takes about .* on this device, with --quality low about '
    for ((try = 0; try < 600; ++try)); do
        if grep -q "$line" lines || ! kill -0 $trainer; then break; fi
        sleep 0.1
    done
    kill -TERM $trainer
    wait $trainer || status=$?
    [[ $status == 130 ]] || fail "ended with $status"
    grep -q "$line" lines || fail "no time in: $(cat lines)"
}

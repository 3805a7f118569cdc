# SPDX-License-Identifier: Apache-2.0
# What every command owes its user.

row_a_missing_dataset_is_named_in_one_line() {
    run 2 ewa train nothere
    one_line
    says nothere
}

row_a_full_disk_is_named_by_info_and_help() {
    local command
    for command in "ewa --help" "ewa train --help" "ewa info $SPLATS"; do
        local status=0
        $command > /dev/full 2> err || status=$?
        [[ $status == 1 && $(wc -l < err) == 1 ]] || fail "$command > /dev/full ended with $status"
    done
}

row_no_command_writes_over_its_input() {
    cp "$SPLATS" a.ply
    cp a.ply before.ply
    run 2 ewa convert a.ply a.ply
    one_line
    same a.ply before.ply
}

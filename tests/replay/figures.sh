# SPDX-License-Identifier: Apache-2.0
# Figures for published tables.

row_eval_prints_a_table_of_all_metrics() {
    run 0 ewa eval "$RUN" --metrics all --json all.json
    says cc2_ssim
    says psnr_16px
    grep -q '"ms_ssim": null' all.json || fail "MS-SSIM of an image of 64x48"
}

row_eval_without_metrics_is_as_before() {
    run 0 ewa eval "$RUN" --json plain.json
    silent_about flip
    ! grep -qE 'flip|protocol' plain.json || fail "unasked figures"
}

row_a_misspelt_metric_is_named_in_one_line() {
    run 2 ewa eval "$RUN" --metrics cc_pnsr
    one_line
    says "did you mean cc_psnr?"
}

row_figures_by_two_protocols() {
    local protocol
    for protocol in nerfbaselines inria; do
        run 0 ewa eval "$RUN" --protocol "$protocol" --json "$protocol.json"
        grep -q "\"protocol\": \"$protocol\"" "$protocol.json" || fail "the protocol is not named"
    done
}

row_curves_for_tensorboard() {
    run 0 ewa train "$DATASET" -o run --steps 20 --eval-every 10 --metrics flip --tensorboard --quiet
    exists run/events.out.tfevents.0.ewa
    grep -q '"test_flip":0' run/metrics.jsonl || fail "no curve of FLIP"
}

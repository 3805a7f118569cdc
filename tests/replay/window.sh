# SPDX-License-Identifier: Apache-2.0
# The window, and what one sends to others.

row_photos_need_the_window_or_ewa_cameras() {
    cp -r "$DATASET/images" photos
    run 2 ewa-view photos --screenshot shown.png
    one_line
    says "ewa cameras finds them"
    missing shown.png out
}

row_wrong_options_of_a_training_on_photos_are_found_before_colmap() {
    cp -r "$DATASET/images" photos
    run 2 ewa-view --train photos --step 3
    says "did you mean --steps?"
    missing out
}

row_every_file_to_send_is_written_and_read() {
    local file
    for file in scene.sog scene.spz scene.compressed.ply scene.splat scene.glb; do
        run 0 ewa convert "$RUN" "$file"
        run 0 ewa info "$file"
    done
    run 0 ewa convert "$RUN" small.spz --max-sh 0
}

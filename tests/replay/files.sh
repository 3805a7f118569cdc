# SPDX-License-Identifier: Apache-2.0
# Splat files, and the commands around them.

# The number of splats of a file.
splats_of() { ewa info "$1" --json | sed -n 's/^  "splats": \([0-9]*\),*$/\1/p'; }
holds() { [[ $(splats_of "$1") == "$2" ]] || fail "$1 has $(splats_of "$1") splats, not $2"; }

# a.ply with all splats, b.ply with some of them.
two_scenes() {
    cp "$SPLATS" a.ply
    run 0 ewa convert a.ply b.ply --where opacity=0.11.. --quiet
    all=$(splats_of a.ply) some=$(splats_of b.ply)
    ((some > 0 && some < all)) || fail "b.ply has $some of $all splats"
}

row_a_gltf_written_again_spares_the_gltf_of_a_like_name() {
    two_scenes
    run 0 ewa convert a.ply x.gltf
    run 0 ewa convert b.ply x-2.gltf
    run 0 ewa convert b.ply x-3.gltf
    run 0 ewa convert a.ply x.gltf
    run 0 ewa convert a.ply x.gltf
    holds x.gltf "$all"
    holds x-2.gltf "$some"
    holds x-3.gltf "$some"
}

row_a_gltf_written_again_spares_an_input_that_is_named_like_its_values() {
    two_scenes
    run 0 ewa convert a.ply x.gltf
    cp b.ply x-2.bin
    run 0 ewa convert x-2.bin x.gltf
    same b.ply x-2.bin
    holds x.gltf "$some"
}

row_a_gltf_written_again_spares_the_values_of_its_input() {
    two_scenes
    run 0 ewa convert a.ply x.gltf
    run 0 ewa convert b.ply x-2.gltf
    run 0 ewa convert x-2.gltf x.gltf
    holds x-2.gltf "$some"
    holds x.gltf "$some"
}

row_a_gltf_with_other_values_keeps_the_files_of_others() {
    two_scenes
    run 0 ewa convert b.ply x.gltf
    mv x.bin notes.txt
    sed -i 's/x\.bin/notes.txt/' x.gltf
    echo "somebody's" > x-2.bin
    run 0 ewa convert a.ply x.gltf
    exists notes.txt
    [[ $(< x-2.bin) == "somebody's" ]] || fail "x-2.bin was written"
    holds x.gltf "$all"
}

row_an_unpacked_sog_written_again_spares_the_images_of_others() {
    two_scenes
    run 0 ewa convert b.ply meta.json
    echo "somebody's" | tee means_l-2.webp > sh0-3.webp
    run 0 ewa convert a.ply meta.json
    run 0 ewa convert a.ply meta.json
    for name in means_l-2.webp sh0-3.webp; do
        [[ $(< $name) == "somebody's" ]] || fail "$name was touched"
    done
    holds meta.json "$all"
}

row_values_that_a_kill_left_are_no_obstacle() {
    two_scenes
    echo left > x.bin
    echo left > quats.webp
    run 0 ewa convert a.ply x.gltf
    run 0 ewa convert a.ply meta.json
    holds x.gltf "$all"
    holds meta.json "$all"
    [[ $(< x.bin) == left && $(< quats.webp) == left ]] || fail "a file that nobody named was touched"
}

row_an_orbit_and_saved_views_replace_no_input() {
    mkdir d
    cp "$SPLATS" d/00000.png
    run 2 ewa render d/00000.png --orbit 2 --size 16x16 -o d
    one_line
    same "$SPLATS" d/00000.png
    rm d/00000.png
    mkfifo d/00001.png
    run 1 ewa render "$SPLATS" --orbit 2 --size 16x16 -o d
    one_line
    missing d/00000.png
    run 2 ewa render "$SPLATS" -o "$SPLATS"
    says "is no folder"
}

row_photographs_get_no_renders_among_them() {
    run 2 ewa render "$SPLATS" --cameras "$DATASET" -o "$DATASET/images"
    says "is a folder of a dataset"
    run 2 ewa render "$RUN" --orbit 2 -o "$DATASET/images"
    one_line
    [[ -z $(find "$DATASET/images" -newer "$SPLATS") ]] || fail "a file appeared among the images"
}

row_one_frame_of_a_run_is_one_image() {
    run 0 ewa render "$RUN" -o x.png --frames 0
    exists x.png
    run 2 ewa render "$RUN" -o x.png --frames 0,1
    says "choose one with --frames"
}

row_the_mark_of_antialiasing_survives_every_format_that_has_one() {
    run 0 ewa train "$DATASET" -o run --steps 2 --kernel antialias --quiet
    for name in m.ply m.compressed.ply m.spz m.sog meta.json; do
        run 0 ewa convert run $name --quiet
        run 0 ewa info $name
        says "anti-aliased    yes"
    done
    run 0 ewa convert run m.glb
    says "anti-aliased is dropped"
    run 0 ewa eval m.ply "$DATASET" --split all
    grep -o 'PSNR.*dB' ../out > marked
    run 0 ewa eval m.ply "$DATASET" --split all --kernel antialias
    grep -o 'PSNR.*dB' ../out > given
    same marked given
}

row_convert_takes_its_output_as_other_commands_do() {
    run 0 ewa convert "$SPLATS" -o b.ply
    exists b.ply
    run 2 ewa render "$SPLATS" pic.png
    says "-o pic.png names the output"
    run 2 ewa convert "$SPLATS" x.obj
    one_line
    silent_about .ksplat
    run 0 ewa convert "$RUN" x.html
    exists x.html
}

row_help_and_version_as_people_type_them() {
    run 0 ewa help train
    says "--serve [ADDRESS:]PORT"
    run 0 ewa version
    run 0 ewa -v
    run 2 ewa view x
    says "ewa-view x"
    EWA_DEVICE=nothere run 2 ewa render "$SPLATS" -o x.png
    says "matches 'nothere'"
    run 2 ewa render "$SPLATS" -o x.png --size 16384x16384
    silent_about --downscale
}

row_an_image_is_told_with_its_size() {
    cp "$DATASET"/images/0*0.png photo.jpg 2> /dev/null || cp "$(find "$DATASET/images" -name '*.png' | sort | head -n 1)" photo.jpg
    run 0 ewa info photo.jpg
    says "image (png)"
    says 64x48
}

row_one_heic_photo_is_one() {
    mkdir photos
    printf '\0\0\0\x18ftypheic' > photos/a.heic
    mkdir bare # without a program that converts it, and away from the module of OpenImageIO, which may read it
    cp "$bin/ewa" bare/alone
    PATH=$PWD/bare run 2 bare/alone train photos
    says "1 photo is HEIC"
}

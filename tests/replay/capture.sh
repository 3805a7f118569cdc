# SPDX-License-Identifier: Apache-2.0
# From photos to a dataset, with a program in the place of COLMAP.

# Puts a colmap before the others that notes its calls, and fails.
a_colmap() {
    mkdir -p bin
    cat > bin/colmap <<'SCRIPT'
#!/bin/sh
case "$*" in *--help*) echo "  --SiftExtraction.use_gpu arg (=1)"; exit 0;; esac
echo "$1" >> colmap.calls
for word; do
    [ "$previous" = --database_path ] && touch "$word"
    previous=$word
done
exit 1
SCRIPT
    chmod +x bin/colmap
    PATH=$PWD/bin:$PATH
}

# Photos that are good, with the names a.png to d.png.
some_photos() {
    mkdir -p photos
    local name
    for name in a b c d; do cp "$(find "$DATASET/images" -name '*.png' -o -name '*.jpg' | head -n 1)" "photos/$name.png"; done
}

row_N2_damaged_photos_are_named_before_colmap_starts() {
    a_colmap
    some_photos
    head -c 100 photos/a.png > photos/cut.png
    : > photos/empty.jpg
    run 1 ewa cameras photos -o made
    says "2 photos cannot be used: cut.png ("
    says "empty.jpg ("
    grep -q cut made/colmap/photos.txt && fail "COLMAP got the damaged photo"
    return 0
}

row_N4_options_are_checked_before_colmap_starts() {
    a_colmap
    some_photos
    local options
    for options in "--device nvidia" "--serve 99999" "--init nothere.ply" "--downscale 1000" "--test-every 1" \
        "--frames 5" "--frames 0-3"; do
        # shellcheck disable=SC2086
        run 2 ewa train photos -o out $options
        one_line
    done
    run 2 ewa cameras photos -o out --frames 5
    missing out colmap.calls
}

row_N5_links_to_photos_are_refused_at_once() {
    a_colmap
    some_photos
    cp -rs "$PWD/photos" links
    run 2 ewa cameras links -o made
    one_line
    says "cp -rL"
    missing made colmap.calls
}

row_N6_a_folder_of_a_dataset_is_recognised() {
    a_colmap
    run 2 ewa train "$DATASET/images" -o out
    one_line
    says "has the cameras of"
    run 2 ewa cameras "$DATASET" -o out
    one_line
    says "is a dataset: its images have cameras"
    missing out colmap.calls
}

row_N7_renders_of_a_run_are_no_photos() {
    a_colmap
    some_photos
    cp -r "$RUN" photos/out
    run 1 ewa cameras photos -o made
    grep -q out/ made/colmap/photos.txt && fail "renders count as photos"
    return 0
}

row_attack_names_and_folders_mislead_nobody() {
    a_colmap
    some_photos
    mkdir $'photos/a\n..'
    cp photos/a.png $'photos/a\n../secret.png'
    cp photos/a.png $'photos/\xff.png'
    run 1 ewa cameras photos -o made
    says "its name has a line break"
    grep -q secret made/colmap/photos.txt && fail "COLMAP got a name with a line break"
    run 1 ewa cameras photos -o made
    silent_about changed
    silent_about "is new"
}

row_attack_a_playlist_is_no_video() {
    command -v ffmpeg > /dev/null || skip "no ffmpeg"
    a_colmap
    ffmpeg -v error -f lavfi -i testsrc=size=64x48:rate=5 -t 2 -c:v mpeg4 "50%: private.mp4"
    printf '#EXTM3U\n#EXT-X-TARGETDURATION:2\n#EXTINF:2,\nfile://%s\n#EXT-X-ENDLIST\n' "$PWD/50%: private.mp4" > list.mp4
    run 2 ewa cameras list.mp4 -o made
    one_line
    says "ffmpeg cannot read the video"
    run 1 ewa cameras "50%: private.mp4" -o "a:b%d" --frames 3
    exists "a:b%d/images/frame_00003.jpg"
    run 1 ewa cameras "50%: private.mp4" --output=-y --frames 3
    exists ./-y/images/frame_00003.jpg
}

row_archives_of_datasets_are_trained_and_listed() {
    (cd "$DATASET/.." && python3 -m zipfile -c "$OLDPWD/scene.zip" "$(basename "$DATASET")")
    run 0 ewa info scene.zip
    says "frames          8"
    run 0 ewa train scene.zip -o out --steps 2 --max-width 40
    run 0 ewa eval out
    python3 -c "import zipfile; zipfile.ZipFile('evil.zip', 'w').writestr('../evil.png', b'x')"
    run 2 ewa train evil.zip -o evil
    one_line
    says "leads out of the folder"
    missing evil ../evil.png evil.png
}

#!/bin/sh
# Instructions per pixel with each feature absent and present, counted by valgrind's callgrind.
#
#     benches/instructions.sh            builds what it needs, prints the table of docs/BENCHMARKS.md
#
# What is counted is `render_into` on one thread: rays, hits, shading and film, without start-up, loading and building. The
# first two rows render a scene without any feature twice: with the program as it is, and with a build of it
# (`--features bare`) out of which the features are compiled. What they differ by is what all features together cost a
# scene that lacks them; it must stay below 0.5 %.
# Counts are of instructions, not of time: they do not depend on what else the machine does.
set -eu

COUNTED='flatray::render::render_into'
SIZE_PX=144
LIMIT_PERCENT=0.5

if ! command -v valgrind >/dev/null; then
    echo "SKIPPED: instructions are counted by valgrind, which is not installed" >&2
    exit 0
fi

root=$(cd "$(dirname "$0")/.." && pwd)
target=${CARGO_TARGET_DIR:-$root/target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The same dependencies serve both builds; only the program's own crate is compiled twice.
for build in bare full; do
    features=$([ $build = bare ] && echo "--features bare" || true)
    # shellcheck disable=SC2086 # No features are no argument.
    (cd "$root" && cargo build --release --quiet --bin flatray $features)
    cp "$target/release/flatray" "$work/$build"
done

# A goblet of flat, matte facets on a floor of two triangles, one light. $1 says whether its normals are interpolated, $2 is
# what the scene has besides, $3 the specular weight.
scene() {
    cat <<TOML
[camera]
position = [0, 2.2, 6.5]
look_at = [0, 0.85, 0]
fov = 36
width = 320
height = 240

[render]
background = [0.25, 0.3, 0.36]

[[hittable]]
type = "mesh"
file_path = "$root/scenes/goblet.obj"
phong_interpolation = $1
diffuse = [0.5, 0.6, 0.65]
k_a = 0.15
k_d = 0.6
k_s = $3
sh = 1

[[hittable]]
type = "mesh"
vertices = [[-9, 0, -9], [9, 0, -9], [9, 0, 9], [-9, 0, 9]]
faces = [[0, 2, 1], [0, 3, 2]]
phong_interpolation = false
diffuse = [0.55, 0.5, 0.5]
k_s = $3

[[light_source]]
position = [-3, 5, 5]
intensity = 0.9
$2
TOML
}

sphere='[[hittable]]
type = "sphere"
position = [1.6, 0.6, 0.5]
radius = 0.6'
bounded='[[hittable]]
type = "quadric"
A = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, -0.36]]
position = [1.6, 0.6, 0.5]'
light='[[light_source]]
position = [4, 5, 3]
intensity = 0.4'

scene false "" 0 >"$work/none.toml"
scene true "" 0 >"$work/smooth.toml"
scene false "$sphere" 0 >"$work/sphere.toml"
scene false "[[hittable]]
type = \"quadric\"
A = [[1, 0, 0, -1.6], [0, 1, 0, -0.6], [0, 0, 1, -0.5], [-1.6, -0.6, -0.5, 2.81]]" 0 >"$work/quadric.toml"
scene false "[[hittable]]
type = \"quadric\"
A = [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0.5], [0, 0, 0.5, 3]]" 0 >"$work/plane.toml"
scene false "" 0.3 >"$work/mirror.toml"
scene false "$light" 0 >"$work/light.toml"
scene false "" 0 | sed '/light_source/,$d' >"$work/dark.toml"

# Instructions per pixel of a build, a scene and a number of samples; the image stays beside the scene.
per_pixel() {
    count=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect="$COUNTED" "$work/$1" render \
        "$work/$2.toml" --width $SIZE_PX --height $SIZE_PX --samples "$3" --max-depth 5 --threads 1 --quiet \
        --output "$work/$1-$2-$3.pfm" 2>&1 | sed -n 's/^.*Collected *: *//p')
    if [ "${count:-0}" -eq 0 ]; then
        echo "nothing was counted: the program has no function $COUNTED" >&2
        exit 1
    fi
    echo "$count" | awk -v n=$SIZE_PX '{ printf "%.0f", $1 / (n * n) }'
}

echo "| scene | instructions per pixel | over none |"
echo "|---|---|---|"
none=$(per_pixel full none 1)
row() {
    awk -v what="$1" -v n="$2" -v none="$none" 'BEGIN { printf "| %s | %d | %+.2f %% |\n", what, n, 100 * (n - none) / none }'
}
bare=$(per_pixel bare none 1)
row "no feature, all compiled out" "$bare"
row "no feature" "$none"
row "no light" "$(per_pixel full dark 1)"
row "a second light" "$(per_pixel full light 1)"
row "smooth normals" "$(per_pixel full smooth 1)"
row "reflection, 0.3, depth 5" "$(per_pixel full mirror 1)"
row "a sphere" "$(per_pixel full sphere 1)"
row "a bounded quadric" "$(per_pixel full quadric 1)"
row "an unbounded quadric" "$(per_pixel full plane 1)"
row "4 samples" "$(per_pixel full none 4)"

# What layers cost, files and all: instructions per pixel of a render that encodes an EXR.
with_layers() {
    # shellcheck disable=SC2086 # No layers are no argument.
    count=$(valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect="$COUNTED" "$work/full" render \
        "$work/none.toml" --width $SIZE_PX --height $SIZE_PX --samples 4 --max-depth 5 --threads 1 --quiet \
        --output "$work/layers.exr" ${1:+--aov $1} 2>&1 | sed -n 's/^.*Collected *: *//p')
    echo "$count" | awk -v n=$SIZE_PX '{ printf "%.0f", $1 / (n * n) }'
}

echo
echo "| layers, 4 samples | instructions per pixel | over none |"
echo "|---|---|---|"
none_layers=$(with_layers "")
none_before=$none
none=$none_layers
row "the picture alone" "$none_layers"
for layers in ambient diffuse specular reflection lobes lights albedo Z P N Ng uv object material samples CryptoObject \
    CryptoMaterial all; do
    row "\`$layers\`" "$(with_layers $layers)"
done
none=$none_before

cmp "$work/bare-none-1.pfm" "$work/full-none-1.pfm"
echo "$bare $none" | awk -v limit=$LIMIT_PERCENT '{
    cost = 100 * ($2 - $1) / $1
    printf "\nWhat is absent costs %.2f %% of the instructions (limit %.1f %%).\n", cost, limit
    exit cost >= limit
}'

#!/usr/bin/env bash
# Times the whole program on the demonstration clip, with other programs beside it in the same run, and prints
# Markdown: `scripts/bench.sh > docs/benchmarks/DATE.md`. Nothing is judged; a busy machine gives busy figures, and the
# load is printed with them.
#
#   --all             also run the benchmarks of benches/, as `make bench` does before it calls this
#   UNDERSTUDY_PEERS  a Python with scripts/requirements-peers.txt; made below the target folder where it is not set
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="$PATH:$HOME/.cargo/bin" CARGO_TERM_COLOR=never CARGO_TERM_PROGRESS_WHEN=never
target=${CARGO_TARGET_DIR:-target}
assets=${UNDERSTUDY_ASSETS:-${XDG_DATA_HOME:-$HOME/.local/share}/understudy}
clip=$assets/clips/cap13_edit2.mp4
scan=$assets/scans/james.obj
rounds=3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

load() { cut -d' ' -f1-3 /proc/loadavg; }

# measure COMMAND...: wall seconds, processor seconds and peak memory in MiB of one run, which keeps its output.
measure() {
    python3 - "$@" <<'PYTHON'
import resource, subprocess, sys, time

start = time.perf_counter()
done = subprocess.run(sys.argv[1:], stdin=subprocess.DEVNULL)
wall = time.perf_counter() - start
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(f"{wall:.2f} {used.ru_utime + used.ru_stime:.2f} {used.ru_maxrss / 1024:.0f}", file=sys.stderr)
sys.exit(done.returncode)
PYTHON
}

# take NAME ARGUMENTS...: a row of the table for each round of `understudy ARGUMENTS`.
take() {
    local name=$1 wall processor memory
    shift
    for ((round = 1; round <= rounds; round++)); do
        rm -f "$work"/out.*
        measure "$program" "$@" >"$work/timings" 2>"$work/usage"
        read -r wall processor memory < <(tail -n 1 "$work/usage")
        printf '| %s | %s | %s | %s | %s | %s |\n' "$name" "$wall" \
            "$(python3 -c "print(round($frames / $wall))")" "$processor" "$memory" "$(load)"
    done
}

cargo build --release --quiet
cargo build --release --quiet --example follow
program=$target/release/understudy
# The first run with a scan keeps what it made of it for the others, as a user's does.
export UNDERSTUDY_CACHE=$work/cache
frames=$(ffprobe -v error -select_streams v:0 -count_frames -show_entries stream=nb_read_frames -of csv=p=0 "$clip" |
    tr -dc 0-9)
commit=$(git rev-parse --short HEAD)
[ -z "$(git status --porcelain --untracked-files=no)" ] || commit+=" with changes"

cat <<EOF
# Benchmarks, $(date -u +%Y-%m-%d)

$(date -u '+%H:%M UTC'), commit $commit, $(lscpu | sed -n 's/^Model name: *//p' | head -n 1), $(nproc) processors, load $(load). The clip is cap13_edit2.mp4, 400 × 300, $frames frames; the scan is james.obj.

## The whole program

The frame rate is the clip's frames over the wall time of the command, start-up and scan included.

| output | wall s | frames/s | processor s | peak MiB | load after |
|---|---:|---:|---:|---:|---|
EOF
animate=(animate "$clip" --target "$scan" --quiet --timings)
take "motion: .pc2, .csv" "${animate[@]}" -o "$work/out.pc2" -o "$work/out.csv"
cp "$work/timings" "$work/motion"
take "film: .mp4, 1280 × 720" "${animate[@]}" -o "$work/out.mp4" --size 1280x720
cp "$work/timings" "$work/film"
printf '\nWhere the last of each spent its time. Motion:\n\n'
cat "$work/motion"
printf '\nFilm:\n\n'
cat "$work/film"

ffmpeg -v error -y -i "$clip" -frames:v 1 "$work/first.png" </dev/null
cat <<EOF

## From the start to the first frame

A clip of one frame, so these are upper bounds: the frame is also solved and written.

| command | wall s, each run |
|---|---|
EOF
# start NAME ARGUMENTS...: the wall times of `understudy ARGUMENTS`.
start() {
    local name=$1 walls=()
    shift
    for ((round = 1; round <= rounds; round++)); do
        rm -f "$work"/out.*
        measure "$program" "$@" --quiet >/dev/null 2>"$work/usage"
        walls+=("$(tail -n 1 "$work/usage" | cut -d' ' -f1)")
    done
    printf '| %s | %s |\n' "$name" "${walls[*]}"
}
start track track "$work/first.png" -o "$work/out.csv"
UNDERSTUDY_CACHE=off start "animate, with the scan" \
    animate "$work/first.png" --target "$scan" -o "$work/out.csv"
start "animate, with the scan from the cache" animate "$work/first.png" --target "$scan" -o "$work/out.csv"

cat <<EOF

## Making a scan ready

\`understudy prepare\` without the cache: reading, landmarks, opening, and writing a GLB. Then what a frame of the opened
scan costs beside one of the scan as it was, and the stages (\`cargo bench --bench anatomy\`).

| command | wall s, each run |
|---|---|
EOF
UNDERSTUDY_CACHE=off start prepare prepare "$scan" -o "$work/out.glb"
printf '\n```text\n'
UNDERSTUDY_CACHE=off cargo bench --quiet --bench anatomy 2>/dev/null
echo '```'

cat <<EOF

## How well the avatar follows

\`cargo run --release --example follow -- --film\`: correlation and gain of each measure on the set-up's clips.
docs/transfer.md says what they are.

EOF
"$target/release/examples/follow" --film

peers=${UNDERSTUDY_PEERS:-$target/peers/bin/python}
if ! [ -x "$peers" ]; then
    python3 -m venv "$target/peers" >&2 &&
        "$peers" -m pip --quiet install -r scripts/requirements-peers.txt >&2 || peers=
fi

cat <<EOF

## Tracking beside MediaPipe

Both pinned to one processor, one after the other, milliseconds per frame without decoding. Both follow the face
through the whole clip; MediaPipe's includes its own smoothing.

| | mean | median | fastest |
|---|---:|---:|---:|
EOF
for ((round = 1; round <= rounds; round++)); do
    taskset -c 0 "$program" track "$clip" -o "$work/out.csv" --raw --threads 1 --quiet --timings |
        awk -F'|' '$2 ~ /track/ { printf "| understudy |%s | | |\n", $5 }'
    [ -z "$peers" ] || taskset -c 0 "$peers" scripts/bench_peers.py track "$clip" "$target/face_landmarker.task" 2>/dev/null ||
        echo "| MediaPipe: not measured | | | |"
done
[ -n "$peers" ] || echo "| MediaPipe: not installed | | | |"

cat <<EOF

## Warping beside VTK and SciPy

One thread, milliseconds; what is compared is described in docs/splines.md.

\`\`\`text
EOF
if [ -n "$peers" ]; then
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 taskset -c 0 "$peers" scripts/bench_peers.py splines 2>/dev/null ||
        echo "not measured"
fi
echo '```'

if [ "${1-}" = --all ]; then
    printf '\n## Stages\n\n```text\n'
    cargo bench --quiet 2>/dev/null
    echo '```'
fi
printf '\nLoad at the end: %s\n' "$(load)"

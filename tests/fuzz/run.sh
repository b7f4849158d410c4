#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Fuzzes the targets given (or all that are built), one after the other, and prints a line of
# numbers for each. What it finds lies in WORK: new inputs in <target>/found, crashes in
# <target>/crashes.
#
#   tests/fuzz/run.sh -b build/fuzz -t 60            a minute for each target
#   tests/fuzz/run.sh -b build/fuzz -n 5000000 bvh   five million inputs for one
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
build=build/fuzz
limit=(-max_total_time=60)
work=
while getopts b:t:n:w: option; do
  case $option in
    b) build=$OPTARG ;;
    t) limit=(-max_total_time="$OPTARG") ;;
    n) limit=(-runs="$OPTARG") ;;
    w) work=$OPTARG ;;
    *) exit 2 ;;
  esac
done
shift $((OPTIND - 1))
build=$(cd "$build" && pwd)
work=${work:-$build/fuzz}

targets=("$@")
if [ $# -eq 0 ]; then
  for program in "$build"/tests/fuzz/fuzz_*; do
    targets+=("${program##*/fuzz_}")
  done
fi

# Small inputs are read fast and reach as deep; archives and models need some room.
max_len() {
  case $1 in
    clip | gltf | hand_sets) echo 4096 ;;
    *) echo 2048 ;;
  esac
}

# Four times the inputs a second. The replaying test under the preset "asan" looks closer.
export ASAN_OPTIONS=${ASAN_OPTIONS:-malloc_context_size=2:quarantine_size_mb=16:detect_stack_use_after_return=0}

failed=0
printf '%-14s %10s %9s %6s %7s %8s\n' target inputs cpu-s edges corpus crashes
for target in "${targets[@]}"; do
  folder=$work/$target
  mkdir -p "$folder/found" "$folder/crashes"
  inputs=("$folder/found" "$here/corpus/$target")
  for more in "$here/regressions/$target" "$here/../fixtures/$target"; do
    [ -d "$more" ] && inputs+=("$more")
  done
  options=(-max_len="$(max_len "$target")" -timeout=10 -rss_limit_mb=2500
           -artifact_prefix="$folder/crashes/" -print_final_stats=1)
  [ -f "$here/dictionaries/$target.dict" ] && options+=(-dict="$here/dictionaries/$target.dict")
  log=$folder/log
  TIMEFORMAT='cpu_s %U'
  { time (cd "$folder" && "$build/tests/fuzz/fuzz_$target" "${inputs[@]}" "${options[@]}" "${limit[@]}"); } \
    >"$log" 2>&1 || failed=1
  runs=$(sed -n "s/.*number_of_executed_units: *//p" "$log" | tail -n 1)
  last=$(grep ' cov: ' "$log" | tail -n 1 || true)
  printf '%-14s %10s %9s %6s %7s %8s\n' "$target" "${runs:-?}" \
    "$(sed -n 's/^cpu_s //p' "$log")" "$(sed -n 's/.* cov: \([0-9]*\).*/\1/p' <<<"$last")" \
    "$(sed -n 's/.* corp: \([0-9]*\).*/\1/p' <<<"$last")" \
    "$(find "$folder/crashes" -type f | wc -l)"
done
exit $failed

#!/usr/bin/env bash
# From motion capture to a network for `holdfast reach` and the tables of its model card, in one
# command. Goes on where it was stopped.
#
#   ./setup train
#   tests/evaluation/reach.sh [FOLDER]     # out/reach_network
#
# Environment: HOLDFAST (the program, default build/release/apps/holdfast), HOLDFAST_DATA (default
# ../shared/data), HOURS (of motion to generate, default 8), WITHOUT (captured subjects to leave out,
# comma separated), WALK and REACH (iterations of the two stages, default 2000 and 500), SEED (default 1).
set -euo pipefail
cd "$(dirname "$0")/../.."
out=${1:-out/reach_network}
holdfast=${HOLDFAST:-build/release/apps/holdfast}
data=${HOLDFAST_DATA:-../shared/data}
held_out=cmu_08,cmu_39,cmu_49,cmu_expmap_train_walking_43
seed=${SEED:-1}
mkdir -p "$out"

# The captures, and motion with goals made from them. People left out are kept away as held-out ones are.
"$holdfast" make-reach-data "$data/mocap" -o "$out/corpus" --hours "${HOURS:-8}" \
  --held-out "$held_out${WITHOUT:+,$WITHOUT}"

train() { # folder flags...
  local folder=$out/$1
  shift
  [ -e "$folder/done" ] && return
  "$holdfast" train wandr "$out/corpus" -o "$folder" --threads 1 --seed "$seed" "$@" 2>"$folder.log" ||
    { tail "$folder.log" && return 1; }
  touch "$folder/done"
}

# Walks first: windows of clips, with no goal that must be reached. Then whole motions to drawn goals, with a
# critic: to reach before it can walk makes a network slide. Of the second stage the last weights are
# taken: more iterations reach more, and slide more.
train walk --iterations "${WALK:-2000}" --free-from 1 --prior-share 0.5
train reach --from "$out/walk/latest.safetensors" --iterations "${REACH:-500}" --evaluate-every 50 \
  --learning-rate 2e-4 --free-from 0.05 --free-share 0.3 --anchor 0.5 --skating 0.05 --critic 1

"$holdfast" evaluate reach --weights "$out/reach/latest_half.safetensors" \
  --starts "$out"/corpus/captured/held_out/cmu_* -o "$out/table"

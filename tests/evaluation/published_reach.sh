#!/usr/bin/env bash
# Tables 1 and 2 of WANDR (Diomataris et al. 2024) with networks trained by the published recipe
# (python3 -m holdfast.train wandr --paper) on open motion capture, in one command. Resumes where it was stopped.
#
#   ./setup train
#   tests/evaluation/published_reach.sh [FOLDER]     # out/published
#
# Environment: HOLDFAST, PYTHON, PYTHONPATH, HOLDFAST_DATA as in reach.sh; HOURS (of reaches to
# generate, default 1), EPOCHS (default 801), BATCH (sequences, default 128), THREADS (default 1), SEED (default 1).
set -euo pipefail
cd "$(dirname "$0")/../.."
out=${1:-out/published}
holdfast=${HOLDFAST:-build/release/apps/holdfast}
data=${HOLDFAST_DATA:-../shared/data}
python=${PYTHON:-/usr/bin/python3}
export PYTHONPATH=${PYTHONPATH:-build/release/python}
mkdir -p "$out"
"$holdfast" make-reach-data "$data/mocap" --hours "${HOURS:-1}" -o "$out/corpus" \
  --held-out cmu_08,cmu_39,cmu_49,cmu_expmap_train_walking_43

train() { # name motion intention
  local folder=$out/$1
  [ -e "$folder/done" ] && return
  "$python" -m holdfast.train wandr "$out/corpus" -o "$folder" --paper --motion "$2" --intention "$3" \
    --epochs "${EPOCHS:-801}" --batch "${BATCH:-128}" --threads "${THREADS:-1}" --seed "${SEED:-1}" \
    --evaluate-every 1000000 2>"$folder.log" || { tail "$folder.log" && return 1; }
  touch "$folder/done"
}
train both both full
train reaching reaching full
train locomotion locomotion full
train no_heading both no-heading
train no_pelvis both no-pelvis
train wrist both wrist

evaluate() { # name options...
  "$python" -m holdfast.evaluate reach --starts "$out"/corpus/captured/held_out/cmu_* --deadline fixed \
    -o "$out/table_$1" "${@:2}"
}
# Table 1: what the network is trained on. Table 2: parts of the intention, a network for each.
for name in locomotion reaching; do
  evaluate "$name" --weights "$out/$name/latest.safetensors" --rows full
done
evaluate both --weights "$out/both/latest.safetensors" --rows full,wrist,wrist+pelvis,wrist+heading \
  --ablation-weights "wrist=$out/wrist/latest.safetensors" \
  --ablation-weights "wrist+pelvis=$out/no_heading/latest.safetensors" \
  --ablation-weights "wrist+heading=$out/no_pelvis/latest.safetensors"

#!/usr/bin/env bash
# From motion capture to Table 2 of IMoS on the set that Holdfast makes: everything that the model
# card says of the embedded networks, in one command. Goes on where it was stopped.
#
#   ./setup train
#   tests/evaluation/synthesis.sh [FOLDER]     # out/synthesis; five hours of one core
#
# Environment: HOLDFAST (the program, default build/release/apps/holdfast), PYTHON (default /usr/bin/python3),
# PYTHONPATH (of the module, default build/release/python), HOLDFAST_DATA (default
# ../shared/data), SEEDS (of the trainings, default 1: a row of the table each, and one for their
# mean), ITERATIONS (default 4800), JOBS (trainings at the same time, a core each; default what there is),
# WITHOUT (captured people that networks do not learn from, comma separated; sb_garza,sb_ballplayer are under LGPL).
set -euo pipefail
cd "$(dirname "$0")/../.."
out=${1:-out/synthesis}
holdfast=${HOLDFAST:-build/release/apps/holdfast}
data=${HOLDFAST_DATA:-../shared/data}
python=${PYTHON:-/usr/bin/python3}
export PYTHONPATH=${PYTHONPATH:-build/release/python}
jobs=${JOBS:-$(nproc)}
recognizer=$out/recognizer.safetensors
mkdir -p "$out/networks"

# The people: clips of four to learn from, of two others for the held-out subjects s9 and s10.
"$holdfast" make-reach-data "$data/mocap" -o "$out/people" --hours 0.01 \
  --held-out cmu_08,cmu_39,cmu_49,cmu_expmap_train_walking_43
# Twice, but for hammering the same: whole arms hammer in what is recognized and compared with, wrists
# in what key frames are learnt from. People left out of these count as held out.
for set in "actions arm" "learn wrist"; do
  read -r name blows <<<"$set"
  held_out=()
  [ "$name" = actions ] || [ -z "${WITHOUT:-}" ] || held_out=(--held-out "accad_male1,sb_connor,$WITHOUT")
  "$holdfast" make-actions -o "$out/$name" --starts "$out/people/captured" --captured "$data/adl" \
    --count 2500 --subjects 10 --blows "$blows" "${held_out[@]}"
done

[ -e "$recognizer" ] ||
  "$python" -m holdfast.train recognizer "$out/actions" -o "$recognizer" --held-out s9,s10 --validation s8 \
    --epochs 150 --patience 0 --batch 64

train() { # name seed flags...
  local folder=$out/networks/$1-$2 seed=$2
  shift 2
  "$python" -m holdfast.train imos "$out/learn" -o "$folder" --held-out s9,s10 --validation s1 --mirror \
    --learning-rate 8e-4 --iterations "${ITERATIONS:-4800}" --threads 1 --seed "$seed" "$@" \
    2>"$folder.log" || { tail "$folder.log" && return 1; }
}

rows=()
read -r first _ <<<"${SEEDS:-1}"
one_more() { # name seed flags...
  while [ "$(jobs -rp | wc -l)" -ge "$jobs" ]; do wait -n; done
  train "$@" &
  local name=$1
  [ "$2" = "$first" ] || name=$1@$2
  rows+=(--weights "$name=$out/networks/$1-$2/best.safetensors")
}
for seed in ${SEEDS:-1}; do
  one_more full "$seed"
  one_more no-attention "$seed" --no-attention
  one_more random-embeddings "$seed" --random-embeddings
  one_more one-module "$seed" --one-module
done
while [ -n "$(jobs -rp)" ]; do wait -n; done

"$python" -m holdfast.evaluate synthesis --data "$out/actions" --held-out s9,s10 --recognizer "$recognizer" \
  "${rows[@]}" --repeats 20 --fitted-repeats 2 --object-cases 40 -o "$out/table"

#!/usr/bin/env bash
# From motion capture to a network for `holdfast reach` and the tables of its model card, in one
# command. Goes on where it was stopped.
#
#   ./setup train
#   tests/evaluation/reach.sh [FOLDER]     # out/reach_network
#
# Environment: HOLDFAST (the program, default build/release/apps/holdfast), PYTHON (default /usr/bin/python3),
# PYTHONPATH (of the module, default build/release/python), HOLDFAST_DATA (default
# ../shared/data), HOURS (of motion to generate, default 8), WITHOUT (captured subjects to leave out,
# comma separated), WALK and REACH (iterations of the two stages, default 2000 and 500), ROUNDS (of learning
# from its own optimizer before the last one, default 2), OPTIMIZED (reaches to optimize in each, default 800;
# LAST_OPTIMIZED in the last, default 1024), FOLLOW and SETTLE (iterations, default 500 and 210; LAST_FOLLOW in the last
# round, default 800), SHARE (of a round in the average, default 0.7), SEED (default 1).
set -euo pipefail
cd "$(dirname "$0")/../.."
out=${1:-out/reach_network}
holdfast=${HOLDFAST:-build/release/apps/holdfast}
data=${HOLDFAST_DATA:-../shared/data}
python=${PYTHON:-/usr/bin/python3}
export PYTHONPATH=${PYTHONPATH:-build/release/python}
held_out=cmu_08,cmu_39,cmu_49,cmu_expmap_train_walking_43
seed=${SEED:-1}
mkdir -p "$out"

# The captures, and motion with goals made from them. People left out are kept away as held-out ones are.
make_data() { # folder flags...
  "$holdfast" make-reach-data "$data/mocap" --held-out "$held_out${WITHOUT:+,$WITHOUT}" -o "$@"
}
make_data "$out/corpus" --hours "${HOURS:-8}"

train() { # folder flags...
  local folder=$out/$1
  shift
  [ -e "$folder/done" ] && return
  "$python" -m holdfast.train wandr -o "$folder" --threads 1 --seed "$seed" "$@" 2>"$folder.log" ||
    { tail "$folder.log" && return 1; }
  touch "$folder/done"
}

# Walks first: windows of clips, with no goal that must be reached. Then whole motions to drawn goals, with a
# critic: to reach before it can walk makes a network slide. Of every stage the last weights are
# taken: more iterations of the second reach more, and slide more.
train walk "$out/corpus" --iterations "${WALK:-2000}" --free-from 1 --prior-share 0.5
train reach "$out/corpus" --from "$out/walk/latest.safetensors" --iterations "${REACH:-500}" \
  --evaluate-every 50 --learning-rate 2e-4 --free-from 0.05 --free-share 0.3 --anchor 0.5 --skating 0.05 \
  --critic 1

# Then it follows what its own optimizer makes of it, and goes to goals by itself for a short while: long enough
# to reach again, short enough to keep its steps. Each round begins anew from `reach`.
learn() { # name iterations folders...
  local name=$1 iterations=$2
  shift 2
  train "follow$name" "$out/corpus/captured" "$@" --from "$out/reach/latest.safetensors" \
    --iterations "$iterations" --evaluate-every "$((iterations / 2))" --learning-rate 4e-4 --free-from 1
  train "settle$name" "$out/corpus/captured" "$@" --from "$out/follow$name/latest.safetensors" \
    --iterations "${SETTLE:-210}" --evaluate-every 70 --learning-rate 1e-4 --free-from 0.01 \
    --free-share 0.3 --anchor 1 --skating 0.02 --critic 1
}
optimize() { # name network seed
  make_data "$out/optimized$1" --hours 0.01 --optimized "${OPTIMIZED:-800}" --weights "$2" --seed "$3"
}
# What follows its optimizer takes longer steps, on bent knees, and answers less to other latents than the
# network it came from. The average of both has the steps and answers.
average() { # network output
  tests/evaluation/average_networks.py "$out/reach/latest_half.safetensors" "$1" "${SHARE:-0.7}" "$2"
}

from=$out/reach
for ((round = 1; round <= ${ROUNDS:-2}; ++round)); do
  optimize "$round" "$from/latest_half.safetensors" "$seed"
  learn "$round" "${FOLLOW:-500}" "$out/optimized$round/optimized"
  from=$out/settle$round
done

# Last, the reaches of all rounds, and of the average from other starts to other goals.
weights=$out/wandr.safetensors
if [ "${ROUNDS:-2}" = 0 ]; then # the first two stages alone
  cp "$out/reach/latest_half.safetensors" "$weights"
else
  average "$from/latest_half.safetensors" "$out/average.safetensors"
  OPTIMIZED=${LAST_OPTIMIZED:-1024} optimize _last "$out/average.safetensors" "$((seed + 2))"
  learn _last "${LAST_FOLLOW:-800}" "$out"/optimized*/optimized
  average "$out/settle_last/latest_half.safetensors" "$weights"
fi

"$python" -m holdfast.evaluate reach --weights "$weights" \
  --starts "$out"/corpus/captured/held_out/cmu_* -o "$out/table"

#!/usr/bin/env bash
# The workflow on a Slurm of two nodes (workflow/local_slurm), one of which is drained in the middle
# and one of whose jobs is killed, ends with the bytes of a run without Slurm.
#
#   tests/workflow/on_slurm.sh HOLDFAST WORK_DIR [SEQUENCES]
#
# Compared is everything but .jobs (status lines tell how long jobs took), benchmarks and logs.
set -euo pipefail
source_dir=$(cd "$(dirname "$0")/../.." && pwd)
holdfast=$(realpath "$1")
work=$2
count=${3:-16}

skip() { echo "SKIPPED: $*"; exit 0; }
command -v snakemake >/dev/null || skip "no snakemake"
command -v slurmctld >/dev/null || [ -x /usr/sbin/slurmctld ] || skip "no Slurm"
[ "$(id -u)" -eq 0 ] || skip "a Slurm of one's own needs root"

rm -rf "$work"
mkdir -p "$work/data"
work=$(realpath "$work")
cd "$work"
ln -s "$source_dir/workflow" workflow
export HOME=$work XDG_CACHE_HOME=$work/cache PATH=$PATH:/usr/sbin

# Motions, one of them damaged, with a blank and an umlaut in a name.
printf 'name,motion,object,job,hand\n' >samples.csv
printf '"größe 1",data/m0.bvh,apple,fit,right\n' >>samples.csv
"$holdfast" export demo_drink -o data/m0.bvh --end 14 --no-object -q
for k in $(seq 1 $((count - 1))); do
  "$holdfast" export demo_drink -o "data/m$k.bvh" --start "$k" --end $((k + 12)) --no-object -q
  printf 's%s,data/m%s.bvh,%s,fit,right\n' "$k" "$k" "$([ $((k % 2)) = 0 ] && echo mug || echo apple)" >>samples.csv
done
echo broken >data/m3.bvh

flow() { # results, more arguments for snakemake...
  local results=$1
  shift
  snakemake --snakefile workflow/Snakefile --quiet rules "$@" --config "samples=samples.csv" data=. \
    "results=$results" "holdfast=$holdfast" group_size=4 threads=1 mem_mb=200 reports=2
}

# Results name the files that they were made of, so both have the same paths: one run, moved away.
flow results --cores 2 --keep-going >alone.log 2>&1 || { tail -40 alone.log; exit 1; }
mv results alone
rm -rf .snakemake

# Waits until so many files of this pattern are there.
wait_for() { # count pattern
  for _ in $(seq 600); do
    [ "$(find results -path "$2" 2>/dev/null | wc -l)" -ge "$1" ] && return
    sleep 0.2
  done
  echo "nothing came of the run on Slurm"
  return 1
}

on_slurm() {
  flow results --profile workflow/profiles/slurm --latency-wait 20 >slurm.log 2>&1 &
  local run=$! job
  wait_for 1 '*/import/*.npz'
  echo "drained: n1 with $(squeue -h -w n1 -o %j | tr '\n' ' ')"
  scontrol update nodename=n1 state=drain reason=test
  wait_for 2 '*/solve/*/clip.npz'
  job=$(squeue -h -t R -o %A | head -n 1)
  echo "killed: job ${job:-none} ($(squeue -h -j "${job:-0}" -o %j 2>/dev/null))"
  [ -z "$job" ] || scancel --signal=KILL --full "$job"
  sleep 3
  scontrol update nodename=n1 state=resume
  wait "$run"
  echo "jobs of the queue: $(scontrol -o show job | grep -o 'JobState=[A-Z_]*' | sort | uniq -c | tr '\n' ' ')"
}
export -f flow wait_for on_slurm
export holdfast
code=0
"$source_dir/workflow/local_slurm" bash -euo pipefail -c on_slurm || code=$?
[ $code -ne 77 ] || skip "Slurm does not run here: see above"
[ $code -eq 0 ] || { tail -40 slurm.log; exit $code; }

diff -r -x .jobs -x benchmarks alone results
grep -q 'import failed' results/table.csv
grep -c ',done,' results/table.csv | grep -qx $((count - 1))
echo "PASSED: $count sequences, the same bytes as without Slurm"

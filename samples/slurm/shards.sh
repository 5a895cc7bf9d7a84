#!/bin/bash
#SBATCH --job-name=mhp-shards
#SBATCH --array=1-8
#SBATCH --output=slurm-%A_%a.out
# One shard a task, of fit, complexity, count, evidence or a study, in OUT/shards/TASK:
#   sbatch samples/slurm/shards.sh OUT fit DATA --preset recommended
#   sbatch --array=0-15 samples/slurm/shards.sh OUT study weights DATA
# There are as many shards as tasks. One that failed is done again by itself, as part i of n counted from 1, in any task:
#   SHARD=3/8 sbatch --array=3 samples/slurm/shards.sh OUT fit DATA --preset recommended
set -euo pipefail
out=$1
shift
exec "${MHP_INSPECTOR:-mhp-inspector}" "$@" --shard "${SHARD:-auto}" --out "$out/shards/$SLURM_ARRAY_TASK_ID"

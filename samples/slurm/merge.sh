#!/bin/bash
#SBATCH --job-name=mhp-merge
#SBATCH --output=slurm-%j.out
# Makes OUT/whole of OUT/shards/*, once the tasks of shards.sh are over; prints what one run prints, or which shards are missing:
#   shards=$(sbatch --parsable samples/slurm/shards.sh OUT fit DATA)
#   sbatch --dependency=afterany:"$shards" samples/slurm/merge.sh OUT
# afterany, not afterok: a task with one frame that cannot be fitted ends with exit code 1, and its shard is whole all the same.
set -euo pipefail
out=$1
shift
exec "${MHP_INSPECTOR:-mhp-inspector}" merge "$out"/shards/* --out "$out/whole" "$@"

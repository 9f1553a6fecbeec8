#!/usr/bin/env bash
# Submits a run of skep to Slurm: a job for each step, which starts once the step before it has succeeded.
#
#   bash FILE [SBATCH_OPTION...]      such as --partition=long --cpus-per-task=8 --mem=16G
#
# Every sbatch gets the options. SKEP in the environment names the program if it is not in PATH. Slurm runs
# this file once for each task, with other arguments: FILE task KIND [CYCLE]. Submitting the run again after
# a failure is safe: tasks that are done succeed at once.
set -euo pipefail

run=@RUN@
views=@VIEWS@
views_per_task=@VIEWS_PER_TASK@
cycles=@CYCLES@
fuse=(@FUSE@)
skep=${SKEP:-skep}

# task KIND [CYCLE]: does a task, for the range of views that the index in the array stands for.
task() {
    local start=$((${SLURM_ARRAY_TASK_ID:-0} * views_per_task))
    local end=$((start + views_per_task))
    ((end <= views)) || end=$views
    local limits=(--quiet --threads "${SLURM_CPUS_PER_TASK:-${SLURM_CPUS_ON_NODE:-0}}")
    # In MiB. Not all of it: files that are read and written count as memory of the job too.
    [ -z "${SLURM_MEM_PER_NODE:-}" ] || limits+=(--memory "$((SLURM_MEM_PER_NODE * 3 / 4))MiB")
    case $1 in
    search | check) exec "$skep" "$1" "$run" --cycle "$2" --views "$start..$end" "${limits[@]}" ;;
    next) exec "$skep" next "$run" --cycle "$2" "${limits[@]}" ;;
    finish) exec "$skep" finish "$run" --views "$start..$end" "${limits[@]}" ;;
    fuse) exec "$skep" fuse "$run" --quiet "${fuse[@]}" ;;
    *) echo "no task is called $1" >&2 && exit 2 ;;
    esac
}

if [ "${1-}" = task ]; then
    shift
    task "$@"
fi

given=("$@")
previous=
# submit NAME KIND [CYCLE]: submits a step, to start after the one submitted before.
submit() {
    local options=(--parsable --job-name="skep-$1" --kill-on-invalid-dep=yes)
    shift
    case $1 in
    search | check | finish) options+=(--array="0-$(((views - 1) / views_per_task))") ;;
    esac
    [ -z "$previous" ] || options+=(--dependency="afterok:$previous")
    # The number of the job, and on federated clusters the cluster's name after a semicolon.
    previous=$(sbatch "${given[@]}" "${options[@]}" "$0" task "$@")
    previous=${previous%%;*}
    echo "job $previous: $*"
}

for ((cycle = 0; cycle < cycles; cycle++)); do
    number=$(printf '%02d' "$cycle")
    submit "search-c$number" search "$cycle"
    submit "check-c$number" check "$cycle"
    submit "next-c$number" next "$cycle"
done
submit finish finish
submit fuse fuse

#!/usr/bin/env bash
# Tries the recipes of this folder on one machine: each makes the data set of a single run.
#
#     unshare --net --pid --fork --mount-proc bash scale/test.sh NEMORAL FOLDER kubernetes ray slurm
#
# NEMORAL is the program, FOLDER an empty one, and the recipes those to try. `ray` needs a Python
# with ray in $PYTHON; `slurm` needs Debian's slurm-wlm, and root. Both are tried in a network
# namespace that has the loopback alone: outside of one, Ray replaces 127.0.0.1 by the host's
# address, and hangs where that is not reachable. With a namespace of their own for processes, all
# of them end with this script.
set -euo pipefail
program=$(realpath "${1:?the program}")
mkdir -p "${2:?a folder}"
out=$(realpath "$2")
shift 2
here=$(realpath "$(dirname "$0")")
ip link set lo up 2> /dev/null || true
export NEMORAL_CACHE="$out/cache" NEMORAL="$program"

config="$out/forest.toml"
printf 'preset = "demo"\nframes = 4\nsequences = 3\nassets.seed = 5\n' > "$config"
"$program" generate "$config" --out "$out/single" --backend cpu --quiet

same() {
    diff -r "$out/single" "$1" && echo "ok   $2: the bytes of a single run"
}

kubernetes() {
    for i in 2 0 1; do
        JOB_COMPLETION_INDEX=$i SHARDS=3 CONFIG="$config" WORK="$out/k8s" \
            sh "$here/kubernetes/entrypoint.sh" > /dev/null 2>&1 || return 1
    done
    # A pod that is made again finds its shard done.
    JOB_COMPLETION_INDEX=1 SHARDS=3 CONFIG="$config" WORK="$out/k8s" \
        sh "$here/kubernetes/entrypoint.sh" | grep -q '"resumed":true'
    "$program" merge "$out"/k8s/shard-* --out "$out/k8s-forest"
    same "$out/k8s-forest" kubernetes
    if JOB_COMPLETION_INDEX=3 SHARDS=3 CONFIG="$config" WORK="$out/k8s" \
        sh "$here/kubernetes/entrypoint.sh" 2> /dev/null; then
        echo "FAIL kubernetes: a shard that there is not"
        return 1
    fi
}

ray() {
    local python=${PYTHON:-python3}
    local ray
    ray="$(dirname "$(realpath -s "$python")")/ray"
    export RAY_USAGE_STATS_ENABLED=0
    local limits=(--num-cpus=1 --object-store-memory=80000000 --disable-usage-stats)
    "$ray" start --head --node-ip-address=127.0.0.1 --port=6399 --include-dashboard=false "${limits[@]}" > "$out/ray.log"
    "$ray" start --address=127.0.0.1:6399 --node-ip-address=127.0.0.1 "${limits[@]}" >> "$out/ray.log"
    # The second node is killed as if its machine had lost its power, in the middle of a shard.
    local victim
    victim=$(pgrep -n -f '/raylet/raylet ')
    (
        sleep "${KILL_AFTER_S:-6}"
        pkill -KILL -P "$victim" || true
        kill -KILL "$victim" && echo "     a node of two was killed"
    ) &
    "$python" "$here/ray/nemoral_ray.py" "$config" --out "$out/ray-forest" --work "$out/ray" \
        --shards 12 --cpus 1 --program "$program" --address 127.0.0.1:6399 -- --backend cpu \
        | tee "$out/ray.jsonl"
    wait
    same "$out/ray-forest" ray
}

slurm() {
    local etc="$out/slurm"
    mkdir -p "$etc"/{state,n1,n2}
    # With 127.0.0.1 alone, Slurm finds no address of this machine.
    ip addr add 10.9.9.1/24 dev lo
    cat > "$etc/slurm.conf" << CONF
ClusterName=test
SlurmctldHost=$(hostname)(10.9.9.1)
AuthType=auth/none
CredType=cred/none
SlurmUser=root
SlurmdUser=root
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
StateSaveLocation=$etc/state
SlurmdSpoolDir=$etc/%n
SlurmctldPidFile=$etc/ctld.pid
SlurmdPidFile=$etc/%n.pid
SlurmctldLogFile=$etc/ctld.log
SlurmdLogFile=$etc/%n.log
ReturnToService=2
MpiDefault=none
NodeName=n1 NodeHostname=$(hostname) NodeAddr=10.9.9.1 Port=17001 CPUs=2 RealMemory=3000
NodeName=n2 NodeHostname=$(hostname) NodeAddr=10.9.9.1 Port=17002 CPUs=2 RealMemory=3000
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=10 State=UP
CONF
    export SLURM_CONF="$etc/slurm.conf"
    slurmctld && slurmd -N n1 && slurmd -N n2
    sleep 2
    local job
    job=$(sbatch --parsable --array=0-2 --output="$etc/shard-%a.log" "$here/slurm/shards.sbatch" "$config" "$out/slurm-work")
    sbatch --wait --dependency="afterok:$job" --output="$etc/merge.log" "$here/slurm/merge.sbatch" "$out/slurm-work" "$out/slurm-forest"
    kill "$(cat "$etc/ctld.pid")" "$(cat "$etc/n1.pid")" "$(cat "$etc/n2.pid")"
    same "$out/slurm-forest" slurm
}

for recipe in "$@"; do
    case $recipe in
        kubernetes | ray | slurm) "$recipe" ;;
        *) echo "error: $recipe: must be kubernetes, ray or slurm" >&2 && exit 2 ;;
    esac
done

#!/bin/sh
# Makes the shard that a pod of an Indexed Job is for.
#
# JOB_COMPLETION_INDEX is set by Kubernetes; SHARDS, CONFIG and WORK are set in job.yaml. If UPLOAD
# is set, the finished shard is moved there by rclone.
set -eu
: "${JOB_COMPLETION_INDEX:?the pod must be of a Job with completionMode: Indexed}"
: "${SHARDS:?the number of completions}"
: "${CONFIG:?the config}"
: "${WORK:?the folder of the shards}"
name="shard-$JOB_COMPLETION_INDEX-of-$SHARDS"
out="$WORK/$name"
mkdir -p "$WORK"
"${NEMORAL:-nemoral}" generate "$CONFIG" "$@" --shard "$JOB_COMPLETION_INDEX/$SHARDS" --out "$out" \
    --backend cpu --progress json --resume
if [ -n "${UPLOAD:-}" ]; then
    rclone copy --checksum "$out" "$UPLOAD/$name"
    rclone check "$out" "$UPLOAD/$name"
    rm -rf "$out"
fi

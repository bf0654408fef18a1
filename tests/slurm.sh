#!/bin/sh
# Runs farm/slurm/ on a Slurm of one machine, set up for this test alone.
#
#   tests/slurm.sh [PROGRAM]          default: target/release/lightmesh
#
# slurmctld, slurmd and munged (packages slurmctld, slurmd, slurm-client, munge) are started as the current user with
# configuration, keys, state and logs in a temporary folder, on free ports; nothing of the system's own is touched. Then a
# picture is baked, rendered in tiles and merged: it has to equal that of one process, to the bit, although one of
# the tiles fails at first. A tile that fails for good has to be seen, and leaves no picture.
#
# Ends with 77, and a line that says why, where that is impossible on this machine.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
what="the farm on Slurm"
program=${1:-$here/target/release/lightmesh}
PATH=$PATH:/usr/sbin
. "$here/tests/farm.sh"

for needed in munged slurmctld slurmd sbatch scontrol; do
    command -v $needed >/dev/null || skip "no $needed (packages slurmctld, slurmd, slurm-client, munge)"
done

started=
cleanup() {
    status=$?
    trap - EXIT INT TERM
    # Those who need the others first.
    for process in $started; do
        kill "$process" 2>/dev/null || continue
        wait "$process" 2>/dev/null || true
    done
    if [ $status -ne 0 ] && [ $status -ne 77 ]; then
        tail -n 30 "$work"/*.log "$work"/job*/logs/*.log >&2 2>/dev/null || true
    fi
    rm -rf "$work"
    exit $status
}
trap cleanup EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# start LOG COMMAND...: the last one that was started is stopped first.
start() {
    log=$work/$1.log
    shift
    "$@" >"$log" 2>&1 &
    started="$! $started"
}

user=$(id -un)
host=$(hostname -s)
ports=$(python3 -c 'import socket
sockets = [socket.socket() for _ in range(2)]
[s.bind(("127.0.0.1", 0)) for s in sockets]
print(*[s.getsockname()[1] for s in sockets])')
mkdir -m 700 "$work/munge" "$work/state" "$work/spool"
(umask 077 && head -c 128 /dev/urandom >"$work/munge/key")
cat >"$work/slurm.conf" <<CONFIGURATION
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=${ports% *}
SlurmdPort=${ports#* }
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
# What is queued again waits as long as a credential lives.
AuthInfo=socket=$work/munge/socket,cred_expire=5
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
# No control groups: they need a system of their own.
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=1,bf_interval=1
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONFIGURATION
SLURM_CONF=$work/slurm.conf
export SLURM_CONF

start munged munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" \
    --pid-file="$work/munge/pid" --log-file="$work/munge/log" --seed-file="$work/munge/seed"
tries=0
until [ -S "$work/munge/socket" ]; do
    tries=$((tries + 1))
    [ $tries -le 50 ] || skip "munged does not start here: $(tail -n 1 "$work/munged.log" "$work/munge/log" 2>&1)"
    sleep 0.1
done
start slurmctld slurmctld -D -i
start slurmd slurmd -D
tries=0
until [ "$(sinfo --noheader --format=%t 2>/dev/null)" = idle ]; do
    tries=$((tries + 1))
    [ $tries -le 150 ] || skip "Slurm does not start here: $(tail -n 1 "$work/slurmd.log")"
    sleep 0.2
done

prepare
scene=$work/scene/forest.toml

# One of three tiles fails once.
LIGHTMESH=$(flaky 2/3 "$work/failed")
export LIGHTMESH
"$here/farm/slurm/submit.sh" --wait "$scene" "$work/job1" 3 >"$work/submitted" || fail "the job failed"
cat "$work/submitted" >&2
[ -d "$work/failed" ] || fail "no tile was to fail"
same "$work/job1/picture.exr" || fail "the merged picture is another one"
tiles=$(sed -n 's/.*tiles //p' "$work/submitted")
grep -q 'task 1: exit code 1, after 0 restarts' "$work/job1/logs/tile.${tiles}_1.log" ||
    fail "the exit code of the tile that failed was not seen"
[ "$(scontrol show job "$tiles" | grep -o 'Restarts=[1-9]')" = Restarts=1 ] ||
    fail "the tile that failed, and it alone, was to be queued again once"

# One fails for good: nothing is merged, and who waits is told.
LIGHTMESH=$(flaky 2/3 "$work/failed-again")
RETRIES=0
export LIGHTMESH RETRIES
if "$here/farm/slurm/submit.sh" --wait "$scene" "$work/job2" 3 >"$work/submitted"; then
    fail "a job with a tile that failed ended as if all were well"
fi
tiles=$(sed -n 's/.*tiles //p' "$work/submitted")
scontrol show job "${tiles}_1" | grep -q 'ExitCode=1:0' || fail "Slurm does not know the exit code of the tile that failed"
[ ! -e "$work/job2/picture.exr" ] || fail "a picture was merged although a tile is missing"
echo "passed: $what, $(sinfo --version)"

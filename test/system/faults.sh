# Sourced by run.sh: what happens from outside while alcesd runs.
boot faults 2000
expect 10 faults
check "after all of that the recording is whole" "$alces" convert "$results/faults/faults.mcap" "$results/faults/traces"

# Sourced by run.sh: a drive, and what its recording and the traces beside it are worth.
boot drive 900
expect 6 drive

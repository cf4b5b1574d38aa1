# Sourced by run.sh: a drive, and what its recording and the traces beside it are worth.
boot drive 1200
expect 6 drive
drive=$results/drive

check "the recording is whole and replays" replay "$drive/drive.mcap" "$drive/map"
check "the recording's own poses can be read" "$here/traces.py" poses "$drive/drive.mcap" "$drive/recorded.tum"
check "replayed to the poses of the drive" "$here/traces.py" compare "$drive/recorded.tum" "$drive/map/trajectory.tum" 0.0000001  # as far as it is written
near_truth() {  # near_truth MAP LIMIT_M
  "$alces" evaluate "$1" --truth "$drive/truth.tum" --json > "$1/evaluation.json" && "$here/traces.py" error "$1/evaluation.json" "$2"
}
check "the map is near the truth" near_truth "$drive/map" 0.2
scans=$(wc -l < "$drive/recorded.tum")
loops=$(sed -n 's/^alcesd .* \([0-9]*\) loops closed.*/\1/p' "$drive/alcesd.log")
check "nearly all scans are mapped" at_least "$scans" 30
check "a loop is closed" at_least "$loops" 1

check "traces can be exported" "$alces" convert "$drive/drive.mcap" "$drive/traces"
check "candump saw what was recorded" "$here/traces.py" frames "$drive/traces/can0.log" "$drive/candump.log" 4
"$alces" convert --gpiomon 1 "$drive/drive.mcap" "$drive/gpio.txt" > /dev/null 2>&1
check "gpiomon saw the edges that were recorded" "$here/traces.py" edges "$drive/traces/gpio.txt" "$drive/gpiomon.txt"

# What candump and gpiomon wrote, in the place of ours; the lasers' bytes are ours, for want of another witness.
cp -r "$drive/traces" "$drive/witnessed"
rm "$drive/witnessed/events.txt"
check "candump's part of the drive" "$here/traces.py" trim "$drive/traces/can0.log" "$drive/candump.log" "$drive/witnessed/can0.log"
cp "$drive/gpiomon.txt" "$drive/witnessed/gpio.txt"
check "candump's and gpiomon's traces become a recording" "$alces" convert --lines 3 "$drive/witnessed" "$drive/witnessed.mcap"
check "... that replays" replay "$drive/witnessed.mcap" "$drive/witnessed_map"
# Not to the bit: the witnesses know nothing of our ticks, at which the SYNC that samples the motor's position is sent.
check "... to the poses of the drive" "$here/traces.py" compare "$drive/recorded.tum" "$drive/witnessed_map/trajectory.tum" 0.15
check "... as near the truth" near_truth "$drive/witnessed_map" 0.2
cp "$drive/traces/can0.log" "$results/exported.log"

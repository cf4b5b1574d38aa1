# canplayer plays what alces has written; then a drive that is recorded on a disk, until the power is cut: QEMU is killed
# from outside.
wires_up || echo "FAIL wires: no vcan0 or no gpio-sim"
candump -L vcan1 > "$out/played.log" 2> "$out/played.err" & candump=$!
sleep 0.5
cp /out/exported.log "$out"
canplayer -I "$out/exported.log" vcan1=can0 > "$out/canplayer.log" 2>&1
verdict "canplayer plays the exported trace" $? "$(tail -n 1 "$out/canplayer.log")"
sleep 0.5
kill -TERM $candump; wait $candump

mount -t ext4 /dev/vda /disk || echo "FAIL disk: cannot be mounted"
start_simulator simulator.log --scans 30 --speed 1.6 --seed 2 --standstill 8
start_alcesd alcesd.log --record /disk/cut.mcap
until_true 30 grep -q '^rolls' "$out/simulator.log"
sleep 25
keep
echo "CUT at $(cut -d' ' -f1 /proc/uptime) s"
sleep 1000

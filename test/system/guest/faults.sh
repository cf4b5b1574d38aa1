# What can happen to a vehicle that stands and scans: from outside, while alcesd runs.
wires_up || echo "FAIL wires: no vcan0 or no gpio-sim"
start_simulator simulator_1.log --scans 1 --standstill 10000 --seed 3
start_alcesd alcesd.log --record "$out/faults.mcap"

# Scans are what all of it is for: recovered is who makes them again. The status line says so every ten seconds.
scans_now() { grep 'scans/s' "$out/alcesd.log" | tail -n 1 | grep -q '] scanning: 0\.[1-9]'; }
has_no_scans() { ! scans_now; }
recovers() {  # recovers NAME SECONDS
  until_true "$2" scans_now
  verdict "$1" $? "no scans $2 s later: $(tail -n 1 "$out/alcesd.log" | cut -c1-200)"
}
recovers "a scanner that stands is brought up" 60

ip link set vcan0 down
until_true 10 grep -q 'vcan0: .*down' "$out/alcesd.log"; told=$?
sleep 3
verdict "interface down: told" $told "$(tail -n 1 "$out/alcesd.log" | cut -c1-200)"
ip link set vcan0 up
sleep 12
recovers "interface up again: scans go on" 60

canplayer -I /scenarios/hostile.log > "$out/hostile.log" 2>&1
kill -0 "$alcesd"; verdict "hostile trace: alcesd lives" $? "$(tail -n 1 "$out/alcesd.log" | cut -c1-200)"
sleep 12
alcesd --reset-motor >> "$out/reset.log" 2>&1  # too many failures in a row give the motor up, until a person has looked
verdict "hostile trace: a person resets the motor" $? "$(tail -n 1 "$out/reset.log")"
recovers "hostile trace: scans go on" 90

kill -KILL "$simulator"; wait "$simulator"
until_true 30 has_no_scans
verdict "scanner killed: told" $? "$(tail -n 1 "$out/alcesd.log" | cut -c1-200)"
start_simulator simulator_2.log --scans 1 --standstill 10000 --seed 3
sleep 12
alcesd --reset-motor >> "$out/reset.log" 2>&1
recovers "scanner there again: scans go on" 90

kill -TERM "$alcesd"
ends_within 60 "$alcesd"; status=$?
verdict "SIGTERM after all of that: alcesd ends with status 0" $status "status $status: $(tail -n 1 "$out/alcesd.log")"
stop_simulator
grep -q '^head: -\?0.00 rpm; motor: .*disabled' "$out/simulator_2.log"
verdict "SIGTERM after all of that: the head stands and the motor is disabled" $? "$(grep '^head' "$out/simulator_2.log")"

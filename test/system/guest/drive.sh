# A drive around a block with everything on the wires, recorded by alcesd, candump and gpiomon side by side.
wires_up; verdict "wires: vcan and gpio-sim are up" $? "no vcan0 or no gpio-sim"

# A line that another program holds: alcesd says who, and ends.
gpiomon "$chip" 2 > /dev/null 2>&1 & holder=$!
sleep 0.5
start_alcesd busy.log --record "$out/busy.mcap"
ends_within 10 "$alcesd"; status=$?
grep -q 'in use by "gpiomon"' "$out/busy.log"; named=$?
[ $status = 5 ] && [ $named = 0 ] && [ ! -e "$out/busy.mcap" ]
verdict "gpio line busy: named, exit status 5, no empty recording" $? "status $status: $(tail -n 1 "$out/busy.log")"
kill $holder; wait $holder

start_simulator simulator.log --scans 30 --speed 1.6 --seed 2 --standstill 8 --tap 3 --truth "$out/truth.tum"
candump -L vcan0 > "$out/candump.log" 2> "$out/candump.err" & candump=$!
gpiomon "$chip" 3 > "$out/gpiomon.txt" 2>&1 & gpiomon=$!
sleep 0.5
start_alcesd alcesd.log --record "$out/drive.mcap"
until_true 20 grep -q '^rolls' "$out/simulator.log"; verdict "the vehicle drives" $? "$(tail -n 1 "$out/simulator.log")"

# Frames that are not for anybody here, while it drives: with the drive's own identifiers, extended and FD.
until_true 20 sleep 10
for round in 1 2 3 4 5 6 7 8 9 10; do
  cansend vcan0 00000181#FFFFFFFFFFFFFFFF
  cansend vcan0 00000701#05
  cansend vcan0 18FF0102#DEADBEEF
  cansend vcan0 181##1FFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFF
  cansend vcan0 701##000
  cansend vcan0 081##100FF00FF00FF00FF
  cansend vcan0 110#R
  sleep 0.3
done
until_true 120 grep -q '^stands' "$out/simulator.log"; verdict "the drive comes to its end" $? "$(tail -n 1 "$out/simulator.log")"
sleep 2
kill -TERM "$alcesd"
ends_within 60 "$alcesd"; status=$?
verdict "SIGTERM: alcesd ends with status 0" $status "status $status: $(tail -n 1 "$out/alcesd.log")"
sleep 0.5
kill -TERM $candump $gpiomon; wait $candump; wait $gpiomon
stop_simulator
cat "$out/simulator.log"; tail -n 30 "$out/alcesd.log"
grep -q '^head: -\?0.00 rpm; motor: .*disabled' "$out/simulator.log"
verdict "SIGTERM: the head stands and the motor is disabled" $? "$(grep '^head' "$out/simulator.log")"

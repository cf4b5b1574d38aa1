# Sourced by run.sh: what alces exports is played by canplayer; a recording outlives a power cut.
[ -e "$results/exported.log" ] || "$alces" simulate --scans 3 --out "$work/sample.mcap" > /dev/null 2>&1
[ -e "$results/exported.log" ] || "$alces" convert "$work/sample.mcap" "$results/exported.log" > /dev/null 2>&1
boot power 1200
grep -a '^CUT' "$results/power.console"
if ! grep -aq '^CUT' "$results/power.console"; then
  echo "FAIL power: there was nothing to cut; the console's end:"; tail -n 15 "$results/power.console"; failed=1
fi
grep -aE '^(PASS|FAIL) ' "$results/power.console" | grep -a . || { echo "FAIL power: no verdict"; failed=1; }
grep -aq '^FAIL' "$results/power.console" && failed=1
check "candump of what canplayer played is what alces exported" "$here/traces.py" same "$results/exported.log" "$results/power/played.log"

boot after 300
expect 2 after
cut=$results/after
check "power cut: the recording can be read" "$alces" convert "$cut/cut.mcap" "$cut/whole.mcap"
check "power cut: the recording replays" replay "$cut/cut.mcap" "$cut/map"
"$alces" convert "$cut/cut.mcap" "$cut/traces" > /dev/null 2>&1
# alcesd syncs the file every second, a chunk is half a second long. The power goes a moment after CUT is printed, so that a
# little more than nothing may be there.
lost() {
  local cut_s last_s
  cut_s=$(sed -n 's/^CUT at \([0-9.]*\) s/\1/p' "$results/power.console")
  last_s=$("$here/traces.py" span "$cut/traces/can0.log" | cut -d' ' -f2)
  python3 -c "import sys; lost = $cut_s - $last_s; print(f'the last {lost:.1f} s are lost'); sys.exit(not -2 < lost < 5)"
}
check "power cut: no more is lost than the file system had not written" lost
check "power cut: what was driven until then is mapped" at_least "$(wc -l < "$cut/map/trajectory.tum")" 20

# What the scenarios share. /out is a folder of the host's: a program that writes there is held up while the host is busy, and
# time goes on in here. So everything is written to memory, and brought out by keep when nothing is under way.
out=/run/alces/$scenario
mkdir -p "$out" "/out/$scenario"
keep() { cp "$out"/* "/out/$scenario"; }

verdict() {  # verdict NAME STATUS WHY-NOT
  if [ "$2" = 0 ]; then echo "PASS $1"; else echo "FAIL $1: $3"; fi
}

uptime_s() { cut -d. -f1 /proc/uptime; }

# until_true SECONDS COMMAND...: polls; status 1 when time is up.
until_true() {
  local end=$(($(uptime_s) + $1)); shift
  while ! "$@" > /dev/null 2>&1; do
    [ "$(uptime_s)" -ge "$end" ] && return 1
    sleep 0.2
  done
}

wires_up() {
  local bus
  for bus in vcan0 vcan1; do
    ip link add dev $bus type vcan && ip link set $bus mtu 72 && ip link set $bus up || return 1
  done
  mkdir -p /sys/kernel/config/gpio-sim/alces/bank0 && cd /sys/kernel/config/gpio-sim/alces || return 1
  echo 8 > bank0/num_lines; echo alces-sim > bank0/label; echo 1 > live
  chip=$(cat bank0/chip_name)
  cd /run/alces
  until_true 5 test -e "/dev/$chip"
}

# The simulated scanner goes before everything else: the outside world waits for no processor.
simulator=""
start_simulator() {  # start_simulator LOG OPTIONS...
  local log=$1; shift
  alces-scanner-sim --config /etc/vehicle.toml --fifo-priority 50 "$@" > "$out/$log" 2>&1 &
  simulator=$!
  until_true 30 grep -q '^ready' "$out/$log" || { echo "FAIL simulator: $(tail -n 1 "$out/$log")"; return 1; }
}
stop_simulator() { kill -TERM "$simulator" 2> /dev/null; wait "$simulator"; }

alcesd=""
start_alcesd() {  # start_alcesd LOG OPTIONS...
  local log=$1; shift
  alcesd --config /etc/vehicle.toml "$@" > "$out/$log" 2>&1 &
  alcesd=$!
}
# ends_within SECONDS PID: its status, or 124 when it does not end.
ends_within() {
  until_true "$1" sh -c "! kill -0 $2" || { kill -KILL "$2"; return 124; }
  wait "$2"
}
# How often a line has been said in a log.
count() { grep -c "$1" "$out/$2"; }
more_than() { [ "$(count "$1" "$2")" -gt "$3" ]; }

# Runs in the fresh Debian that fresh_debian.sh makes; prints what it looks at, stops at what is wrong.
export LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive
cd /packaging
say() { echo "== $*"; }

say "install"
apt-get -qq update
apt-get -qq --yes --no-install-recommends install ./alces_*.deb ./alcesd_*.deb ./libalces-dev_*.deb ./libalces-client*.deb >install.log 2>&1 ||
  { cat install.log; exit 1; }
dpkg --audit
dpkg-query -W -f '${Package} ${Version} ${db:Status-Status}\n' alces alcesd libalces-dev libalces-client0 libalces-client-dev

say "the programs start"
alces --version
alcesd --version
alcesd --dry-run --config /etc/alces/vehicle.toml

say "a drive is simulated, replayed, looked at"
alces simulate --scans 3 --seed 1 --out drive.mcap
alces replay drive.mcap --out map
alces info map | head -n 4
test "$(wc -l <map/trajectory.tum)" -ge 3

say "completion"
bash -euc '. /usr/share/bash-completion/completions/alces
  COMP_WORDS=(alces ""); COMP_CWORD=1; _alces; echo "${COMPREPLY[*]}"; [[ " ${COMPREPLY[*]} " == *" replay "* ]]
  COMP_WORDS=(alces map --mem); COMP_CWORD=2; _alces; [[ ${COMPREPLY[*]} == --memory ]]
  COMP_WORDS=(alces map --front-end p); COMP_CWORD=3; _alces; [[ ${COMPREPLY[*]} == paper ]]'
for verb in $(alces --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]*\) .*/\1/p'); do
  for option in $(alces "$verb" --help | grep -oE '^  (-[a-z],)?--[a-z-]+' | grep -oE -- '--[a-z-]+'); do
    zcat "/usr/share/man/man1/alces-$verb.1.gz" | tr -d '\\' | grep -qe "$option" ||
      { echo "the manual page of alces $verb does not name $option"; exit 1; }
  done
done

say "user, groups, rule, unit"
id alces
test -s /lib/udev/rules.d/60-alcesd.rules
systemd-analyze verify --man=no /lib/systemd/system/alcesd.service
systemd-analyze security --offline=yes --threshold=25 /lib/systemd/system/alcesd.service | tail -n 1

say "as that user, and without the devices: one sentence, exit status 5"
install -d -o alces -g alces /var/lib/alces /run/alces  # as StateDirectory= and RuntimeDirectory= do
status=0
setpriv --reuid=alces --regid=alces --init-groups alcesd --config /etc/alces/vehicle.toml --record /var/lib/alces/drive.mcap || status=$?
test "$status" = 5

say "a program against libalces-dev"
# shellcheck disable=SC2046  # the flags are words
g++ -std=c++20 -O2 example/main.cpp -o two_scans $(pkg-config --cflags --libs alces)
./two_scans

say "a program against libalces-client-dev, without alcesd: it says so"
# shellcheck disable=SC2046
gcc -O2 /usr/share/doc/libalces-client-dev/examples/follow.c $(pkg-config --cflags --libs alces-client) -lm -o follow
./follow /run/alces/none 1 | grep -q 'no pose: there is no page'

say "a configuration that was changed stays when the package is installed again, and goes with purge"
echo "# mine" >>/etc/alces/vehicle.toml
apt-get -qq --yes --reinstall install ./alcesd_*.deb >install.log 2>&1 || { cat install.log; exit 1; }
tail -n 1 /etc/alces/vehicle.toml | grep -q mine
apt-get -qq --yes purge alces alcesd libalces-dev libalces-client0 libalces-client-dev >install.log 2>&1 || { cat install.log; exit 1; }
test ! -e /etc/alces/vehicle.toml
test ! -e /usr/bin/alcesd
say "all is well"

# For check scripts, sourced: npm_packages SOURCE WORK NAME installs what SOURCE/package-lock.json names into WORK, once. Ends the script
# with 77, and a sentence, where this machine has no node or cannot get the packages; NAME is the lock file's in that sentence.
npm_packages() {
  for tool in node npm; do
    command -v "$tool" >/dev/null || { echo "skipped: $tool is not installed (Debian: apt-get install nodejs npm)"; exit 77; }
  done
  mkdir -p "$2"
  if ! cmp -s "$1/package-lock.json" "$2/installed-lock.json"; then
    cp "$1/package.json" "$1/package-lock.json" "$2/"
    if ! (cd "$2" && npm ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1); then
      tail -3 "$2/npm.log"
      echo "skipped: npm could not get the packages of $3"
      exit 77
    fi
    cp "$1/package-lock.json" "$2/installed-lock.json"
  fi
}

# Shared by the scripts beside it; sourced with the repository as working directory.

say() {
  if [ -t 2 ]; then printf '\033[1m%s\033[0m\n' "$*" >&2; else printf '== %s\n' "$*" >&2; fi
}

# Compilers at once: one a core, and 2 GB of free memory each.
job_count() {
  cores=$(nproc)
  free_gb=$(awk '/^MemAvailable/ {print int($2 / 1048576)}' /proc/meminfo)
  fitting=$((free_gb / 2))
  [ "$fitting" -lt "$cores" ] || fitting=$cores
  [ "$fitting" -ge 1 ] || fitting=1
  echo "$fitting"
}

# run_tests PRESET [CTEST_OPTION...]: what failed is said once more at the end, where people and machines look.
run_tests() {
  preset=$1
  shift
  if ctest --preset "$preset" --parallel "$(job_count)" --output-junit "$PWD/build/$preset.tests.xml" "$@"; then return 0; fi
  scripts/failed_tests "build/$preset.tests.xml"
  return 1
}

# build PRESET [TARGET...]: configures and builds; CMake's report is shown only when it fails. A new build tree compiles eight
# files at once, which halves the time.
build() {
  preset=$1
  shift
  say "building: $preset"
  mkdir -p build
  unity=""
  [ -e "build/$preset/CMakeCache.txt" ] || unity=-DALCES_UNITY=ON
  if ! cmake --preset "$preset" $unity >"build/$preset.configure.log" 2>&1; then
    cat "build/$preset.configure.log" >&2
    return 1
  fi
  cmake --build --preset "$preset" --parallel "$(job_count)" --target "${@:-all}"
}

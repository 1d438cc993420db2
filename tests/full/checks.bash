# The checks of `scripts/test --full` beyond the ordinary ones; sourced by it. Each takes minutes to hours.
# shellcheck shell=bash
# shellcheck disable=SC2154  # root, results and programs are scripts/test's

# sanitized FOLDER SANITIZERS PROGRAM...: builds these gtest programs with the sanitizers in a build space of its own, and
# runs each.
sanitized() {
  local build=$root/.workspace/$1 sanitizers=$2 program failed=0
  shift 2
  mkdir -p -- "$build"
  cmake -S "$root" -B "$build" -DCATKIN_ENABLE_TESTING=ON -DCATKIN_DEVEL_PREFIX="$build/devel" \
    -DPYTHON_EXECUTABLE=/usr/bin/python3 -DXPLANE_BRIDGE_PYTHON="$root/.venv/bin/python" \
    -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG="-O1 -g1" -DXPLANE_BRIDGE_SANITIZE="$sanitizers" \
    >"$build/configure.log" 2>&1 || { tail -n 20 "$build/configure.log"; return 1; }
  make -C "$build" -j"${XPLANE_BRIDGE_JOBS:-$(nproc)}" "$@" >"$build/build.log" 2>&1 ||
    { grep -E -m 20 'error|\*\*\*' "$build/build.log"; return 1; }
  # Its own libraries: those of the ordinary build come first on the path, and are not sanitized.
  local -x LD_LIBRARY_PATH=$build/devel/lib:${LD_LIBRARY_PATH:-}
  # A program's memory must lie where the sanitizer expects it, which randomised addresses do not everywhere.
  for program; do
    printf '%s: ' "${program#xplane_bridge_}"
    mkdir -p "$results/run/$(basename "$build")/$program"
    if (cd "$results/run/$(basename "$build")/$program" && timeout 1800 setarch "$(uname -m)" --addr-no-randomize \
      "$build/devel/lib/xplane_bridge/$program" --gtest_brief=1 >"$build/$program.log" 2>&1); then
      tail -n 1 "$build/$program.log"
    else
      failed=1
      tail -n 60 "$build/$program.log"
    fi
  done
  return "$failed"
}

# gtest_programs [ROOM...]: the programs of these rooms of tests/cpp; without one, all.
gtest_programs() {
  local rooms=("${@:-}") room file
  for room in "${rooms[@]}"; do
    while IFS= read -r file; do
      file=xplane_bridge_$(basename "$file" .cpp)
      [ ! -x "$programs/$file" ] || printf '%s\n' "$file"
    done < <(find "tests/cpp/$room" -name 'test_*.cpp' | sort)
  done
}

check_asan() {
  local names
  mapfile -t names < <(gtest_programs)
  # What runs inside ROS or Python is not sanitized itself, and leaks at exit by intent.
  ASAN_OPTIONS=detect_leaks=0:detect_stack_use_after_return=1 UBSAN_OPTIONS=print_stacktrace=1 \
    sanitized asan address,undefined "${names[@]}"
}

check_tsan() {
  local names
  # Those that link ROS are left out: its libraries are not sanitized, and their locks would not be seen.
  mapfile -t names < <(gtest_programs core actuation vision)
  TSAN_OPTIONS="suppressions=$root/tests/full/tsan.supp halt_on_error=1 second_deadlock_stack=1" \
    sanitized tsan thread "${names[@]}"
}

check_tidy_all() { python tests/tidy.py lib; }

# Ten minutes each with libFuzzer and sanitizers, and as long for what reads files and packets in Python.
check_long_fuzz() {
  local build=$root/.workspace/libfuzzer seconds=${XPLANE_BRIDGE_FUZZ_SECONDS:-600} program fuzzers=()
  mkdir -p -- "$build"
  { CXX=clang++ cmake -S lib/core -B "$build" -DCMAKE_BUILD_TYPE=Release -DXPLANE_BRIDGE_CORE_FUZZ=ON \
    -DXPLANE_BRIDGE_SANITIZE=fuzzer-no-link,address,undefined &&
    make -C "$build" -j"${XPLANE_BRIDGE_JOBS:-$(nproc)}" fuzz_targets; } >"$build/build.log" 2>&1 ||
    { tail -n 20 "$build/build.log"; return 1; }
  for program in "$build"/fuzz/fuzz_*; do
    if [ -x "$program" ] && [ -f "$program" ]; then fuzzers+=("$program"); fi
  done
  export build seconds
  side_by_side long_fuzz_program tests/fuzz/fuzz_python.py "${fuzzers[@]}"
}

long_fuzz_program() {
  local program=$1 name
  name=$(basename "$program")
  if [ "$name" = fuzz_python.py ]; then
    PYTHONPATH=$root/src:${PYTHONPATH:-} python "$program" --seconds "$seconds" --seed "$RANDOM"
    return
  fi
  printf '%s: ' "$name"
  # A reader of files may make some where it runs. What was found is kept where no later run deletes it.
  mkdir -p "$results/run/long_$name" "$build/findings"
  if ! (cd "$results/run/long_$name" && "$program" -max_total_time="$seconds" -max_len=6000 -timeout=20 \
    -artifact_prefix="$build/findings/$name-" "$build/fuzz/seeds/$name" >"$results/long_$name.log" 2>&1); then
    tail -n 40 "$results/long_$name.log"
    return 1
  fi
  grep -E '^Done' "$results/long_$name.log"
}

# The container's steps in a bare root file system: needs root and debootstrap.
check_container() {
  local folder
  folder=$(mktemp -d) || return
  python3 tests/container/container_steps.py "$folder/root" --then "scripts/demo --duration 20 --headless"
  local status=$?
  rm -rf --one-file-system -- "$folder"
  return "$status"
}

# Eight simulated hours in lock-step.
check_soak() { python tests/full/soak.py --hours "${XPLANE_BRIDGE_SOAK_HOURS:-8}"; }

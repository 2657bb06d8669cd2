#!/bin/sh
# Fuzz every target with libFuzzer, then with AFL++, and print a table of what was done.
#
#   tests/fuzz/run.sh CJSON_DIR [TARGET...]
#
#   FUZZ_SECONDS   how long each target runs with each engine; default 60
#   FUZZ_RUNS      or how many executions each does, whatever the time
#   FUZZ_ENGINES   default "libfuzzer afl"
#
# Starts from tests/fuzz/corpus, unpacked into build/fuzz/TARGET/packed, and from what earlier runs found
# (build/fuzz/TARGET/corpus). Inputs that break something are left in build/fuzz/TARGET/failures; replay
# one by
#   build/fuzz-libfuzzer/tests/fuzz/fuzz_TARGET FILE
# Exit status 1 when there is any.
set -eu
cd "$(dirname "$0")/../.."

cjson=$1
shift
all="frame range calls init labels align surface nests detections tracks blob rig_json images xyz json render config pixels"
targets=${*:-$all}
engines=${FUZZ_ENGINES:-libfuzzer afl}
seconds=${FUZZ_SECONDS:-60}
runs=${FUZZ_RUNS:-}
root=$PWD/build/fuzz

mkdir -p "$root/tmp"
export TMPDIR="$root/tmp"

for engine in $engines; do
    log=build/fuzz-$engine.log
    { AFL_QUIET=1 cmake --preset "fuzz-$engine" -DISOHEAD_CJSON_DIR="$cjson" &&
        AFL_QUIET=1 cmake --build --preset "fuzz-$engine" --parallel 2 --target fuzzers; } >"$log" 2>&1 ||
        { cat "$log"; exit 1; }
    tests/fuzz/notices.sh "build/fuzz-$engine/tests/fuzz/fuzz_notices" a u w t f c
done

# Where the targets with a dictionary of words have it.
dictionary() {
    case $1 in
    rig_json | json | render) echo tests/fuzz/json.dict ;;
    config) echo tests/fuzz/config.dict ;;
    esac
}

# row TARGET ENGINE EXECUTIONS EDGES FAILURES
row() { printf '%-10s %-10s %12s %8s %9s\n' "$@"; }

# libFuzzer ends at the first failure.
run_libfuzzer() {
    work=$root/$1
    words=$(dictionary "$1")
    if [ -n "$runs" ]; then limit=-runs=$runs; else limit=-max_total_time=$seconds; fi
    nice "build/fuzz-libfuzzer/tests/fuzz/fuzz_$1" "$limit" ${words:+"-dict=$words"} -timeout=60 \
        -max_len=4096 -print_final_stats=1 -artifact_prefix="$work/failures/" "$work/corpus" \
        "$work/packed" >"$work/libfuzzer.log" 2>&1 || true
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$work/libfuzzer.log")
    edges=$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$work/libfuzzer.log" | tail -n 1)
    if [ -z "$executions" ]; then
        tail -n 20 "$work/libfuzzer.log"
        exit 1
    fi
}

# keep DIRECTORY FILE...: those that there are, under the name of what is in them.
keep() {
    directory=$1
    shift
    for input in "$@"; do
        [ ! -e "$input" ] || cp "$input" "$directory/$(sha1sum <"$input" | cut -d ' ' -f 1)"
    done
}

# AFL++ goes on after a failure; what it found new goes to the corpus of later runs.
run_afl() {
    work=$root/$1
    words=$(dictionary "$1")
    rm -rf "$work/afl"
    if [ -n "$runs" ]; then limit="-E $runs"; else limit="-V $seconds"; fi
    # shellcheck disable=SC2086 # two words
    AFL_SKIP_CPUFREQ=1 AFL_I_DONT_CARE_ABOUT_MISSING_CRASHES=1 AFL_NO_AFFINITY=1 AFL_NO_UI=1 \
        AFL_FAST_CAL=1 nice afl-fuzz -i "$work/packed" -o "$work/afl" $limit \
        ${words:+-x "$words"} -t 20000 -m none -- "build/fuzz-afl/tests/fuzz/fuzz_$1" \
        >"$work/afl.log" 2>&1 || true
    stats=$work/afl/default/fuzzer_stats
    if [ ! -e "$stats" ]; then
        tail -n 20 "$work/afl.log"
        exit 1
    fi
    executions=$(sed -n 's/^execs_done *: //p' "$stats")
    edges=$(sed -n 's/^edges_found *: //p' "$stats")
    keep "$work/failures" "$work"/afl/default/crashes/id* "$work"/afl/default/hangs/id*
    keep "$work/corpus" "$work"/afl/default/queue/id*+cov
}

sum=0
total=0
row target engine executions edges failures
for engine in $engines; do
    for target in $targets; do
        mkdir -p "$root/$target/corpus" "$root/$target/failures"
        rm -rf "$root/$target/packed"
        tests/fuzz/corpus.py unpack "tests/fuzz/corpus/$target.pack" "$root/$target/packed"
        before=$(find "$root/$target/failures" -type f | wc -l)
        "run_$engine" "$target"
        count=$(($(find "$root/$target/failures" -type f | wc -l) - before))
        row "$target" "$engine" "$executions" "$edges" "$count"
        sum=$((sum + executions))
        total=$((total + count))
    done
done
row all "" "$sum" "" "$total"
[ "$total" = 0 ] || { echo "failures: $root/TARGET/failures" >&2; exit 1; }

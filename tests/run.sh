#!/usr/bin/env bash
# Runs test suites, two or more at a time, and adds up what they report.
#
#   tests/run.sh SUITE...       programs or scripts that write the Test Anything Protocol (cmocka does when asked)
#
# Prints one line for each suite, every failing test with its message, and last 'N passed, N failed[, N skipped]'.
# A suite that crashes, or stops before the number of tests it announced, counts as one more failure.
set -u
export LC_ALL=C

logs=build/tests/log
mkdir -p "$logs"
export CMOCKA_MESSAGE_OUTPUT=TAP
passed=0 failed=0 skipped=0

run() { # suite log
    local start=$EPOCHREALTIME
    "$1" >"$2" 2>&1 </dev/null
    echo "# exit $? $(((${EPOCHREALTIME/./} - ${start/./}) / 1000))" >>"$2"
}

declare -A log_of
for suite in "$@"; do
    while [ "$(jobs -rp | wc -l)" -ge "$(nproc)" ]; do wait -n; done
    log_of[$suite]=$logs/$(basename "$suite").log
    run "$suite" "${log_of[$suite]}" &
done
wait

for suite in "$@"; do
    log=${log_of[$suite]}
    # The sanitizers and print_message() write between the lines of the protocol, so count only lines of its form.
    read -r ok bad skip plan status ms < <(awk '
        /^1\.\.[0-9]+$/ { plan += substr($0, 4) }
        /^(not )?ok [0-9]+ .*# SKIP/ { skip++; next }
        /^ok [0-9]+/ { ok++ }
        /^not ok [0-9]+/ { bad++ }
        /^# exit [0-9]+ [0-9]+$/ { status = $3; ms = $4 }
        END { print ok + 0, bad + 0, skip + 0, plan + 0, status + 0, ms + 0 }' "$log")
    note=
    if [ $((ok + bad + skip)) -lt "$plan" ] || { [ "$bad" = 0 ] && [ "$status" != 0 ]; }; then
        bad=$((bad + 1))
        note=", stopped after $((ok + bad + skip - 1)) of $plan tests with exit status $status"
    elif [ "$plan" = 0 ]; then
        bad=$((bad + 1))
        note=", ran no test"
    fi
    printf '%-40s %4d passed %4d failed  %6.1f s%s\n' "$(basename "$suite")" "$ok" "$bad" "$((ms / 100))e-1" "$note"
    if [ -n "$note" ]; then
        tail -n 40 "$log" | sed 's/^/    /'
    elif [ "$bad" != 0 ]; then
        # A test's message may come before or after its line, so everything but the lines of passed tests.
        grep -vE '^(ok |1\.\.|# exit |# note: )' "$log" | head -n 200 | cut -c1-300 | sed 's/^/    /'
    fi
    # What a suite wants seen even when it passes: lines that start with "# note:".
    sed -n 's/^# note: /    /p' "$log"
    passed=$((passed + ok)) failed=$((failed + bad)) skipped=$((skipped + skip))
done

echo "$passed passed, $failed failed$([ "$skipped" = 0 ] || echo ", $skipped skipped")"
[ "$failed" = 0 ] && [ "$passed" != 0 ]

#!/usr/bin/env bash
# What README.md and docs/ name exists: files and headings that links lead to, figures, paths, make targets, the
# library's identifiers, and the options of the programs (built before). Writes the Test Anything Protocol.
set -u
export LC_ALL=C.UTF-8
shopt -s lastpipe # so that verdict, behind a pipe, can count

pages=(README.md docs/*.md)
number=0
echo "1..7"

# verdict TITLE: passes if its standard input, what is wrong, is empty.
verdict() {
    local wrong
    wrong=$(sort -u)
    number=$((number + 1))
    [ -z "$wrong" ] && echo "ok $number - $1" && return
    echo "not ok $number - $1"
    echo "$wrong" | head -n 40 | sed 's/^/# /'
}

# Text outside of fenced blocks.
prose() { awk '/^ *```/ { fenced = !fenced; next } !fenced' "$1"; }

# The anchors that GitHub gives a page's headings.
anchors() {
    prose "$1" | sed -nE 's/^#+ +//p' | sed -E 's/\[([^]]*)\]\([^)]*\)/\1/g' | tr '[:upper:]' '[:lower:]' |
        sed -E 's/[^[:alnum:] _-]//g; s/ /-/g'
}

links() { prose "$1" | grep -oE '\]\([^)]+\)' | sed -E 's/^\]\(//; s/\)$//' | grep -vE '^https?:'; }

for page in "${pages[@]}"; do
    links "$page" | while read -r link; do
        path=${link%%#*}
        [ -z "$path" ] || [ -e "$(dirname "$page")/$path" ] || echo "$page: $link: no such file"
    done
done | verdict "links lead to files"

for page in "${pages[@]}"; do
    links "$page" | grep -E '^[^#]*(\.md)?#' | while read -r link; do
        path=$(dirname "$page")/${link%%#*}
        [ "${link%%#*}" ] || path=$page
        anchors "$path" | grep -qxF -- "${link#*#}" || echo "$page: $link: no such heading"
    done
done | verdict "links lead to headings"

for figure in docs/figures/*.png docs/figures/*.svg; do
    grep -qF "figures/${figure##*/}" "${pages[@]}" || echo "$figure: on no page"
done | verdict "every figure is shown"

for page in "${pages[@]}"; do
    grep -oE '\b(tests|examples|docs)/[A-Za-z0-9_./*-]*[A-Za-z0-9_*]' "$page" | while read -r path; do
        compgen -G "$path" >/dev/null || compgen -G "$path.*" >/dev/null || echo "$page: $path: no such file"
    done
done | verdict "paths exist"

for page in "${pages[@]}"; do
    grep -oE '(^ {4}|`)make [a-z][a-z-]*([^a-z/-]|$)' "$page" | sed -E 's/.*make //; s/[^a-z-]*$//' | while read -r target; do
        grep -qE "^([a-z-]+ )*$target( [a-z-]+)*:" Makefile || echo "$page: make $target: no such target"
    done
done | verdict "make has the targets"

known=$(cat gtao.h gtso.h examples/shaders/* tests/*/*.[ch] | grep -oE '\b(gtao|gtso|GTAO|GTSO)i?_[A-Za-z0-9_]+' | sort -u)
for page in "${pages[@]}"; do
    grep -oE '\b(gtao|gtso|GTAO|GTSO)_[A-Za-z0-9_]+\b[*]?' "$page" | grep -vE '[*_]$' | sort -u | comm -23 - <(echo "$known") |
        sed "s|^|$page: |; s|$|: no such name|"
done | verdict "names of the library exist"

options_of() { grep -ohE -- '"-[a-z-]+"' "$1" | tr -d '"'; }

# The options of program NAME: by --help, or as its source spells them.
options() {
    case $1 in
    demo | bench) ;;
    bake-mpi) options bake ;;
    bench-run) options_of tests/bench/bench.c ;;
    bake_bench | bench_*) options_of "tests/bench/$1.c" ;;
    *)
        if [ -x "build/$1" ]; then
            "build/$1" --help 2>&1 | grep -oE -- '(^|[^A-Za-z0-9-])-[A-Za-z-][a-z0-9-]*' | grep -oE -- '-.*'
        else
            cat "examples/$1.c" "examples/port/$1.c" 2>/dev/null | grep -oE -- '"-[a-z-]+"' | tr -d '"'
        fi
        echo --help
        ;;
    esac
}

# Commands as they stand in the pages, continued lines joined; each program's own options only.
mkdir -p build/docs
for program in ao bake bake-mpi diff layers lut mesh_to_map port replay sequence viewer; do
    options $program | sort -u >build/docs/$program
done
cat build/docs/* | sort -u >build/docs/.all
for page in "${pages[@]}"; do
    sed -E ':a; /\\$/ { N; s/\\\n//; ta; }' "$page" | grep -oE 'build/[a-z_-]+ [^`|;#]*' | while read -r program rest; do
        program=${program#build/}
        [ -e "build/docs/$program" ] || options "$program" | sort -u >"build/docs/$program"
        [ -s "build/docs/$program" ] || continue
        for word in $(echo "$rest" | grep -oE -- '(^| |\[)--?[a-z][a-z-]*' | tr -d ' ['); do
            grep -qxF -- "$word" "build/docs/$program" || echo "$page: build/$program $word: no such option"
        done
    done
    grep -oE '`--[a-z][a-z-]*' "$page" | tr -d '`' | sort -u | comm -23 - build/docs/.all | sed "s|^|$page: |; s|$|: no such option|"
done | verdict "programs have the options"

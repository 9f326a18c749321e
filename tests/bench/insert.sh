#!/bin/sh
# insert.sh DIRECTORY PAGE...: tables DIRECTORY/NAME.md into pages, between the lines <!-- begin: NAME --> and
# <!-- end: NAME -->.
set -eu
export LC_ALL=C.UTF-8
dir=$1
shift
for page in "$@"; do
    awk -v dir="$dir" '
        /^<!-- begin: / {
            print; file = dir "/" $3 ".md"
            if ((getline line < file) < 0) { print "insert.sh: no table " $3 > "/dev/stderr"; exit 1 }
            do print line; while ((getline line < file) > 0)
            close(file); skip = 1; next
        }
        /^<!-- end: / { skip = 0 }
        !skip' "$page" > "$page.new"
    mv "$page.new" "$page"
done

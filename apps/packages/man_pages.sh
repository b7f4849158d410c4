#!/usr/bin/env bash
# Man pages of the program and of every command, from what --help prints (help2man), compressed.
#   man_pages.sh PROGRAM FOLDER VERSION
set -euo pipefail
program=$1 folder=$2 version=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$folder"

# help2man wants a blank line before each section and an indented usage; examples stay as they are.
page() { # command...
  local name="holdfast${*:+-${*// /-}}" summary
  name=${name// /-}
  "$program" "$@" --help > "$work/help"
  summary=$(grep -m1 . "$work/help")
  summary=${summary#holdfast: }
  # First line of the page is its NAME already; a bracketed [name] begins a help2man section.
  {
    printf '#!/bin/sh\ncase $1 in --version) echo "holdfast %s" ;; *) cat <<"END_OF_HELP"\n' "$version"
    sed -e '1d' -e 's/^\(Usage:\)/\n\1/' "$work/help"
    printf 'END_OF_HELP\n;; esac\n'
  } > "$work/$name"
  chmod +x "$work/$name"
  {
    printf '[see also]\n'
    if [ $# -eq 0 ]; then printf 'Each command has a page: man holdfast-fit.\n'; else printf '.BR holdfast (1)\n'; fi
  } > "$work/include"
  help2man --no-info --no-discard-stderr --section 1 --source "Holdfast $version" --manual "Holdfast" \
    --include "$work/include" --name "$summary" "$work/$name" |
    sed -e "s|$work/||g" -e "s/^\.TH HOLDFAST /.TH ${name^^} /" -e "s/^holdfast \\\\- /$name \\\\- /" |
    gzip -9n > "$folder/$name.1.gz"
  local below
  for below in $(sed -n '/^Subcommands:/,/^[A-Z].*:$/s/^  \([a-z][a-z-]*\) .*/\1/p;' "$work/help"); do
    page "$@" "$below"
  done
}

page

#!/bin/bash
# test_page.sh FOLDER: report.html of evaluate in headless Chromium (test_page.py); skips itself where there is none.
set -uo pipefail

for chromium in chromium chromium-browser google-chrome; do
  if command -v "$chromium" >/dev/null; then
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    mapfile -t plots < <(cd "$1" && ls -- *.svg)
    python3 -B "$(dirname "${BASH_SOURCE[0]}")/test_page.py" "$1/report.html" "$chromium" "$work" "${plots[@]}"
    exit
  fi
done
echo "SKIPPED: chromium not found"
exit 77

#!/bin/bash
# Manual pages are free of errors, and shells complete options, values and files as --help lists them.
# usage: test_manual.sh FOLDER, that of the tools. Shells that are not installed are named and skipped.
set -euo pipefail

folder=$1
export PATH=$folder:$PATH
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
touch room.bvh

fail() {
  echo "test_manual.sh: $*" >&2
  exit 1
}

# complete_bash WORD...: what bash offers for the last word.
complete_bash() (
  source ./completion
  COMP_WORDS=("$@")
  COMP_CWORD=$(($# - 1))
  compopt() { echo "compopt $*"; }
  "_$1"
  printf '%s\n' "${COMPREPLY[@]}"
)

# expect TEXT WANTED
expect() {
  if [[ $1 != "$2" ]]; then fail "got '$1' instead of '$2'"; fi
}

for tool in bvhbuild bvhinfo bvhquery bvhrender bvhtrace; do
  # Every option of --help is in the page and in the scripts.
  mapfile -t options < <("$tool" --help | grep -oE '^ {2,10}(-[a-z], *)?--[a-z-]+' | grep -oE -- '--[a-z-]+')
  [[ ${#options[@]} -ge 5 ]] || fail "$tool --help lists ${#options[@]} options"
  "$tool" --man >page
  for shell in bash zsh fish; do "$tool" --completion "$shell" >"$shell"; done
  for option in "${options[@]}"; do
    grep -qF -- "${option//-/\\-}\\fR" page || fail "$tool --man lacks $option"
    grep -qE -- "[\" |(]$option[\" |)]" bash || fail "bash's completion of $tool lacks $option"
    grep -qF -- "'*$option[" zsh || fail "zsh's completion of $tool lacks $option"
    grep -qE -- "-l ${option#--}( |$)" fish || fail "fish's completion of $tool lacks $option"
  done
  for section in NAME SYNOPSIS DESCRIPTION OPTIONS "EXIT STATUS" EXAMPLES "SEE ALSO"; do
    grep -qx ".SH $section" page || fail "$tool --man lacks $section"
  done
  if command -v man >/dev/null; then
    expect "$(LC_ALL=C.UTF-8 MANROFFSEQ='' MANWIDTH=80 man --warnings=w -E UTF-8 -l -Tutf8 page 2>&1 >/dev/null)" ""
  else
    echo "SKIPPED: part: no man"
  fi
  bash -n bash
  if command -v zsh >/dev/null; then zsh -n zsh; else echo "SKIPPED: part: no zsh"; fi
  if command -v fish >/dev/null; then fish -n fish; else echo "SKIPPED: part: no fish"; fi
done

bvhbuild --completion bash >completion
expect "$(complete_bash bvhbuild --quality "" | paste -sd' ')" "fast balanced high"
expect "$(complete_bash bvhbuild --quality b | paste -sd' ')" "balanced"
expect "$(complete_bash bvhbuild --verb)" ""
expect "$(complete_bash bvhbuild --qual)" "--quality"
expect "$(complete_bash bvhbuild --threads "" | head -1)" "compopt +o default"
# A file's name: bash's own completion.
expect "$(complete_bash bvhbuild -o "")" ""
if command -v fish >/dev/null; then
  export HOME=$work
  bvhbuild --completion fish >bvhbuild.fish
  expect "$(fish -c "source bvhbuild.fish; complete -C 'bvhbuild --quality b'" | cut -f1)" "balanced"
  fish -c "source bvhbuild.fish; complete -C 'bvhbuild -o ro'" | grep -q "^room.bvh" || fail "fish offers no files"
fi

# A wrong shell is a wrong command line.
status=0
bvhinfo --completion tcsh 2>message || status=$?
expect "$status" 2
grep -q "tcsh not in {bash,zsh,fish}" message || fail "another message: $(cat message)"
echo "manual pages and completions are complete"

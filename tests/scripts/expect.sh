# expect.sh: what tests that are shell scripts have in common; to be sourced. Makes the folder $work, which goes at the
# end, and counts $faults.
# shellcheck shell=bash
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
faults=0

fault() {
  echo "FAILED: $*"
  faults=$((faults + 1))
}

# expect STATUS PATTERN COMMAND...: the exit status, and a pattern (grep's) in the output, which stays in $output.
expect() {
  local status=$1 pattern=$2 actual
  shift 2
  output=$("$@" 2>&1)
  actual=$?
  if [[ $actual -ne $status ]] || ! grep -q -- "$pattern" <<<"$output"; then
    fault "$*: exit status $actual (wanted $status), output (wanted '$pattern'):"$'\n'"$output"
  fi
}

# holds FILE TEXT...
holds() {
  local file=$1 text
  shift
  for text in "$@"; do
    if ! grep -qF -- "$text" "$file"; then fault "$file does not hold '$text'"; fi
  done
}

# The last line of a test.
end() {
  echo "$faults faults"
  exit $((faults != 0))
}

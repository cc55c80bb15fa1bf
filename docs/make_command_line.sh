#!/usr/bin/env bash
# docs/make_command_line.sh [PROGRAM]: writes docs/command_line.md from the --help of every command.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
program=${1:-build/release/bin/palpate}
commands=$("$program" --help | sed -n '/^Subcommands:/,$p' | awk 'NR > 1 && NF { print $1 }')
{
  cat <<'TXT'
# Command line

`docs/make_command_line.sh` writes this page from the program's own `--help`. Do not edit it by hand.

- Every command exits with 0 on success. It exits with 1 after a usage or input error, with a reason of one line.
- Exit code 2: a `solve` did not converge, or a `validate`, `report` or `replay` found a difference.
- `--json` prints the result for machines on standard output.
- Work longer than a second shows a progress bar on a terminal.

```
TXT
  "$program" --help
  printf '```\n'
  for command in $commands; do
    printf '\n## palpate %s\n\n```\n' "$command"
    "$program" "$command" --help
    printf '```\n'
  done
} | sed 's/[[:space:]]*$//' >docs/command_line.md.new
mv docs/command_line.md.new docs/command_line.md

"""Check a commit's message: `python .ci/commit_message.py FILE`; the rule is in CONTRIBUTING.md."""

from __future__ import annotations

import re
import sys
from pathlib import Path

LONGEST_SUBJECT = 72


def problems(message: str) -> list[str]:
    """What is wrong with a commit's message, in sentences."""
    lines = [line.rstrip() for line in message.splitlines() if not line.startswith("#")]
    subject, body = (lines or [""])[0], lines[1:]
    if subject.startswith(("Merge ", "Revert ", "fixup! ", "squash! ")):
        return []
    found = []
    if len(subject) > LONGEST_SUBJECT:
        found.append(f"the subject has {len(subject)} characters, at most {LONGEST_SUBJECT} are shown")
    if not re.match(r"[a-z][\w ,./-]*: \S", subject):
        found.append(f"the subject does not begin with a component ('optics: ...'): {subject!r}")
    if body and body[0]:
        found.append("no empty line stands between subject and body")
    if not any(body):
        found.append("no body says why, and what was measured")
    return found


if __name__ == "__main__":
    said = problems(Path(sys.argv[1]).read_text(encoding="utf-8"))
    sys.stderr.writelines(f"commit message: {problem}\n" for problem in said)
    sys.exit(bool(said))

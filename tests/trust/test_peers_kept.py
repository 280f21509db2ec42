"""What is kept of the peers' answers is what they answer today."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from peers.kept import KEPT

pytestmark = pytest.mark.trust

ROOT = Path(__file__).parents[2]
USERS = sorted(path for path in (ROOT / "tests/physics").glob("test_*.py") if "from peers.kept import" in path.read_text())


@pytest.mark.parametrize("path", USERS, ids=lambda path: path.stem)
def test_the_peers_answer_as_they_did(path: Path) -> None:
    program = [sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", str(path)]
    done = subprocess.run(
        program, cwd=ROOT, env={**os.environ, "DIELAST_PEERS": "compare"}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    assert json.loads(KEPT.read_text())

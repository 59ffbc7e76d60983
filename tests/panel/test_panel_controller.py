"""What a panel makes of a run's last words."""

from __future__ import annotations

import json
import socket
import threading
from pathlib import Path

from workbench.loopback import HERE, MessageLine
from workbench.panel.controller import Controller, ControllerWatch
from workbench.run import SessionFile

LAST = [{"phase": "rest"}, {"phase": "rest", "stops": 1}, {"ended": {"kind": "Interrupted"}}]


def test_last_words_are_read_of_a_run_that_is_gone_before_it_is_answered(tmp_path: Path) -> None:
    with socket.create_server((HERE, 0)) as server:

        def say() -> None:
            link, _ = server.accept()
            link.sendall(b"".join(json.dumps(one).encode() + b"\n" for one in LAST))
            link.close()

        run = threading.Thread(target=say)
        run.start()
        line = MessageLine(socket.create_connection(server.getsockname()))
        run.join()
        watch = ControllerWatch(tmp_path, pages=lambda: 1)
        watch._follow(line, Controller("alive", SessionFile(tmp_path / "e.json", {})))
        line.close()
    assert watch.now.state == "ended"
    assert watch.now.published["ended"] == {"kind": "Interrupted"}

"""The live twin in the viewer: its states are drawn as they come, in a process of its own."""

from __future__ import annotations

import json
import socket
import time

import numpy as np
import rerun as rr

from workbench.loopback import HERE
from workbench.report.watching import LiveDrawing, _Newest

POSE = {"foot": [0.0, 0.0, 0.0], "top": [0.1, 0.0, 0.3], "rotor": [0.1, 0.0, 0.26], "pitch": 0.02,
        "beam": [[0.0, 0.0, 0.0], [-0.1, 0.0, 0.2], [0.1, 0.0, 0.3]]}  # fmt: skip
STATE = {"time_s": 1.5, "arrived_s": 0.0, "error_mm": 1.2, "robot": POSE, "twin": POSE,
         "missing": {"top": [0.03, 0.0, 0.0]}}  # fmt: skip


def test_robot_twin_and_force_are_drawn_and_what_is_not_known_is_left_out() -> None:
    stream = rr.RecordingStream("test", send_properties=False)
    memory = stream.memory_recording()
    drawing = LiveDrawing(stream, (0.24, 0.22), 5.0)
    drawing.draw(STATE)
    unseen = POSE | {"foot": None, "rotor": None}
    drawing.draw(STATE | {"robot": unseen, "twin": None, "missing": None, "error_mm": None})
    drawing.draw(STATE | {"missing": {"top": [3.0, 0.0, 4.0], "foot": [0.1, 0.0, 0.0]}})
    assert memory.num_msgs() > 10
    assert drawing._reach["top"] * np.hypot(3.0, 4.0) <= 0.2
    LiveDrawing.layout()


def test_the_newest_state_is_drawn_and_the_end_is_noticed() -> None:
    listener = socket.create_server((HERE, 0))
    link = socket.create_connection(listener.getsockname())
    newest = _Newest(listener.accept()[0])
    lines = [{"observing": {"name": "hop"}}, *({"state": {"time_s": k}} for k in range(3))]
    link.sendall(b"".join(json.dumps(one).encode() + b"\n" for one in lines))
    assert newest.first() == {"name": "hop"}
    time.sleep(0.2)
    assert newest.take() == {"time_s": 2}
    link.close()
    assert newest.take() is None
    listener.close()

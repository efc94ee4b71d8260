"""A stand-in for a simulator that misbehaves on cue; run as a process by the tests.

Usage: scripted_peer.py FAULT ACTION NUMBER MARKER [unity arguments]. At the NUMBER-th ACTION (or
"handshake") it commits FAULT, provided MARKER does not exist yet or FAULT ends with "!"; MARKER is
then made, so that a restarted peer behaves.
"""

import json
import os
import struct
import sys
import time
from pathlib import Path

import msgpack

FAULT, ACTION, NUMBER, MARKER = sys.argv[1], sys.argv[2], int(sys.argv[3]), Path(sys.argv[4])
W, H = 300, 300


class Peer:
    def __init__(self):
        self.counts = {}
        self.steps = 0
        if ACTION == "handshake":
            self.misbehave(None)
        self.out = os.open(os.environ["AI2THOR_FIFO_SERVER_PIPE_PATH"], os.O_WRONLY)
        self.reply({"action": "Start", "sequenceId": 0})
        self.inp = open(os.environ["AI2THOR_FIFO_CLIENT_PIPE_PATH"], "rb")  # noqa: SIM115, PTH123

    def misbehave(self, action):
        if not FAULT.endswith("!") and MARKER.exists():
            return
        MARKER.touch()
        fault = FAULT.rstrip("!")
        if fault == "die":
            sys.stderr.write("last words\n")
            sys.stderr.flush()
            os._exit(3)
        elif fault == "hang":
            time.sleep(3600)
        elif fault == "close":
            os.close(self.out)
            time.sleep(3600)
        elif fault == "type":
            self.frame(77, b"x")
            self.frame(255, b"")
        elif fault == "length":
            os.write(self.out, struct.pack("!BI", 1, 0xFFFFFFFF))
        elif fault == "msgpack":
            self.frame(1, b"\xc1\xc1")
            self.frame(255, b"")
        elif fault == "empty":
            self.frame(255, b"")
        elif fault == "fields":
            self.frame(1, msgpack.packb({"hello": 1}))
            self.frame(255, b"")
        elif fault == "sequence":
            self.reply({**action, "sequenceId": 999})

    def frame(self, field_type, body):
        data = struct.pack("!BI", field_type, len(body)) + body
        while data:
            data = data[os.write(self.out, data) :]

    def reply(self, action, success=True, message="", code="", result=None):
        agent = {
            "screenWidth": W,
            "screenHeight": H,
            "lastAction": action["action"],
            "lastActionSuccess": success,
            "errorMessage": message,
            "errorCode": code,
            "actionReturn": result,
            "sceneName": "scripted",
            "thirdPartyCameras": [],
            "objects": [],
            "inventoryObjects": [],
            "colors": [],
            "agent": {
                "position": {"x": self.steps, "y": 0.9, "z": 0},
                "rotation": {"x": 0, "y": 0, "z": 0},
                "cameraHorizon": 0,
            },
        }
        message = {"agents": [agent], "sequenceId": action["sequenceId"], "activeAgentId": 0}
        self.frame(1, msgpack.packb({**message, "thirdPartyCameras": []}))
        self.frame(4, bytes([self.steps % 256]) * (W * H * 3))
        self.frame(255, b"")

    def receive(self):
        field_type, length = struct.unpack("!BI", self.inp.read(5))
        body = self.inp.read(length)
        self.inp.read(5)
        assert field_type == 2
        return json.loads(body)

    def act(self, action):
        name = action["action"]
        if name == "GetScenesInBuild":
            return self.reply(action, result=[])
        if name == "Unknown":
            return self.reply(action, False, "Invalid action: Unknown", "InvalidAction")
        if name == "Refused":
            return self.reply(action, False, "no room", "")
        if name == "Reset":
            self.steps = 0
            self.counts = {}
        if name == "MoveAhead":
            self.steps += 1
        return self.reply(action)

    def run(self):
        while True:
            action = self.receive()
            self.counts[action["action"]] = self.counts.get(action["action"], 0) + 1
            if action["action"] == ACTION and self.counts[ACTION] == NUMBER:
                self.misbehave(action)
            self.act(action)


if __name__ == "__main__":
    Peer().run()

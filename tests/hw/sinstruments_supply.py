"""An OWON on sinstruments' server, which sends at the speed of a serial line: python FILE PORT."""

from __future__ import annotations

import sys

from sinstruments.simulator import BaseDevice, Server


class Owon(BaseDevice):
    """Knows what the maker's protocol page lists, and answers as the page shows."""

    baudrate = 115200

    def __init__(self, name: str, **options: object) -> None:
        super().__init__(name, **options)
        self.numbers = {"VOLT": 0.0, "CURR": 1.0, "VOLT:LIM": 61.0, "CURR:LIM": 10.1}
        self.on = False

    def handle_message(self, message: bytes) -> bytes | None:
        header, _, number = message.decode().strip().partition(" ")
        if not header.endswith("?"):
            if header == "OUTP":
                self.on = number == "1"
            elif header in self.numbers:
                self.numbers[header] = float(number)
            return None
        measured = self.numbers["VOLT"] if self.on else 0.0
        answers = {name: f"{value:.3f}" for name, value in self.numbers.items()} | {
            "*IDN": "OWON,SPE6103,2102345,FV:V2.1.0",
            "OUTP": "ON" if self.on else "OFF",
            "MEAS:VOLT": f"{measured:.3f}",
            "MEAS:CURR": f"{measured / 10:.3f}",
        }
        return (answers.get(header[:-1], "ERR") + "\r\n").encode()


class Registered:
    """What sinstruments expects of an entry in its registry."""

    @staticmethod
    def load() -> type[Owon]:
        return Owon


if __name__ == "__main__":
    place = {"type": "tcp", "url": ["127.0.0.1", int(sys.argv[1])]}
    device = {"class": "Owon", "name": "owon", "transports": [place]}
    server = Server([device], registry={"Owon": Registered()})
    print("ready", flush=True)
    server.serve_forever()

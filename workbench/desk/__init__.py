"""The desk: where a run that is under way can be seen, answered and stopped from other processes.

What lives here: the card that says who carries out an experiment, a file that the system unlocks
when that process dies (`card.py`); the desk itself, a loopback server in the run's process
(`desk.py`); and what another process holds of it (`visitor.py`). What does not: pages
(`panel`), the terminal (`cli`), and what a run does (`engine`). Nothing here ever makes a run
wait: it leaves what it is doing at the desk and goes on.

    with open_desk(runs, experiment, facts) as desk:
        desk.show_phase("rest 2 s")                       # seen by whoever watches
        with desk.ask("Clamp the foot.", typed=False) as question:
            question.wait(0.1)                            # a Reply, or None so far

To show one more thing to those who watch: one field of `desk.Shown`, one method that changes it.
"""

from workbench.desk.card import Card, cards, claim, holder
from workbench.desk.desk import Desk, Question, Reply, open_desk
from workbench.desk.visitor import answer, pause, press_stop, watch

__all__ = [
    "Card",
    "Desk",
    "Question",
    "Reply",
    "answer",
    "cards",
    "claim",
    "holder",
    "open_desk",
    "pause",
    "press_stop",
    "watch",
]

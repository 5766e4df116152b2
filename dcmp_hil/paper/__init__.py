"""The paper, reproduced: its own simulation, its printed equations, and figures 1 to 4.

reproduction = reproduce()
all(row.passed for row in reproduction.rows)
draw(reproduction, Path("paper"))
"""

from dcmp_hil.paper.figures import draw
from dcmp_hil.paper.panels import FIGURES
from dcmp_hil.paper.reproduction import Reproduction, reproduce
from dcmp_hil.paper.rows import Misprint, Row, as_json

__all__ = ["FIGURES", "Misprint", "Reproduction", "Row", "as_json", "draw", "reproduce"]

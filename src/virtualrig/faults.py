"""Faults of the virtual rig's pump: each changes the tables of a healthy pump.

Chamber 0 is the one whose piston is furthest out at crank angle zero; chamber k is k pitches of the
pistons ahead of it. Faults of a plate or of the suction line act on all chambers alike.
"""

from dataclasses import dataclass

import numpy as np

from virtualrig import pump as tables


@dataclass(frozen=True)
class Leak:
    """A leakage path of a `chamber`: `slipper` to the case, `cylinder` to the next chamber.

    At the pressure drop `reference`, Pa, it passes the flow of a sharp-edged orifice of
    `leak_area`, m2, with the pump's discharge coefficient. The share `laminar` of it is
    proportional to the drop, as flow through a sealing gap is, the rest to the drop's square root
    (Bergada, Watton, Haynes, Davies, Meccanica 45, 2010: a slipper's lands are laminar, its feeding
    hole is an orifice).
    """

    kind: str
    leak_area: float
    laminar: float = 0.0
    reference: float = 1e7
    chamber: int = 0

    def apply(self, chambers: np.ndarray, ports: np.ndarray) -> None:
        hole, gap = {
            "slipper": (tables.SLIPPER, tables.CASE_LEAK),
            "cylinder": (tables.NEIGHBOUR, tables.NEIGHBOUR_GAP),
        }[self.kind]
        coefficient = ports[tables.ORIFICE] * self.leak_area
        chambers[self.chamber, hole] += (1 - self.laminar) * coefficient
        if self.laminar > 0:
            chambers[self.chamber, gap] += self.laminar * coefficient / np.sqrt(self.reference)


@dataclass(frozen=True)
class WornValvePlate:
    """Sealing lands worn about both dead centres: a chamber there is open to both ports.

    Delivery then leaks to suction by way of the chambers that pass, once a piston. `leak_area`, m2,
    is the greatest area of either side; it vanishes 15 degrees from the dead centre. Worn and
    scored valve plates are measured by Keller, Sciancalepore and Vacca (condition monitoring of an
    axial piston pump on a mini excavator), erosion that joins the ports is modelled in Mathematics
    10, 2461, 2022.
    """

    leak_area: float

    def apply(self, chambers: np.ndarray, ports: np.ndarray) -> None:
        ports[tables.WEAR] += ports[tables.ORIFICE] * self.leak_area


@dataclass(frozen=True)
class BlockedPort:
    """Debris in the suction passage of chamber 0: the share `open_share` of its area is left.

    The chamber fills late, cavitates where it cannot follow, and delivers late. Source of the
    mechanism, incomplete filling: Ivantysyn and Ivantysynova, Hydrostatic Pumps and Motors, 2001.
    """

    open_share: float

    def apply(self, chambers: np.ndarray, ports: np.ndarray) -> None:
        chambers[0, tables.INLET] *= self.open_share


@dataclass(frozen=True)
class CavitatingSuction:
    """A clogged suction line: `suction_pressure`, Pa gauge, at the pump's inlet.

    Free air expands in every chamber, which is then compressed late (the softness of
    `virtualrig.pump.compression`). Merritt, Hydraulic Control Systems, 1967, section 2.4.
    """

    suction_pressure: float

    def apply(self, chambers: np.ndarray, ports: np.ndarray) -> None:
        ports[tables.SUCTION] = self.suction_pressure

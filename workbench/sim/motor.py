"""The motor of the robot, FA-130RA in a gearbox of 115:1, as numbers and a torque-speed line.

The thesis (2.2.4) names an "FA130-RA DC-motor" in "a Tamiya gearbox with a gear ratio of 115:1" and
says of its internal parameters (3.3.4) that the data sheet is not very accurate and that they would
have had to be measured. They still are not, so every number here says what it is:

- data sheet: Mabuchi's line for the bare motor at one voltage. The sheet itself was not at hand;
  public documents that quote it independently agree on every figure used here (no load 9100 r/min
  and 0.20 A, stall 26 g cm and 2.20 A at 1.5 V for the -2270; 12300 r/min and 0.15 A, 36 g cm and
  2.10 A at 3 V for the -18100). The stall values of such sheets are extrapolated.
- derived: follows from those by the equations at `Motor`.
- estimate: reasoned, not measured; the docstring of the field gives the reasoning.

Free-running speed in rad/s against the thesis' line of the real robot, 4.4 U - 2.9 (eq. 5.7):

    U [V]     FA-130RA-18100   FA-130RA-2270   thesis
      1             3.2             5.2          1.5
      2             7.2            11.3          5.9
      3            11.2            17.4         10.3
      4            15.2            23.5         14.7
      5            19.2            29.6         19.1
      5.5          21.3            32.6         21.3

The -18100 comes within 0.9 rad/s from 3 V on, without having been fitted, and the
FA-130 that comes with Tamiya's gearboxes is one for up to 3 V (Pololu, "Tamiya 'Toy' Motor
Testing"); so it is the one that the drive uses. Its line crosses zero at 0.21 V and the real one's
at 0.66 V: what the gears rub is not in the data sheet and not in this model.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

__all__ = ["MOTOR", "Motor"]

_RPM = 2 * pi / 60


@dataclass(frozen=True)
class Motor:
    """A brushed DC motor and its gearbox, without the inductance, which is over in 0.2 ms.

    At the motor's shaft, with current i and speed w:  U = R i + Ke w,  torque = Kt i - friction.
    Behind the gearbox the speed is w / gear and the torque is gear times efficiency times as much.
    Kt and Ke are one number in an ideal motor; here each reproduces its own end of the sheet's line
    and Kt is smaller by a sixth (-18100) or a ninth (-2270), as losses and rounding would have it.

    Args:
        name: type of the motor.
        nominal_V: voltage of the data sheet [V]; data sheet.
        no_load_speed: of the motor's shaft [rad/s]; data sheet.
        no_load_current: [A]; data sheet.
        stall_torque: of the motor's shaft [N m]; data sheet.
        stall_current: [A]; data sheet.
        gear: turns of the motor for one of the rotor; thesis, 2.2.4.
        efficiency: share of the torque that the gearbox passes on; estimate: 0.85 a stage, which
            MIT 2.007 (2008, "Motor Information") gives for another Tamiya gearbox, and four stages,
            as 4.25 x 3 x 3 x 3 = 115. The free-running speed does not depend on it.
        armature: inertia about the motor's shaft [kg m^2]; estimate: three poles with winding, 6 g
            of the motor's 18 g, as a solid cylinder of 5.8 mm radius, 1/2 m r^2. The first gear
            wheel adds 2 %. Right within a factor of two; behind the gear it is thirty times the
            rotor's own inertia and keeps the speed as even as 2.2.4 says that it is.
    """

    name: str
    nominal_V: float
    no_load_speed: float
    no_load_current: float
    stall_torque: float
    stall_current: float
    gear: float = 115.0
    efficiency: float = 0.85**4
    armature: float = 1.0e-7

    @property
    def resistance(self) -> float:
        """Return R [ohm]; derived: at stall nothing else limits the current."""
        return self.nominal_V / self.stall_current

    @property
    def back_emf(self) -> float:
        """Return Ke at the motor's shaft [V s/rad]; derived from the free-running motor."""
        drop = self.no_load_current * self.resistance
        return (self.nominal_V - drop) / self.no_load_speed

    @property
    def torque_constant(self) -> float:
        """Return Kt at the motor's shaft [N m/A]; derived from the stalled motor."""
        return self.stall_torque / (self.stall_current - self.no_load_current)

    @property
    def friction(self) -> float:
        """Return the friction at the motor's shaft [N m]; derived: what the no-load current buys.

        Taken as independent of speed; the sheet has one speed only.
        """
        return self.torque_constant * self.no_load_current

    @property
    def passed_on(self) -> float:
        """Return torque behind the gearbox over torque before it."""
        return self.gear * self.efficiency

    def holding_torque(self, volts: float) -> float:
        """Return the torque behind the gearbox that just stops it [N m], at a voltage above 0."""
        torque = self.torque_constant * volts / self.resistance - self.friction
        return max(torque, 0.0) * self.passed_on


MOTOR = Motor("FA-130RA-18100", 3.0, 12300 * _RPM, 0.15, 3.53e-3, 2.10)
"""The motor of the robot, as the module's table suggests; the thesis does not give its winding.
Data sheet at 3 V: 12300 rpm and 0.15 A free, 3.53 mN m (36 g cm) and 2.10 A stalled."""

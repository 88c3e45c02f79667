"""Dynamics, identification and minimum-impedance control of backdrivable arms.

Arrays are NumPy arrays of float64 in SI units. Names carry the unit unless there is a standard symbol:
``q`` (rad), ``qd`` (rad/s), ``qdd`` (rad/s^2), ``tau`` (N m). Logs are ``(samples, joints)``. Invalid
input raises an exception that names argument, expected and actual shape or value.

>>> import numpy as np, supple
>>> arm = supple.Arm.load("wam4")
>>> arm.mass_matrix(arm.home_rad).shape
(4, 4)
"""

from supple._base import BaseParameters, base_parameters
from supple._dh import dh_to_urdf
from supple._excite import Excitation, Recording, design_excitation, excite
from supple._fit import Fit, Payload, Validation, Weighing
from supple._identify import DataWarning, FrictionColumns, identify
from supple._learn import Learned, learn
from supple._live import Answer, Refused, SetPoints, State, States, System, connect, simulated
from supple._log import Log, Truth, read_log
from supple._native import Arm, Friction, __version__, assets
from supple._plant import plant_options
from supple._simulate import Run, simulate
from supple._sweep import Failed, Sweep, sweep

__all__ = [
    "Answer",
    "Arm",
    "BaseParameters",
    "DataWarning",
    "Excitation",
    "Failed",
    "Fit",
    "Friction",
    "FrictionColumns",
    "Learned",
    "Log",
    "Payload",
    "Recording",
    "Refused",
    "Run",
    "SetPoints",
    "State",
    "States",
    "Sweep",
    "System",
    "Truth",
    "Validation",
    "Weighing",
    "__version__",
    "assets",
    "base_parameters",
    "connect",
    "design_excitation",
    "dh_to_urdf",
    "excite",
    "identify",
    "learn",
    "plant_options",
    "read_log",
    "simulate",
    "simulated",
    "sweep",
]

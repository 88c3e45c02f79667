"""Prints the constants of tests/ident/filter.rs. Needs scipy."""
import numpy as np
from scipy import signal

n = np.arange(40)
x = np.sin(0.21 * n) + 0.3 * np.cos(1.7 * n) + 0.01 * n**1.5
sos = signal.butter(4, 8.0, fs=100.0, output="sos")
print("sosfiltfilt", [float(v) for v in signal.sosfiltfilt(sos, x)])
b, a = signal.butter(4, 8.0, fs=100.0)
print("filtfilt differs by", np.abs(signal.filtfilt(b, a, x) - signal.sosfiltfilt(sos, x)).max())

"""Calibration interface of LeRobot's devices, for simulated ones, which need none."""


class NeedsNoCalibration:
    """A device whose joints mean what its model says."""

    @property
    def is_calibrated(self) -> bool:
        """True: a simulated device is always calibrated."""
        return True

    def calibrate(self) -> None:
        """Do nothing: a simulated joint needs no calibration."""

    def configure(self) -> None:
        """Do nothing: a world is configured when it is made."""

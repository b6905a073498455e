"""Calibration interface of LeRobot's devices, for those that need none: simulated and industrial arms."""


class NeedsNoCalibration:
    """A device whose joints mean what its model says."""

    @property
    def is_calibrated(self) -> bool:
        """True: such a device is always calibrated."""
        return True

    def calibrate(self) -> None:
        """Do nothing: its joints need no calibration."""

    def configure(self) -> None:
        """Do nothing: it is configured when it is made, or connected."""

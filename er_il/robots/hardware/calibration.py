"""What LeRobot asks of every device and a simulated one does not need."""


class NeedsNoCalibration:
    """A device whose joints mean what its model says."""

    @property
    def is_calibrated(self) -> bool:
        """Whether it is ready to be moved."""
        return True

    def calibrate(self) -> None:
        """Do nothing: a simulated joint needs no calibration."""

    def configure(self) -> None:
        """Do nothing: a world is configured when it is made."""

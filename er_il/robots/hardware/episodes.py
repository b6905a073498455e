"""Detection of episode starts: devices listen to LeRobot's announcements."""

import logging

# What lerobot-record and lerobot-rollout say aloud, and log.
EPISODE, RESET = "Recording episode", "Reset the environment"


class EpisodeAnnouncements(logging.Handler):
    """Hears the stock commands announce episodes, as the person at the table does.

    LeRobot tells neither robots nor teleoperators where an episode begins. Its commands do say so
    to the operator, through the root logger; that is when a person has put the objects back, and
    when the simulated world must start over.
    """

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.episode = 0  # of the session; as long as nothing is announced, the first
        self.resetting = False  # between two episodes
        self._announced = 0

    def listen(self) -> None:
        """Start to listen, and to count from the first episode."""
        self.episode = self._announced = 0
        self.resetting = False
        logging.getLogger().addHandler(self)

    def stop(self) -> None:
        """Stop listening."""
        logging.getLogger().removeHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        said = record.getMessage()
        if said.startswith(EPISODE):
            self.episode = self._announced
            self._announced += 1
        if said.startswith((EPISODE, RESET)):
            self.resetting = said.startswith(RESET)
